"""The contract of every camera of navapp, on this one: `pytest` in this folder, once installed.

A check is a plain function of a maker of fresh cameras; it needs no pytest.
"""

import pytest
from example_camera import DISPARITY_PX, make

from drivers.clock import ManualClock, SystemClock
from drivers.contracts import CAMERA_CHECKS, CameraUnderTest
from navapp.errors import UsageError


def make_fresh() -> CameraUnderTest:
    clock = SystemClock()
    # The control is one that it must accept; without any, leave it out.
    return CameraUnderTest(make({"rate_hz": 60.0}, clock), clock, control=("exposure_ms", 8.0))


@pytest.mark.parametrize("check", CAMERA_CHECKS, ids=lambda check: check.__name__)
def test_the_contract_is_kept(check):
    check(make_fresh)


def test_the_right_eye_sees_the_wall_further_to_the_left():
    camera = make({}, ManualClock())
    camera.open()
    frame = camera.read(1.0)
    camera.close()
    assert (frame.left[:, DISPARITY_PX:] == frame.right[:, :-DISPARITY_PX]).all()


@pytest.mark.parametrize("settings", [{"rate": 30.0}, {"rate_hz": 0.0}, {"rate_hz": "fast"}])
def test_settings_that_mean_nothing_are_refused(settings):
    with pytest.raises(UsageError, match="it takes rate_hz, 1 to 120"):
        make(settings, ManualClock())
