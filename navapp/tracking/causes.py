"""What is wrong for good: pictures that are swapped, or a plan of the other knee.

The judge says that nothing fits. Here it is asked whether something else would: the same pictures
the other way round, or the same bone's mirror image. Only asked when a bone is not found.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from navapp.geometry.rectification import Image, RectifiedGeometry, RectifiedPair
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.registration import RegistrationModel, tilted_starts
from navapp.stereo import are_swapped, reproject
from navapp.tracking.first_look import AMBIGUOUS_SHARE
from navapp.tracking.fit_judge import FitJudge
from navapp.tracking.follower import Fit, fitted
from navapp.tracking.locator import STEREO_SETTINGS, WIDE_VIEW
from navapp.tracking.surface_meter import Measurement, SurfaceMeter
from navapp.values import DisparityMap, Reason, Status, TrackedFrame

# What is said of a surface that was seen well enough, but is another one's.
_UNFIT = frozenset({Reason.SURFACE_MISFIT, Reason.SEEN_THROUGH, Reason.OUTLIERS})
# Tilts of the start (deg, how many), as far as a rough pose is off; so many ends are refined.
_TILTS, _N_REFINED = (15.0, 12), 3
_MIRROR = np.diag([-1.0, 1.0, 1.0])


class Causes:
    """Looks for what may be wrong for good with one bone under one rig."""

    def __init__(self, meter: SurfaceMeter, model: RegistrationModel, fit_judge: FitJudge) -> None:
        """Join what measures and what judges.

        Args:
            meter: measures surfaces.
            model: of the bone.
            fit_judge: tells how much a pose explains.
        """
        self._meter, self._model, self._fit_judge = meter, model, fit_judge

    def of_failure(
        self,
        left: Image,
        right: Image,
        around: RigidTransform | None,
        failed: TrackedFrame,
        on_progress: Callable[[float], None] = lambda share: None,
    ) -> Reason | None:
        """Why a first registration failed, when it is one of these.

        Args:
            left: picture of the left camera.
            right: of the right one.
            around: pose in the rectified camera that the bone was looked for at, if any.
            failed: the best answer.
            on_progress: told that it goes on; what it raises stops the search.
        """
        if failed.verdict.status is Status.LOST:
            cause = self.of_loss(left, right, around)
            if cause is not None:
                return cause
        reasons = failed.verdict.reasons
        if around is None or not _UNFIT.intersection(reasons):
            return None
        pair, _ = self._meter.rectified(left, right, around, WIDE_VIEW)
        cause = self._of_misfit(pair, around, on_progress)
        # Nothing has shown yet that the plan is of this bone: that comes before what is not seen.
        return cause or (Reason.SURFACE_MISFIT if Reason.SURFACE_MISFIT in reasons else None)

    def of_loss(self, left: Image, right: Image, around: RigidTransform | None) -> Reason | None:
        """Whether the pictures are swapped, around a pose or in the whole view."""
        given, exchanged = (
            self._meter.surroundings(*pictures, around)
            for pictures in ((left, right), (right, left))
        )
        return Reason.PICTURES_SWAPPED if are_swapped(*given, exchanged[0]) else None

    def _of_misfit(
        self, pair: RectifiedPair, pose: RigidTransform, on_progress: Callable[[float], None]
    ) -> Reason | None:
        """Whether the mirrored bone explains the surface clearly better.

        The bone's mirror image fits a surface where the bone fits that surface's mirror image.
        """
        measured = self._meter.freely(pair, pose, WIDE_VIEW)
        if measured is None or len(measured.cloud) == 0:
            return None
        given = self._best(measured, pose, on_progress)
        start = mirrored_pose(pose, self._model.centre_mm)
        geometry = self._meter.geometry
        mirrored = self._best(mirrored_measurement(measured, geometry), start, on_progress)
        if mirrored is None or not self._fit_judge.is_there(mirrored):
            return None
        score = 0.0 if given is None else self._fit_judge.score(given)
        is_better = score < AMBIGUOUS_SHARE * self._fit_judge.score(mirrored)
        return Reason.OTHER_SIDE if is_better else None

    def _best(
        self,
        measured: Measurement,
        start: RigidTransform,
        on_progress: Callable[[float], None],
    ) -> Fit | None:
        """Of the fits that a start and tilts of it lead to, the one that explains most."""
        starts = tilted_starts(start, start.apply(self._model.centre_mm), *_TILTS)
        found = self._fit_judge.led_to(measured, starts, lambda share: on_progress(1.0))
        fits = [
            fitted(measured, self._model, one.scene_from_bone, STEREO_SETTINGS)
            for one in found[:_N_REFINED]
        ]
        return max(fits, key=self._fit_judge.score, default=None)


def mirrored_pose(pose: RigidTransform, centre_mm: FloatArray) -> RigidTransform:
    """Where a bone stands in the mirrored camera when its mirror image stands at a pose.

    Args:
        pose: of the bone mirrored left to right about its centre.
        centre_mm: (3,) of the bone.
    """
    rotation = _MIRROR @ pose.rotation @ _MIRROR
    shift_mm = pose.apply(np.array([2.0 * centre_mm[0], 0.0, 0.0]))
    return RigidTransform.from_parts(pose.target, pose.source, rotation, _MIRROR @ shift_mm)


def mirrored_measurement(measured: Measurement, geometry: RectifiedGeometry) -> Measurement:
    """What the mirrored camera would have measured, to half a pixel of place."""
    found = measured.disparity
    right_most = found.x + found.disparity_px.shape[1] - 1
    mirrored = DisparityMap(
        np.ascontiguousarray(found.disparity_px[:, ::-1]),
        np.ascontiguousarray(found.sigma_px[:, ::-1]),
        np.ascontiguousarray(found.origin[:, ::-1]),
        round(2.0 * geometry.centre_x_px) - right_most,
        found.y,
    )
    cloud = reproject(mirrored, geometry, measured.cloud.stride_px)
    return replace(measured, disparity=mirrored, cloud=cloud)
