"""Whether a camera that comes back is the one that it was."""

from dataclasses import replace

import pytest

from drivers.interfaces import CameraInfo
from navapp.devices.rig_match import make_reopener
from navapp.errors import WrongDevice


class Changing:
    """A camera whose `info` can be changed between two openings."""

    def __init__(self) -> None:
        self.info = CameraInfo("room", "fake", False, False, 64, 48, ("A", "B"))
        self.is_open = True

    def open(self) -> None:
        self.is_open = True

    def close(self) -> None:
        self.is_open = False


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({}, ""),
        ({"width": 128, "height": 96}, "128x96, they began as 64x48"),
        ({"serials": ("A", "C")}, "serial numbers"),
    ],
)
def test_only_the_camera_that_it_was_comes_back(changed, words) -> None:
    camera = Changing()
    reopen = make_reopener(camera, camera.open)
    camera.close()
    camera.info = replace(camera.info, **changed)
    if not words:
        assert reopen() is camera
        assert camera.is_open
        return
    with pytest.raises(WrongDevice, match=words):
        reopen()
    assert not camera.is_open
