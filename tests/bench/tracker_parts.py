"""The production tracker, and steps of it one by one."""

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.rectification import Image
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import RigidTransform
from navapp.tracking import Goal
from navapp.tracking.bimcc_tracker import BimccTracker
from navapp.tracking.checks import PairChecks
from navapp.tracking.frame import Fit, Frame
from navapp.tracking.outline import OutlineMeter
from navapp.tracking.surface_meter import NEAR_VIEW, Margins
from navapp.values import BoneModel, Stopwatch, Verdict
from tests.pictures import Pictures

GOAL = Goal(np.empty((0, 3)), 2.0)


class TrackerParts(BimccTracker):
    """Of one rig and one bone, with the settings of every tracker."""

    def __init__(self, rig: StereoRig, bone: BoneModel) -> None:
        super().__init__(rig, bone)
        self.outline = OutlineMeter(self.model, self.meter.geometry)

    def frame(
        self, left: Image, right: Image, start: RigidTransform, margins: Margins = NEAR_VIEW
    ) -> Frame:
        """The pictures rectified around a pose in the rectified left camera."""
        pair = self.meter.rectify(left, right, start, margins)
        return Frame(Pictures(left, right), pair, start, Stopwatch())

    def find(self, frame: Frame) -> Fit | None:
        """Of all fits near the start the one that the judge ranks first; None out of view.

        A tracker stops at the first that is good enough.
        """
        fits = [fit for fit in self.near.find(frame) if fit is not None]
        return min(fits, key=lambda fit: self.verdict(frame, fit).rank, default=None)

    def verdict(self, frame: Frame, fit: Fit) -> Verdict:
        """What is said of a fit, by what is seen alone."""
        return self.judge.judge(frame, fit, GOAL).verdict

    def coarse_px(self, frame: Frame, fit: Fit) -> NDArray[np.float32] | None:
        """(h, w) coarse disparity of whatever lies in a fit's box; None out of view or depth."""
        return self._checks(frame).check(fit.measured, fit.pose).result().coarse_px

    def with_outline(self, frame: Frame, fit: Fit, noise_variance_ratio: float = 1.0) -> Fit:
        """A fit of the surface, joined with the outline."""
        return self.outline.join(frame.pair, fit, self.coarse_px(frame, fit), noise_variance_ratio)

    def lies_open(self, frame: Frame, fit: Fit) -> bool:
        """More of the model is seen than something hides."""
        agreement = self._checks(frame).check(fit.measured, fit.pose).result().agreement
        return agreement is not None and agreement.lies_open

    def _checks(self, frame: Frame) -> PairChecks:
        return PairChecks(self.meter, frame.pair)
