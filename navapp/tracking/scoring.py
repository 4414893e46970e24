"""How much of the model a fit explains: what decides between two of them."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from navapp.geometry.transform import RigidTransform
from navapp.registration import Candidate, RegistrationModel, find_candidates, is_same_pose
from navapp.registration.verdict import is_elsewhere
from navapp.tracking.agreement import compare_at
from navapp.tracking.frame import Fit, ignore
from navapp.tracking.surface_meter import Measurement, SurfaceMeter
from navapp.values import Reason

# A different pose that explains as much as this of the best one makes that one a guess; chosen.
AMBIGUOUS_FRACTION = 0.9


class FitScorer:
    """Scores fits of one bone under one rig."""

    def __init__(self, meter: SurfaceMeter) -> None:
        self._meter = meter

    def score(self, fit: Fit) -> float:
        """How much of the model a fit explains, 0 to 1; 0 without a covariance."""
        is_fixed = np.isfinite(fit.estimate.covariance).all()
        return self.explain(fit.pose, fit.measured) if is_fixed else 0.0

    def explain(self, pose: RigidTransform, measured: Measurement) -> float:
        """How much of the model, at a pose in the rectified left camera, a measurement explains."""
        model, geometry = self._meter.model, self._meter.geometry
        found = compare_at(pose, model, measured.disparity, geometry)
        return found.coverage * found.inlier_fraction

    def is_there(self, fit: Fit) -> bool:
        """Whether so much of the model agrees with what it was fitted to that it may be there."""
        model, geometry = self._meter.model, self._meter.geometry
        return not is_elsewhere(compare_at(fit.pose, model, fit.measured.disparity, geometry))

    def rank(self, fits: list[Fit]) -> list[Fit]:
        """Fits of different candidates, best first; see `rank_fits`."""
        return rank_fits(fits, [self.score(fit) for fit in fits], self._meter.model)

    def find_candidates(
        self,
        measured: Measurement,
        starts: Sequence[RigidTransform],
        on_progress: Callable[[float], None] = ignore,
    ) -> list[Candidate]:
        """Distinct poses that starts lead to on a measured surface, by what they explain of it."""
        return find_candidates(
            measured.scene,
            self._meter.model,
            starts,
            lambda pose: self.explain(pose, measured),
            on_progress,
        )


def rank_fits(fits: list[Fit], scores: list[float], model: RegistrationModel) -> list[Fit]:
    """The fits, best first; the best one says so when a different one explains as much.

    Args:
        fits: of different candidates.
        scores: how much of the model each explains.
        model: of the bone.
    """
    order = np.argsort([-score for score in scores], kind="stable")
    ranked = [fits[k] for k in order]
    if len(ranked) < 2 or scores[order[0]] <= 0.0:
        return ranked
    best = ranked[0]
    is_guess = any(
        scores[k] >= AMBIGUOUS_FRACTION * scores[order[0]]
        and not is_same_pose(best.pose, fits[k].pose, model.centre_mm)
        for k in order[1:]
    )
    if not is_guess:
        return ranked
    return [replace(best, estimate=best.estimate.with_reason(Reason.AMBIGUOUS)), *ranked[1:]]


def select_poses(
    candidates: list[Candidate], most: int, least_fraction: float
) -> list[RigidTransform]:
    """Of the candidates that explain enough beside the best, the first ones."""
    least = least_fraction * max((one.score for one in candidates), default=0.0)
    return [one.scene_from_bone for one in candidates[:most] if one.score >= least]
