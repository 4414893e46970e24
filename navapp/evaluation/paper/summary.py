"""What a whole evaluation says: by method, and ours beside the paper's figures."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from navapp.evaluation.campaign import Done
from navapp.evaluation.paper.published import find_published
from navapp.evaluation.paper.rows import Row, is_within_bound, is_wrong
from navapp.tracking import Method


@dataclass(frozen=True, slots=True)
class Judged:
    """How far the judge's word on a method can be believed."""

    method: Method
    n_frames: int
    n_ok: int
    n_knees: int  # with an OK frame
    n_wrong: int  # OK, further off than 1 mm and than the bound
    n_wrong_knees: int  # with such a frame
    # of OK frames the share within their bound; None without any.
    coverage: float | None

    @property
    def wrong_at_most(self) -> tuple[float, float]:
        """Upper 95 % limits of the share of wrong ones: of OK frames, and of knees."""
        return (
            find_upper_limit(self.n_wrong, self.n_ok),
            find_upper_limit(self.n_wrong_knees, self.n_knees),
        )

    def to_json(self) -> dict[str, Any]:
        """Named values."""
        by_frames, by_knees = self.wrong_at_most
        return {
            "frames": self.n_frames,
            "ok": self.n_ok,
            "knees": self.n_knees,
            "wrong_and_ok": self.n_wrong,
            "wrong_share_at_most": {"of_ok_frames": by_frames, "of_knees": by_knees},
            "bound_coverage": self.coverage,
        }


def find_upper_limit(n_found: int, n_all: int) -> float:
    """One-sided 95 % limit of a share (Clopper and Pearson 1934); 1 of nothing."""
    from scipy.special import betaincinv

    if n_found >= n_all:
        return 1.0
    return float(betaincinv(n_found + 1, n_all - n_found, 0.95))


def judge_method(method: Method, done: Sequence[Done[Any]]) -> Judged:
    """Pool all tests of a method.

    Frames of one knee are much alike: the limit by knees is the one to be believed.
    """
    n_frames = n_ok = n_wrong = n_within = 0
    knees: set[int] = set()  # seeds: a knee has its own, at all levels of a stress
    wrong_knees: set[int] = set()
    for one in done:
        frames = one.followed[method].frames
        ok = [frame for frame in frames if frame.is_ok and frame.tre_mm is not None]
        wrong = sum(is_wrong(frame) for frame in ok)
        n_frames, n_ok, n_wrong = n_frames + len(frames), n_ok + len(ok), n_wrong + wrong
        n_within += sum(is_within_bound(frame) for frame in ok)
        if ok:
            knees.add(one.test.seed)
        if wrong:
            wrong_knees.add(one.test.seed)
    coverage = n_within / n_ok if n_ok else None
    return Judged(method, n_frames, n_ok, len(knees), n_wrong, len(wrong_knees), coverage)


def compare_with_paper(rows: Sequence[Row]) -> dict[str, Any]:
    """In how many cases ours is nearer and faster than the paper's proposal says of itself."""
    ours = [row for row in rows if row.method == "bimcc"]
    nearer = [
        row.overlay_mm is not None and row.overlay_mm < find_published(row.case).paper_mm
        for row in ours
    ]
    faster = [row.fps is not None and row.fps > find_published(row.case).paper_fps for row in ours]
    return {"cases": len(ours), "nearer": sum(nearer), "faster": sum(faster)}
