"""Judges what is seen in the mirror: how far guides may be off for the eye, and for the other."""

from collections.abc import Mapping

import numpy as np
from scipy.special import chdtri

from navapp.control.calibrated_display import CalibratedDisplay, Eyes
from navapp.control.mirror_error import OTHER_EYE_MM, MirrorError
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import FloatArray
from navapp.overlay import MirrorView, Scene, sample_guides
from navapp.values import Plan, PoseEstimate, StageSpec, TrackedFrame

# The eye is not measured: in 95 % of cases it is this near to its calibrated place.
EYE_RADIUS_MM = 10.0
_EYE_SD_MM = EYE_RADIUS_MM / float(np.sqrt(chdtri(3, 0.05)))
# Errors vary slowly with the pose: they are predicted anew after this time, or when the pose has
# become less certain.
_VALID_NS, _MOST_GROWN = 200_000_000, 1.1
_COVERED: Mapping[Eyes, str] = {"both": "", "left": "right", "right": "left"}


class MirrorJudge:
    """Predicts the errors of the guides that are drawn, and keeps the answer for a moment.

    Args:
        display: in the mirror.
        view: of its calibrated eye.
        plan: with the guides.
    """

    def __init__(self, display: CalibratedDisplay, view: MirrorView, plan: Plan) -> None:
        self._display, self._view, self._plan = display, view, plan
        # What was judged (stage, layers, made cuts), when, and by which variances.
        self._judged: tuple[object, int, FloatArray] | None = None
        self._error: MirrorError | None = None

    def judge(
        self,
        stage: StageSpec,
        layers: tuple[str, ...],
        tracked: TrackedFrame | None,
        now_ns: int,
        surface: TriangleMesh | None = None,
        made_steps: frozenset[str] = frozenset(),
    ) -> MirrorError | None:
        """Of a stage's layers; None without a pose, or when nothing lies at the bone.

        Args:
            stage: in force.
            layers: that are drawn.
            tracked: what is said of the stage's bone.
            now_ns: on the session's clock.
            surface: what is left of the bone; None: all of it.
            made_steps: names of steps that need no guides any more.
        """
        estimate = None if tracked is None else tracked.estimate
        if estimate is None or stage.bone not in self._plan.bones:
            self._judged = self._error = None
            return None
        growth_mm = 0.0 if estimate.sized is None else estimate.sized.growth_mm
        variances = np.append(np.diag(estimate.covariance_at(np.zeros(3))), growth_mm**2)
        last = self._judged
        what = (stage.name, layers, made_steps)
        is_valid = last is not None and last[0] == what
        if last is None or not is_valid or not 0 <= now_ns - last[1] < _VALID_NS:
            is_valid = False
        # The pose's covariance may grow from one frame to the next.
        if last is None or not is_valid or not (variances <= _MOST_GROWN * last[2]).all():
            self._judged = what, now_ns, variances
            self._error = self._predict(stage, layers, estimate, surface, made_steps)
        return self._error

    def _predict(
        self,
        stage: StageSpec,
        layers: tuple[str, ...],
        estimate: PoseEstimate,
        surface: TriangleMesh | None,
        made_steps: frozenset[str],
    ) -> MirrorError | None:
        pose = estimate.camera_from_bone
        scene = Scene(self._plan, stage, pose, self._view, False, None, layers, surface, made_steps)
        points = {name: sample_guides(scene, name) for name in layers}
        points = {name: some for name, some in points.items() if len(some)}
        if not points:
            return None
        in_left = {name: pose.apply(some) for name, some in points.items()}
        other_mm = self._for_other_eye(in_left)
        bounds_mm = self._bounds_mm(points, stage, estimate)
        off = tuple(name for name, error_mm in other_mm.items() if error_mm > OTHER_EYE_MM)
        # A comparison with what is no number is False.
        inexact = tuple(name for name, mm in bounds_mm.items() if not mm <= stage.tolerance_mm)
        lit = [name for name in in_left if name not in off and name not in inexact]
        return MirrorError(
            max(bounds_mm[name] for name in lit or in_left),
            _COVERED[self._display.eyes],
            max(other_mm.values()) if other_mm else None,
            self._display.model.screen_shift_mm(np.concatenate(list(in_left.values()))),
            off,
            inexact,
            not lit,
        )

    def _bounds_mm(
        self, points_mm: Mapping[str, FloatArray], stage: StageSpec, estimate: PoseEstimate
    ) -> dict[str, float]:
        """For the viewing eye, of each layer's worst point (N, 3) of the bone."""
        model = self._display.model
        if model.quality is None or model.quality.covariance is None:
            # Nobody knows what the calibration adds.
            return dict.fromkeys(points_mm, np.inf)
        centre_mm = self._plan.bones[stage.bone].mesh.vertices_mm.mean(axis=0)
        joined = np.concatenate(list(points_mm.values()))
        covariances = estimate.predict_covariances(centre_mm, joined)
        in_left = estimate.camera_from_bone.apply(joined)
        errors_mm = _known(model.predict_error(in_left, _EYE_SD_MM, covariances))
        lasts = np.cumsum([len(some) for some in points_mm.values()])
        parts = np.split(errors_mm, lasts[:-1])
        return {name: float(part.max()) for name, part in zip(points_mm, parts, strict=True)}

    def _for_other_eye(self, points_mm: Mapping[str, FloatArray]) -> dict[str, float]:
        """The largest error of each layer; nothing when that eye is covered."""
        if self._display.eyes != "both":
            return {}
        model = self._display.model
        return {
            name: float(_known(model.error_for_other_eye_mm(some)).max())
            for name, some in points_mm.items()
        }


def _known(errors_mm: FloatArray) -> FloatArray:
    """Where a guide is not seen its error is not known: without bound."""
    return np.where(np.isfinite(errors_mm), errors_mm, np.inf)
