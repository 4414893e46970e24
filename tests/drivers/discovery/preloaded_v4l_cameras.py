"""The listing of USB cameras above cameras that a preloaded library plays.

Not collected by itself: `test_v4l2.py` compiles the library and runs this file with it.
"""

import json
import os
import tomllib

import pytest

from drivers.discovery import Listing, PictureSize, list_usb_cameras
from navapp.cli.main import run
from navapp.config import parse
from navapp.inventory import connected_devices
from tests.drivers.preloaded_v4l2 import FORBIDDEN, Bus

RATES_HZ = (15.0, 30.0)
SIZES = (PictureSize(640, 480, RATES_HZ), PictureSize(1280, 720, RATES_HZ))


@pytest.fixture
def bus():
    bus = Bus()
    yield bus
    for camera in list(bus.cameras.values()):
        bus.unplug(camera)
    assert bus.n_open(1) == bus.n_open(2) == 0


def test_two_cameras_say_what_they_are_and_can(bus):
    listing = list_usb_cameras(bus.names)
    assert listing.unseen == ()
    assert [camera.chosen_by for camera in listing.found] == ["LEFT", "RIGHT"]
    left = listing.found[0]
    assert (left.card, left.node.name, left.serial) == ("Fake camera 2", "video2", "LEFT")
    assert left.path == bus.names.links / "by-id" / "usb-Acme_Cam_LEFT-video-index0"
    assert [(one.fourcc, one.description) for one in left.formats] == [
        ("YUYV", "YUYV 4:2:2"),
        ("MJPG", "Motion-JPEG"),
    ]
    assert [one.sizes for one in left.formats] == [SIZES, SIZES]


def test_what_is_listed_chooses_the_camera(bus):
    for camera in list_usb_cameras(bus.names).found:
        text = connected_devices.make_choice_toml(camera)
        wanted = parse(tomllib.loads(text), "x").camera
        assert wanted.backend == "opencv"
        assert bus.names.find(wanted.opencv.left).node == camera.node
        assert f'# right = "{camera.serial}"' in text.splitlines()


def test_without_cameras_the_list_is_empty(bus):
    for camera in list(bus.cameras.values()):
        bus.unplug(camera)
    assert list_usb_cameras(bus.names) == Listing()


def test_a_camera_that_may_not_be_opened_is_listed_with_the_remedy(bus):
    bus.write(1, FORBIDDEN, 1)
    listing = list_usb_cameras(bus.names)
    assert [(one.card, len(one.formats)) for one in listing.found] == [
        ("Acme Cam 1", 0),
        ("Fake camera 4", 2),
    ]
    (why,) = listing.unseen
    assert why.subject.endswith("video2")
    assert "Permission denied" in why.problem
    assert "usermod -aG video" in why.remedy


def test_two_cameras_of_one_serial_number_are_chosen_by_their_ports(bus):
    bus.put(2, "LEFT", offset_s=0.0)
    listing = list_usb_cameras(bus.names)
    ports = [str(bus.names.links / "by-path" / f"pci-0-usb-0:{n}-video-index0") for n in (1, 2)]
    assert [camera.chosen_by for camera in listing.found] == ports


def test_the_command_lists_them_for_people_and_programs(bus, monkeypatch, capsys):
    monkeypatch.setattr(connected_devices, "V4lNames", lambda: bus.names)
    assert run(["devices"]) == 0
    told = capsys.readouterr().out
    assert "Fake camera 2, serial number LEFT" in told
    assert "MJPG 640x480, 1280x720 at 15, 30 Hz" in told
    assert 'left = "LEFT"' in told
    assert run(["devices", "--json", "-"]) == 0
    (left, right) = json.loads(capsys.readouterr().out)["usb_cameras"]
    assert left["formats"][0]["sizes"][1] == {"width": 1280, "height": 720, "rates_hz": [15, 30]}
    assert right["node"] == os.fspath(bus.root / "dev" / "video4")
