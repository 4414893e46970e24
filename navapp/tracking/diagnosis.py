"""Why a bone is not found: the pictures are swapped, or the plan is of the other knee.

Asked only when a bone is not found: do the pictures fit when exchanged, or does the bone's mirror
image fit them?
"""

from dataclasses import replace
from functools import partial

import numpy as np

from navapp.geometry.rectification import RectifiedGeometry, RectifiedPair
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.registration import fit_bimcc, make_near_starts, select_poses
from navapp.registration.multi_start import AMBIGUOUS_FRACTION
from navapp.stereo import are_swapped
from navapp.tracking.frame import FREE_SETTINGS, Fit, ignore, limit_kernel
from navapp.tracking.scoring import FitScorer
from navapp.tracking.surface_meter import WIDE_VIEW, Measurement, SurfaceMeter
from navapp.values import DisparityMap, Reason, Status, StereoPictures, TrackedFrame
from navapp.values.progress import Progress

# What is said of a surface that was seen well enough, but is another one's.
_UNFIT = frozenset({Reason.SURFACE_MISFIT, Reason.SEEN_THROUGH, Reason.OUTLIERS})
_MIRROR = np.diag([-1.0, 1.0, 1.0])


class Diagnosis:
    """Looks for what stays wrong until somebody mends it, for one bone under one rig."""

    def __init__(self, meter: SurfaceMeter, scorer: FitScorer) -> None:
        self._meter, self._scorer = meter, scorer

    def explain_failure(
        self,
        pictures: StereoPictures,
        around: RigidTransform | None,
        failed: TrackedFrame,
        on_progress: Progress = ignore,
    ) -> Reason | None:
        """Why a first registration failed: swapped pictures, another side's or another surface.

        Args:
            pictures: in which it was looked for.
            around: rectified left camera from bone, where it was looked for; None everywhere.
            failed: the best answer.
            on_progress: told that it goes on; what it raises stops the search.
        """
        if failed.verdict.status is Status.LOST:
            cause = self.explain_loss(pictures, around)
            if cause is not None:
                return cause
        reasons = failed.verdict.reasons
        if around is None or not _UNFIT.intersection(reasons):
            return None
        pair = self._meter.rectify(pictures.left, pictures.right, around, WIDE_VIEW)
        cause = self._explain_misfit(pair, around, on_progress)
        # Nothing has shown yet that the plan is of this bone: that comes before what is not seen.
        return cause or (Reason.SURFACE_MISFIT if Reason.SURFACE_MISFIT in reasons else None)

    def explain_loss(
        self, pictures: StereoPictures, around: RigidTransform | None
    ) -> Reason | None:
        """Whether the pictures are swapped, around a pose or in the whole view."""
        left, right = pictures.left, pictures.right
        given = self._meter.rectify_surroundings(left, right, around)
        exchanged, _ = self._meter.rectify_surroundings(right, left, around)
        return Reason.PICTURES_SWAPPED if are_swapped(*given, exchanged) else None

    def _explain_misfit(
        self, pair: RectifiedPair, pose: RigidTransform, on_progress: Progress
    ) -> Reason | None:
        """Whether the mirrored bone explains the surface clearly better.

        The bone's mirror image fits a surface where the bone fits that surface's mirror image.
        """
        measured = self._meter.measure_freely(pair, pose, WIDE_VIEW)
        if measured is None or len(measured.cloud) == 0:
            return None
        given = self._fit_best(measured, pose, on_progress)
        start = mirror_pose(pose, self._meter.model.centre_mm)
        geometry = self._meter.geometry
        mirrored = self._fit_best(mirror_measurement(measured, geometry), start, on_progress)
        if mirrored is None or not self._scorer.is_there(mirrored):
            return None
        score = 0.0 if given is None else self._scorer.score(given)
        is_better = score < AMBIGUOUS_FRACTION * self._scorer.score(mirrored)
        return Reason.OTHER_SIDE if is_better else None

    def _fit_best(
        self, measured: Measurement, start: RigidTransform, on_progress: Progress
    ) -> Fit | None:
        """Of the fits that a start and tilts of it lead to, the one that explains most."""
        starts = make_near_starts(start, start.apply(self._meter.model.centre_mm))
        found = self._scorer.find_poses(measured, starts, lambda _: on_progress(1.0))
        model = self._meter.model
        settings = limit_kernel(FREE_SETTINGS, model)
        fits = [
            Fit(fit_bimcc(measured.scene, model, pose, settings), measured)
            for pose in select_poses(found)
        ]
        return max(fits, key=self._scorer.score, default=None)


def mirror_pose(pose: RigidTransform, centre_mm: FloatArray) -> RigidTransform:
    """Where a bone stands in the mirrored camera when its mirror image is at a pose.

    It is mirrored left to right about its centre (3,).
    """
    rotation = _MIRROR @ pose.rotation @ _MIRROR
    shift_mm = pose.apply(np.array([2.0 * centre_mm[0], 0.0, 0.0]))
    return RigidTransform.from_parts(pose.target, pose.source, rotation, _MIRROR @ shift_mm)


def mirror_measurement(measured: Measurement, geometry: RectifiedGeometry) -> Measurement:
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
    make_cloud = partial(mirrored.reproject, geometry, measured.cloud.stride_px)
    return replace(measured, disparity=mirrored, make_cloud=make_cloud)
