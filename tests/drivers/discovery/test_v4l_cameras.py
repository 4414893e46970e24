"""What keeps a USB camera from being asked or chosen; files stand where devices would."""

import shutil

import pytest

from drivers.discovery import list_usb_cameras
from drivers.v4l_names import V4lNames
from tests.drivers.fake_capture import FakeBus


@pytest.fixture
def bus(tmp_path):
    bus = FakeBus(tmp_path)
    bus.plug("A1", 1)
    return bus


def test_without_the_kernels_folders_there_is_none(tmp_path):
    listing = list_usb_cameras(V4lNames(tmp_path / "a", tmp_path / "b", tmp_path / "c"))
    assert listing.found == listing.unseen == ()


def test_what_does_not_answer_is_listed_by_the_kernels_name(bus):
    listing = list_usb_cameras(bus.names)
    (camera,) = listing.found
    assert (camera.card, camera.chosen_by, camera.formats) == ("Acme Cam 1", "A1", ())
    (why,) = listing.unseen
    assert "cannot be asked for its formats (Inappropriate ioctl" in why.problem


def test_a_device_that_a_container_was_not_given_is_told(bus):
    (bus.root / "dev" / "video2").unlink()
    (why,) = list_usb_cameras(bus.names).unseen
    assert why.remedy.startswith("give this container or sandbox the device")


def test_without_udev_a_camera_cannot_be_chosen(bus):
    shutil.rmtree(bus.names.links)
    listing = list_usb_cameras(bus.names)
    assert [(camera.path, camera.chosen_by) for camera in listing.found] == [(None, "")]
    assert "has no name that stays" in listing.unseen[-1].problem


def test_a_cameras_second_device_is_no_camera(bus):
    second = bus.names.sysfs / "video3"
    second.mkdir()
    (second / "index").write_text("1\n")
    assert [camera.node.name for camera in list_usb_cameras(bus.names).found] == ["video2"]
