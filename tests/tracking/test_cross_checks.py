"""Checks that run while a pose is fitted."""

import threading
import time

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
        return CrossCheck(StereoHealth(LIGHT, LIGHT, n_points=len(self.asked)), None, None)


def test_a_measurement_whose_check_was_begun_is_checked_once() -> None:
    checked, measured = Checked(), measurement()
    with CrossChecks(checked) as checks:
        checks.begin(measured, POSE)
        assert checks.of(measured, POSE).health.n_points == 1
    assert checked.asked == [measured]


def test_another_measurement_has_a_check_of_its_own() -> None:
    checked, begun, other = Checked(), measurement(), measurement()
    with CrossChecks(checked) as checks:
        checks.begin(begun, POSE)
        checks.of(other, POSE)
    assert other in checked.asked


def test_the_newest_measurement_is_the_one_that_is_kept() -> None:
    checked, old, new = Checked(), measurement(), measurement()
    with CrossChecks(checked) as checks:
        checks.begin(old, POSE)
        checks.begin(new, POSE)
        # No check is made anew: this one would fail.
        checks._check = None
        checks.of(new, POSE)
    assert checked.asked[-1] is new


def test_no_check_outlives_its_pair() -> None:
    is_busy, ended = threading.Event(), []

    def slow(measured: Measurement, pose: RigidTransform) -> CrossCheck:
        is_busy.set()
        time.sleep(0.05)
        ended.append(measured)
        raise ValueError("check")

    with CrossChecks(slow) as checks:
        checks.begin(measurement(), POSE)
        assert is_busy.wait(20.0)
    assert len(ended) == 1


def test_a_check_that_fails_is_told_to_who_asks() -> None:
    def fails(measured: Measurement, pose: RigidTransform) -> CrossCheck:
        raise ValueError("check")

    measured = measurement()
    with CrossChecks(fails) as checks:
        checks.begin(measured, POSE)
        with pytest.raises(ValueError, match="check"):
            checks.of(measured, POSE)
