"""How far the judge's word on a method can be believed: wrong poses that it called OK."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from navapp.evaluation.frame_figures import FrameFigures, pool_frames
from navapp.evaluation.scores import FrameScore


@dataclass(frozen=True, slots=True, eq=False)
class JudgeFigures:
    """How often the judge called wrong poses of one method OK, over all knees."""

    method: str
    figures: FrameFigures
    n_knees: int  # with an OK frame
    n_wrong_knees: int  # with a wrong one that is OK

    def find_upper_limits(self) -> tuple[float, float]:
        """Upper 95 % limits of the share of wrong ones: of OK frames, and of knees.

        Frames of one knee are much alike: the limit by knees is the one to be believed.
        """
        return (
            find_upper_limit(self.figures.n_wrong, self.figures.n_ok),
            find_upper_limit(self.n_wrong_knees, self.n_knees),
        )

    def to_json(self) -> dict[str, Any]:
        """Named values."""
        by_frames, by_knees = self.find_upper_limits()
        return {
            "frames": self.figures.n_frames,
            "ok": self.figures.n_ok,
            "knees": self.n_knees,
            "wrong_and_ok": self.figures.n_wrong,
            "wrong_share_at_most": {"of_ok_frames": by_frames, "of_knees": by_knees},
            "bound_coverage": self.figures.bound_coverage,
        }


def find_upper_limit(n_found: int, n_all: int) -> float:
    """One-sided 95 % limit of a share (Clopper and Pearson 1934); 1 of nothing."""
    from scipy.stats import binomtest

    if n_found >= n_all:
        return 1.0
    interval = binomtest(n_found, n_all, alternative="less").proportion_ci(0.95, method="exact")
    return float(interval.high)


def judge_method(method: str, knees: Iterable[tuple[int, Sequence[FrameScore]]]) -> JudgeFigures:
    """Pool all frames of a method.

    Args:
        method: its name.
        knees: seed and frames of each test; a knee may have several.
    """
    tests = [(seed, FrameFigures(tuple(frames))) for seed, frames in knees]
    return JudgeFigures(
        method,
        pool_frames(figures.frames for _, figures in tests),
        len({seed for seed, figures in tests if figures.n_ok}),
        len({seed for seed, figures in tests if figures.n_wrong}),
    )
