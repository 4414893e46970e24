"""Checks that run while a pose is fitted."""

import numpy as np
import pytest

from navapp.geometry.transform import RigidTransform
from navapp.stereo import PictureHealth, StereoHealth
from navapp.tracking.cross_checks import CrossCheck, CrossChecks
from navapp.tracking.surface_meter import Measurement
from navapp.values import DisparityMap, LineTimings, SurfaceCloud

POSE = RigidTransform.identity("left_rect", "femur")
LIGHT = PictureHealth(0.0, 0.0, 0.1)


def measurement() -> Measurement:
    empty = np.empty((0, 0), dtype=np.float32)
    found = DisparityMap(empty, empty, np.empty((0, 0), dtype=np.uint8), 0, 0)
    cloud = SurfaceCloud(
        np.empty((0, 3)), np.empty(0), np.empty((0, 2), np.int32), np.empty(0, np.uint8)
    )
    return Measurement(found, cloud, LineTimings(), 0.0, 11.0)


class Checked:
    """Counts what it is asked, and tells measurements apart by the health that it finds."""

    def __init__(self) -> None:
        self.asked: list[Measurement] = []

    def __call__(self, measured: Measurement, pose: RigidTransform) -> CrossCheck:
        assert pose is POSE
        self.asked.append(measured)
        return CrossCheck(StereoHealth(LIGHT, LIGHT, n_points=len(self.asked)), None)


def test_a_measurement_is_checked_once() -> None:
    checked, measured = Checked(), measurement()
    with CrossChecks(checked) as checks:
        checks.begin(measured, POSE)
        assert checks.begin(measured, POSE).result().health.n_points == 1
    assert checked.asked == [measured]


def test_the_newest_measurement_is_the_one_that_is_told() -> None:
    checked, old, new = Checked(), measurement(), measurement()
    with CrossChecks(checked) as checks:
        checks.begin(old, POSE)
        checks.begin(new, POSE).result()
    assert checked.asked[-1] is new


def test_a_check_that_fails_is_told_to_who_asks_and_to_nobody_else() -> None:
    def fails(measured: Measurement, pose: RigidTransform) -> CrossCheck:
        raise ValueError("check")

    with CrossChecks(fails) as checks:
        checks.begin(measurement(), POSE)
    with CrossChecks(fails) as checks, pytest.raises(ValueError, match="check"):
        checks.begin(measurement(), POSE).result()
