"""How much of the model a fit explains: what decides between two of them."""

from collections.abc import Sequence

from navapp.geometry.transform import RigidTransform
from navapp.registration import ScoredPose, find_poses, rank_fits
from navapp.registration.multi_start import NEAR_SETTINGS
from navapp.registration.verdict import Agreement, is_bone_absent
from navapp.tracking.agreement import compare
from navapp.tracking.frame import Fit, ignore, limit_kernel
from navapp.tracking.surface_meter import Measurement, SurfaceMeter
from navapp.values.progress import Progress


class FitScorer:
    """Scores fits of one bone under one rig."""

    def __init__(self, meter: SurfaceMeter) -> None:
        self._meter = meter

    def score(self, fit: Fit) -> float:
        """How much of the model a fit explains, 0 to 1; 0 without a covariance."""
        return self.explain(fit.pose, fit.measured) if fit.estimate.has_finite_covariance else 0.0

    def explain(self, pose: RigidTransform, measured: Measurement) -> float:
        """How much of the model, at a pose in the rectified left camera, a measurement explains."""
        found = self._compare(pose, measured)
        return found.coverage * found.inlier_fraction

    def is_there(self, fit: Fit) -> bool:
        """Whether so much of the model agrees with what it was fitted to that it may be there."""
        return not is_bone_absent(self._compare(fit.pose, fit.measured))

    def rank(self, fits: list[Fit]) -> list[Fit]:
        """Fits, best first; the best one says so when it is ambiguous (`rank_fits`)."""
        return rank_fits(fits, [self.score(fit) for fit in fits], self._meter.model.centre_mm)

    def find_poses(
        self,
        measured: Measurement,
        starts: Sequence[RigidTransform],
        on_progress: Progress = ignore,
    ) -> list[ScoredPose]:
        """Distinct poses that starts lead to on a measured surface, by what they explain of it."""
        return find_poses(
            measured.scene,
            self._meter.model,
            starts,
            lambda pose: self.explain(pose, measured),
            on_progress,
            limit_kernel(NEAR_SETTINGS, self._meter.model),
        )

    def _compare(self, pose: RigidTransform, measured: Measurement) -> Agreement:
        model, geometry = self._meter.model, self._meter.geometry
        view = model.render(pose, geometry, measured.disparity.box)
        return compare(view, model, measured.disparity, geometry)
