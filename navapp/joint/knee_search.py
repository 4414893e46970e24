"""A tibia is found from its femur: swept over the knee's flexion, fitted to the pictures, judged.

Where the knee may bend to says where to look. What is found is fitted to the pictures alone and
judged like any other pose.
"""

from typing import NamedTuple

import numpy as np
from scipy.special import stdtrit

from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.joint.occluded_tracker import OccludedTracker
from navapp.joint.swept_sampler import SweptSampler
from navapp.limb import Hinge
from navapp.registration import DepthMap, is_same_pose
from navapp.registration.verdict import Goal
from navapp.stereo import match_surface
from navapp.tracking.frame import Fit, Frame, ignore
from navapp.values import Reason, StereoPictures, Stopwatch, TrackedFrame
from navapp.values.faces import SIZE_95
from navapp.values.progress import Progress

# Chosen: so many places are stepped from.
_N_PLACES = 10


class FoundTibia(NamedTuple):
    """What a search answers."""

    tracked: TrackedFrame
    # (6, 6) covariance of the twist between places of rest beside each other, about the model's
    # centre in the rectified left camera; zero when there is one such place.
    spread: FloatArray


class KneeSearch:
    """Searches for a tibia in pairs of pictures in which the femur's pose is known."""

    def __init__(self, hinge: Hinge) -> None:
        self._hinge = hinge

    def find(
        self,
        tracker: OccludedTracker,
        pictures: StereoPictures,
        left_from_femur: RigidTransform,
        goal: Goal,
        on_progress: Progress = ignore,
    ) -> FoundTibia:
        """The judged pose of the tibia, and how far places of rest beside it spread.

        Args:
            tracker: of the tibia, behind the femur.
            pictures: of both bones.
            left_from_femur: the femur's pose in them.
            goal: of the tibia's stage.
            on_progress: told the fraction done; what it raises stops the search.
        """
        watch, meter = Stopwatch(), tracker.meter
        camera_from_femur = tracker.rectify_pose(left_from_femur)
        pair, band_px = meter.rectify_surroundings(pictures.left, pictures.right, None)
        frame = Frame(pictures, pair, camera_from_femur, watch, on_progress=on_progress)
        watch.lap("rectify")
        found = tracker.occluder.remove(match_surface(pair, band_px, fills=False).disparity)
        watch.lap("stereo")
        on_progress(0.1)
        depth = DepthMap.of(meter.geometry, found)
        sampler = SweptSampler(tracker.model, self._hinge)
        starts = sampler.sweep(depth, camera_from_femur, _N_PLACES)
        watch.lap("estimate")
        fits = tracker.buried.rest_from(frame, starts)
        on_progress(1.0)
        best = tracker.buried.select(fits)
        if best is None:
            return FoundTibia(tracker.judge.lost(Reason.BONE_LOST, watch), np.zeros((6, 6)))
        spread = _measure_spread(fits, best, tracker.model.centre_mm)
        return FoundTibia(tracker.judge_with(spread).judge(frame, best, goal), spread)


def _measure_spread(fits: list[Fit], best: Fit, centre_mm: FloatArray) -> FloatArray:
    """(6, 6) of the places of rest that count as the same pose as the best one."""
    twists = np.array(
        [
            best.pose.twist_to(fit.pose, centre_mm)
            for fit in fits
            if fit.pose is not best.pose and is_same_pose(fit.pose, best.pose, centre_mm)
        ]
    ).reshape(-1, 6)
    n = len(twists)
    if n == 0:  # the fit's own covariance stands alone
        return np.zeros((6, 6))
    # A deviation that is estimated from n places: the 95 % bound is Student's t times it.
    widening = float(stdtrit(n, 0.975)) / SIZE_95
    return np.asarray(widening**2 * twists.T @ twists / n)
