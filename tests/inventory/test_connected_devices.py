import tomllib

import pytest

from navapp.config import parse
from navapp.inventory.connected_devices import make_choice_toml
from tests.inventory.inventories import ACME, BEAMER, DESK, EVERYTHING, OAK, PORT, USB


@pytest.mark.parametrize(
    ("device", "table", "keys"),
    [
        (USB, "camera", {"backend": "opencv"}),
        (OAK, "camera", {"backend": "depthai"}),
        (ACME, "camera", {"backend": "acme"}),
        (PORT, "projector", {"backend": "escvp21", "port": PORT.path}),
        (DESK, "display", {"output": 'DELL 24"', "size_px": (1920, 1200)}),
        (BEAMER, "display", {"backend": "window", "output": "EPSON PJ"}),
    ],
)
def test_what_chooses_a_device_is_a_valid_configuration_that_names_it(device, table, keys):
    section = getattr(parse(tomllib.loads(make_choice_toml(device)), "x"), table)
    assert {key: getattr(section, key) for key in keys} == keys


def test_cameras_are_chosen_by_what_stays():
    cameras = [parse(tomllib.loads(make_choice_toml(one)), "x").camera for one in (USB, OAK)]
    assert cameras[0].opencv.left == "A1"
    assert cameras[1].depthai.device == OAK.device_id


def test_a_commented_line_becomes_the_right_eye_or_the_mirror():
    right = make_choice_toml(USB).splitlines()[-1].removeprefix("# ")
    configuration = parse(tomllib.loads(f'[camera.opencv]\nleft = "L"\n{right}'), "x")
    assert configuration.camera.opencv.right == "A1"
    assert make_choice_toml(PORT).splitlines()[-1] == '# or [mirror] with backend = "zaber"'


def test_a_camera_without_a_lasting_name_is_not_chosen():
    assert make_choice_toml(EVERYTHING.usb_cameras.found[1]) == ""
