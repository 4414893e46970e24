"""Devices for the alignment of crosses, and what is asked of projector and mount beside it."""

import numpy as np
import pytest

from drivers.interfaces import PowerState
from navapp.config import parse
from navapp.devices import open_mirror_alignment, read_projector
from navapp.devices.peripherals import set_mirror
from navapp.errors import ConfigurationError, DeviceError
from tests.calibration.marks import BOARD
from tests.drivers.firmware_rigs import SERIAL, STAGE_SERIAL, projector_terminal, stage_terminal

SMALL = {"camera": {"simulated": {"scale": 0.25}}}


def test_a_simulated_room_has_board_display_and_eye_at_one_place():
    opened = open_mirror_alignment(parse(SMALL, "x"), BOARD, is_headless=True)
    try:
        assert opened.camera.info.is_stepped
        opened.camera.read(1.0)
        info = opened.display.info
        assert (info.name, info.width, info.height) == ("sim:display", 1920, 1080)
        assert opened.practice is not None
        for corner in (0, 35, 69):
            aim = opened.practice.aim_px(corner, 0)
            assert (aim > 0).all()
            assert (aim < (1920, 1080)).all()
        assert opened.look is not None
        shown = opened.look(35, 0)
        assert shown.shape == (107, 160, 3)
        assert np.ptp(opened.look(None, 0)) > 40
    finally:
        opened.close()
    with pytest.raises(DeviceError):
        opened.camera.read(0.1)


@pytest.mark.parametrize(
    "display", [{"backend": "window", "size_px": [640, 480]}, {"size_px": [640, 480]}]
)
def test_what_no_eye_can_see_is_refused(display):
    with pytest.raises(ConfigurationError, match=r"at once|is 1920x1080"):
        open_mirror_alignment(parse({**SMALL, "display": display}, "x"), BOARD, is_headless=True)


def test_a_mount_is_brought_to_its_calibrated_angle_and_a_fixed_one_stands_there(tmp_path):
    set_mirror(parse({}, "x").mirror)
    mirror = {"backend": "zaber", "port": f"{tmp_path}/stage", "serial": STAGE_SERIAL}
    with stage_terminal(tmp_path):
        set_mirror(parse({"mirror": {**mirror, "calibrated_deg": 20.0}}, "x").mirror)
        # It knows its place now, and the line was left free.
        set_mirror(parse({"mirror": {**mirror, "calibrated_deg": 25.0}}, "x").mirror)


def test_a_projector_is_asked_and_its_line_left_free(tmp_path):
    projector = {"backend": "escvp21", "port": f"{tmp_path}/projector", "serial": SERIAL}
    settings = parse({"projector": projector}, "x").projector
    with projector_terminal(tmp_path):
        for _ in range(2):
            status = read_projector(settings)
            assert status is not None
            assert status.power is PowerState.STANDBY
