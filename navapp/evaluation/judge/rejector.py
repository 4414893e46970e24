"""The judge as a rejector: what is left of the error when the frames it trusts least are left out.

Sources: risk against coverage El-Yaniv and Wiener 2010, area below it Geifman, Uziel and
El-Yaniv 2019; area under the ROC curve by ranks Hanley and McNeil 1982.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from navapp.evaluation.scores import WRONG_MM, FrameScore
from navapp.geometry.transform import FloatArray

Flags = NDArray[np.bool_]

# Points of a curve, from no frame rejected to all but one in a hundred.
SHARES = np.linspace(0.0, 0.99, 100)
# Shares of frames that are rejected in the table.
TOLD_SHARES = (0.0, 0.1, 0.3, 0.5)


def _by_bound(frame: FrameScore) -> float:
    return math.inf if frame.bound_mm is None else frame.bound_mm


def _by_rms(frame: FrameScore) -> float:
    return math.inf if frame.rms_ratio is None else frame.rms_ratio


def _by_coverage(frame: FrameScore) -> float:
    return math.inf if frame.seen is None else -frame.seen


def _by_error(frame: FrameScore) -> float:
    return math.inf if frame.tre_mm is None else frame.tre_mm


# What frames can be rejected by: the larger, the sooner. The error itself is the best there is, and
# nobody has it.
SCORES: dict[str, Callable[[FrameScore], float]] = {
    "bound": _by_bound,
    "rms": _by_rms,
    "coverage": _by_coverage,
    "error": _by_error,
}


@dataclass(frozen=True, slots=True, eq=False)
class Rejection:
    """Errors of the frames that are kept, against the share that is rejected, by one score."""

    mean_mm: FloatArray  # (100,) at `SHARES`
    p95_mm: FloatArray  # (100,)
    area_mm: float  # mean error that is kept, mean over all shares
    auc: float | None  # of the ROC curve for errors beyond `WRONG_MM`; None without either kind

    def to_json(self) -> dict[str, Any]:
        """Named values."""
        return {
            "area_mm": self.area_mm,
            "auc": self.auc,
            "mean_mm": self.mean_mm.tolist(),
            "p95_mm": self.p95_mm.tolist(),
        }


@dataclass(frozen=True, slots=True)
class OperatingPoint:
    """Where the judge itself stands: what is not OK is refused."""

    n_wrong: int  # frames further off than `WRONG_MM`
    n_right: int
    wrong_refused: float | None  # share of the wrong ones that is refused; None without any
    right_refused: float | None


@dataclass(frozen=True, slots=True, eq=False)
class Rejector:
    """The judge on all frames that have a pose."""

    n_frames: int
    n_without_pose: int  # refused, and nobody knows how far off they are
    by: dict[str, Rejection]  # of `SCORES`
    point: OperatingPoint
    roc: (
        FloatArray  # (N, 2) shares of right and of wrong frames refused, by the bound; may be empty
    )

    def to_json(self) -> dict[str, Any]:
        """Named values."""
        return {
            "frames": self.n_frames,
            "without_pose": self.n_without_pose,
            "wrong_beyond_mm": WRONG_MM,
            "rejected_shares": SHARES.tolist(),
            "by": {name: one.to_json() for name, one in self.by.items()},
            "operating_point": asdict(self.point),
            "roc": self.roc.tolist(),
        }


def judge_rejector(frames: Sequence[FrameScore]) -> Rejector | None:
    """All frames of a method, of all knees together; None where none has an error."""
    posed = [frame for frame in frames if frame.tre_mm is not None]
    if not posed:
        return None
    errors_mm = np.array([frame.tre_mm for frame in posed], dtype=np.float64)
    is_wrong = errors_mm > WRONG_MM
    scores = {name: np.array([get(one) for one in posed]) for name, get in SCORES.items()}
    by = {name: _reject(errors_mm, score, is_wrong) for name, score in scores.items()}
    is_refused = np.array([not frame.is_ok for frame in posed])
    point = OperatingPoint(
        int(is_wrong.sum()),
        int((~is_wrong).sum()),
        _share(is_refused[is_wrong]),
        _share(is_refused[~is_wrong]),
    )
    roc = trace_roc(scores["bound"], is_wrong)
    return Rejector(len(posed), len(frames) - len(posed), by, point, roc)


def _reject(errors_mm: FloatArray, score: FloatArray, is_wrong: Flags) -> Rejection:
    kept_mm = errors_mm[np.argsort(score, kind="stable")]
    n_kept = np.maximum(np.ceil((1.0 - SHARES) * len(kept_mm) - 1e-9), 1).astype(int)
    means = np.cumsum(kept_mm) / np.arange(1, len(kept_mm) + 1)
    p95 = np.array([np.percentile(kept_mm[:n], 95.0) for n in n_kept])
    return Rejection(means[n_kept - 1], p95, float(means.mean()), find_auc(score, is_wrong))


def find_auc(score: FloatArray, is_wrong: Flags) -> float | None:
    """Chance that a wrong frame has a larger score than a right one, ties by half."""
    from scipy.stats import rankdata

    n_wrong, n_right = int(np.sum(is_wrong)), int(np.sum(~is_wrong))
    if n_wrong == 0 or n_right == 0:
        return None
    ranks = rankdata(score)[is_wrong].sum() - 0.5 * n_wrong * (n_wrong + 1)
    return float(ranks / (n_wrong * n_right))


def trace_roc(score: FloatArray, is_wrong: Flags) -> FloatArray:
    """(N, 2) shares of right and of wrong frames with a score beyond each value of it, rising."""
    n_wrong, n_right = int(np.sum(is_wrong)), int(np.sum(~is_wrong))
    if n_wrong == 0 or n_right == 0:
        return np.empty((0, 2))
    order = np.argsort(-score, kind="stable")
    # Frames with the same score are refused together.
    ranked = score[order]
    is_last = np.append(ranked[1:] != ranked[:-1], True)  # a difference of two infinities is none
    wrong = np.cumsum(is_wrong[order])[is_last] / n_wrong
    right = np.cumsum(~is_wrong[order])[is_last] / n_right
    return np.vstack([[0.0, 0.0], np.column_stack([right, wrong])])


def _share(values: Flags) -> float | None:
    return float(np.mean(values)) if len(values) else None
