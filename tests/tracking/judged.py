"""A pose judged on a map that a good matcher would find, beside checks that are handed in."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np

from navapp.geometry.rig import RigQuality
from navapp.geometry.transform import RigidTransform
from navapp.registration import RegistrationModel, Scene
from navapp.registration.verdict import Agreement
from navapp.stereo.health import PictureHealth, StereoHealth
from navapp.tracking import Goal, TrackerSettings
from navapp.tracking.checks import PairCheck, PairChecks
from navapp.tracking.frame import Fit, Frame
from navapp.tracking.judging import PoseJudge
from navapp.tracking.surface_meter import FREE_CORRELATION_PX, Measurement
from navapp.values import DisparityMap, PoseEstimate, Stopwatch, TrackedFrame
from tests.registration.shapes import GEOMETRY, femur
from tests.tracking.rooms import measured_map

BONE = femur()
MODEL = RegistrationModel(BONE)
MAP = measured_map(BONE)
NO_TARGETS = np.empty((0, 3))
GOOD_PICTURE = PictureHealth(0.05, 0.0, 0.15)
GOOD = StereoHealth(GOOD_PICTURE, GOOD_PICTURE)


def scene_of(measured: DisparityMap) -> Scene:
    return Scene.from_stereo(measured.reproject(GEOMETRY, 3), FREE_CORRELATION_PX)


class Told:
    """Checks of a pair that all say the same."""

    def __init__(self, check: PairCheck) -> None:
        self._check = check

    def check(self, measured: Measurement, pose: RigidTransform) -> SimpleNamespace:
        return SimpleNamespace(result=lambda: self._check)

    def surroundings(self, watch: Stopwatch) -> None:
        return None


def altered(checks: PairChecks, fit: Fit, **changes) -> Told:
    """The check of a fit, its agreement changed."""
    found = checks.check(fit.measured, fit.pose).result()
    agreement: Agreement = replace(found.agreement, **changes)
    return Told(found._replace(agreement=agreement))


class SurfaceAlone:
    """Stands for the meter of the outline: finds none, or one that shifts the pose."""

    def __init__(self, shift_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> None:
        self._twist = (*shift_mm, 0.0, 0.0, 0.0)
        self.counted_unmeasured: list[bool] = []  # of each call

    def join(
        self, pair, fit: Fit, coarse_px, noise_variance_ratio: float, *, counts_unmeasured: bool
    ) -> Fit:
        self.counted_unmeasured.append(counts_unmeasured)
        covariance = noise_variance_ratio * fit.estimate.covariance
        pose = fit.pose.move(self._twist, fit.pose.translation_mm)
        estimate = replace(fit.estimate, covariance=covariance, camera_from_bone=pose)
        return replace(fit, estimate=estimate)


def meter_of(model: RegistrationModel, quality: RigQuality | None) -> SimpleNamespace:
    """What a judge asks of a meter."""
    rectifier = SimpleNamespace(rig=SimpleNamespace(quality=quality))
    return SimpleNamespace(model=model, geometry=GEOMETRY, rectifier=rectifier)


def judged(
    estimate: PoseEstimate,
    measured: DisparityMap = MAP,
    goal: Goal | None = None,
    *,
    model: RegistrationModel = MODEL,
    quality: RigQuality | None = None,
    health: StereoHealth = GOOD,
    predicted: RigidTransform | None = None,
) -> TrackedFrame:
    """A pose that was fitted to a free measurement."""
    judge = PoseJudge(meter_of(model, quality), TrackerSettings())
    judge.outline = SurfaceAlone()
    cloud = measured.reproject(GEOMETRY, 3)
    fit = Fit(estimate, Measurement(measured, lambda: cloud, 1.0, FREE_CORRELATION_PX))
    checks = Told(PairCheck(health, None, None, np.zeros(measured.origin.shape, dtype=np.bool_)))
    start = estimate.camera_from_bone
    frame = Frame(None, None, start, Stopwatch(), predicted=predicted, checks=checks)
    return judge.judge(frame, fit, goal or Goal(NO_TARGETS, 3.0))
