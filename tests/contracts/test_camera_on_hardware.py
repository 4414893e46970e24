"""The camera contract on what is connected: `pytest --hardware=FILE tests/contracts`."""

import pytest

from drivers.clock import SystemClock
from drivers.contracts import CAMERA_CHECKS, CameraUnderTest
from navapp.devices import make_real_camera

# That every lockable camera has; a camera of another package may have none.
_CONTROLS = {"opencv": ("exposure_ms", 5.0), "depthai": ("exposure_ms", 5.0)}


@pytest.mark.parametrize("check", CAMERA_CHECKS, ids=lambda check: check.__name__)
def test_the_connected_camera_keeps_its_contract(hardware, check):
    if hardware.camera.backend == "simulated":
        pytest.skip("the configuration of --hardware has a simulated camera")

    def make() -> CameraUnderTest:
        clock = SystemClock()
        camera = make_real_camera(hardware, clock)
        return CameraUnderTest(camera, clock, _CONTROLS.get(hardware.camera.backend))

    check(make)
