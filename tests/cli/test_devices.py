"""`navapp devices`: what it says of what was found, and of what could not be looked at."""

import json

import pytest

from navapp.cli.main import run
from navapp.inventory import connected_devices
from tests.inventory.inventories import EVERYTHING, NOTHING

KINDS = {
    "usb_cameras": {"node", "path", "chosen_by", "serial", "card", "formats"},
    "oak_cameras": {"device_id", "port", "is_in_use"},
    "installed_cameras": {"backend", "factory", "package"},
    "serial_ports": {"device", "path", "description", "maker", "usb_serial"},
    "displays": {"index", "name", "left", "top", "width", "height"},
}

USB_CAMERA = """\
  HD Cam, serial number A1
    device   /dev/video0
             /dev/v4l/by-id/usb-A1-video-index0
    formats  MJPG 1280x720 at 30 Hz
    choose   [camera]
             backend = "opencv"
             [camera.opencv]
             left = "A1"
             # right = "A1"
"""
OAK_CAMERA = """\
  14442C10D13EABCE00
    USB port 1.2
    state    in use, or restarting
    choose   [camera]
             backend = "depthai"
             [camera.depthai]
             device = "14442C10D13EABCE00"
"""
SERIAL_PORT = """\
  FT232R, serial number A50285BI
    port     /dev/ttyUSB0
             /dev/serial/by-id/usb-FT
    maker    FTDI
    choose   # what is behind it is not known; where it is one of these, take its lines
             ## a projector that speaks ESC/VP21 (Epson):
             # [projector]
             # backend = "escvp21"
             # port = "/dev/serial/by-id/usb-FT"
             ## the mirror's rotary stage, if it speaks Zaber's ASCII protocol:
             # [mirror]
             # backend = "zaber"
             # port = "/dev/serial/by-id/usb-FT"
"""


def told(monkeypatch, capsys, found, *options):
    monkeypatch.setattr(connected_devices, "list_all_devices", lambda: found)
    assert run(["devices", *options]) == 0
    return capsys.readouterr().out


@pytest.mark.parametrize("found", [NOTHING, EVERYTHING], ids=["nothing", "everything"])
def test_programs_are_given_every_kind_with_its_keys(monkeypatch, capsys, found):
    content = json.loads(told(monkeypatch, capsys, found, "--json", "-"))
    assert set(content) == {"navapp", "command", "units", "unseen", *KINDS}
    assert content["command"] == "devices"
    for kind, keys in KINDS.items():
        assert len(content[kind]) == len(getattr(found, kind).found)
        assert all(set(device) == {*keys, "configuration"} for device in content[kind])
    for one in content["unseen"]:
        assert set(one) == {"kind", "subject", "problem", "remedy"}
        assert one["kind"] in KINDS


def test_a_camera_that_cannot_be_chosen_has_no_configuration(monkeypatch, capsys):
    content = json.loads(told(monkeypatch, capsys, EVERYTHING, "--json", "-"))
    first, second = content["usb_cameras"]
    assert 'left = "A1"' in first["configuration"]
    assert second["configuration"] is second["path"] is None
    assert first["formats"] == [
        {
            "fourcc": "MJPG",
            "description": "Motion-JPEG",
            "sizes": [{"width": 1280, "height": 720, "rates_hz": [30.0]}],
        }
    ]


def test_people_are_told_what_was_found_and_how_to_choose_it(monkeypatch, capsys):
    paragraphs = told(monkeypatch, capsys, EVERYTHING).split("\n\n")
    assert paragraphs[:2] == ["USB cameras", USB_CAMERA.rstrip()]
    assert OAK_CAMERA.rstrip() in paragraphs
    assert SERIAL_PORT.rstrip() in paragraphs
    assert "    formats  MJPG 1280x720 at 30 Hz" in paragraphs[2].splitlines()
    assert "choose" not in paragraphs[2]  # this one has no name that stays


def test_people_are_told_what_could_not_be_looked_at(monkeypatch, capsys):
    lines = told(monkeypatch, capsys, NOTHING).splitlines()
    assert sum(line.endswith(": none seen") for line in lines) == len(KINDS)
    assert lines[-2:] == ["  ! it cannot be looked at", "    -> let me look"]


def test_the_real_look_at_this_computer_works(tmp_path):
    assert run(["--quiet", "devices", "--json", str(tmp_path / "out.json")]) == 0
    assert set(json.loads((tmp_path / "out.json").read_text(encoding="utf-8"))) >= set(KINDS)
