"""The parts of a line, each on its own, joined as `Line` joins them."""

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.rectification import Image, RectifiedPair
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import RigidTransform
from navapp.registration import RegistrationModel
from navapp.tracking.contours import ContourMeter
from navapp.tracking.fit_judge import FitJudge
from navapp.tracking.follower import Fit
from navapp.tracking.line import LineSettings
from navapp.tracking.locator import NEAR_VIEW, Locator
from navapp.tracking.surface_meter import Margins, SurfaceMeter
from navapp.values import BoneModel


class LineParts:
    """Of one rig and one bone, with the settings of every line."""

    def __init__(self, rig: StereoRig, bone: BoneModel) -> None:
        settings = LineSettings()
        self.tracking = settings.locator.tracking
        self.model = RegistrationModel(bone)
        self.centre_mm = self.model.centre_mm
        self.meter = SurfaceMeter(rig, self.model, settings.depth_mm, settings.max_points)
        self.judge = FitJudge(self.meter, self.model, rig.quality)
        self.locator = Locator(self.meter, self.model, self.judge.score, settings.locator)
        self.contours = ContourMeter(self.model, self.meter.geometry)

    def rectified(self, left_from_bone: RigidTransform) -> RigidTransform:
        """The same pose in the rectified left camera."""
        return self.meter.geometry.rectified_from_left @ left_from_bone

    def pair(
        self, left: Image, right: Image, around: RigidTransform, margins: Margins = NEAR_VIEW
    ) -> RectifiedPair:
        """The pictures rectified around a pose in the rectified left camera."""
        return self.meter.rectified(left, right, around, margins)[0]

    def coarse_px(self, pair: RectifiedPair, fit: Fit) -> NDArray[np.float32] | None:
        """(h, w) coarse disparity of whatever lies in a fit's box; None out of view or depth."""
        coarse = self.meter.coarsely(pair, fit.pose, fit.measured.disparity.box)
        return None if coarse is None else coarse.disparity_px

    def with_outline(self, pair: RectifiedPair, fit: Fit, noise2: float = 1.0) -> Fit:
        """A fit of the surface, joined with the outline."""
        return self.contours.joined(pair, fit, self.coarse_px(pair, fit), noise2)

    def lies_open(self, pair: RectifiedPair, fit: Fit) -> bool:
        """More of the model is seen than something hides."""
        agreement = self.judge.checking(pair).of(fit.measured, fit.pose).agreement
        return agreement is not None and agreement.lies_open
