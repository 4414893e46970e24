import tomllib

import pytest

from navapp.config import Configuration, parse
from navapp.inventory.connected_devices import make_choice_toml
from tests.inventory.inventories import ACME, BEAMER, DESK, EVERYTHING, OAK, PORT, USB


@pytest.mark.parametrize(
    ("device", "table", "keys"),
    [
        (USB, "camera", {"backend": "opencv"}),
        (OAK, "camera", {"backend": "depthai"}),
        (ACME, "camera", {"backend": "acme"}),
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


def test_a_commented_line_becomes_the_right_eye():
    right = make_choice_toml(USB).splitlines()[-1].removeprefix("# ")
    configuration = parse(tomllib.loads(f'[camera.opencv]\nleft = "L"\n{right}'), "x")
    assert configuration.camera.opencv.right == "A1"


def test_a_port_is_claimed_by_nothing_until_a_person_takes_its_lines():
    text = make_choice_toml(PORT)
    assert parse(tomllib.loads(text), "x") == Configuration()
    words, *lines = (line for line in text.splitlines() if not line.startswith("##"))
    assert words.startswith("# what is behind it is not known")
    taken = parse(tomllib.loads("\n".join(line.removeprefix("# ") for line in lines)), "x")
    assert (taken.projector.backend, taken.projector.port) == ("escvp21", PORT.path)
    assert (taken.mirror.backend, taken.mirror.port) == ("zaber", PORT.path)


def test_a_camera_without_a_lasting_name_is_not_chosen():
    assert make_choice_toml(EVERYTHING.usb_cameras.found[1]) == ""
