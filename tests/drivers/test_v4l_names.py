import pytest

from drivers.v4l_names import V4lNames
from navapp.errors import DeviceNotFound, UsageError
from tests.drivers.fake_capture import FakeBus


@pytest.fixture
def bus(tmp_path):
    bus = FakeBus(tmp_path)
    bus.plug("A1", 1)
    bus.plug("B2", 2)
    return bus


def test_a_serial_number_names_a_camera_at_any_port(bus):
    found = bus.names.find("B2")
    assert found.serial == "B2"
    assert found.node.name == "video4"
    assert found.path.parent.name == "by-id"
    bus.unplug(bus.cameras[found.node])
    bus.plug("B2", 7)
    assert bus.names.find("B2").node.name == "video14"


def test_paths_by_id_and_by_port_name_the_same_camera(bus):
    by_id = bus.names.find(str(bus.names.links / "by-id" / "usb-Acme_Cam_A1-video-index0"))
    by_path = bus.names.find(str(bus.names.links / "by-path" / "pci-0-usb-0:1-video-index0"))
    assert by_id.node == by_path.node
    assert by_id.serial == by_path.serial == "A1"


def test_a_port_tells_which_camera_stands_there_now(bus):
    port = str(bus.names.links / "by-path" / "pci-0-usb-0:1-video-index0")
    bus.plug("C3", 1)
    assert bus.names.find(port).serial == "C3"


def test_every_camera_is_listed_once_though_it_has_three_links(bus):
    assert sorted(camera.serial for camera in bus.names.list_cameras()) == ["A1", "B2"]


def test_a_number_that_changes_is_refused(bus):
    with pytest.raises(UsageError, match="does not name a camera for good"):
        bus.names.find("/dev/video0")
    with pytest.raises(DeviceNotFound, match="camera 0 is not connected"):
        bus.names.find("0")


def test_an_absent_camera_is_told_beside_those_that_are_there(bus):
    with pytest.raises(DeviceNotFound, match=r"X9 is not connected \(connected: A1, B2\)"):
        bus.names.find("X9")
    with pytest.raises(DeviceNotFound, match="is not connected"):
        bus.names.find(str(bus.names.links / "by-id" / "usb-Acme_Cam_X9-video-index0"))


def test_two_cameras_of_one_serial_number_are_told_apart_by_port_only(tmp_path):
    bus = FakeBus(tmp_path)
    bus.plug("00", 1)
    bus.plug("00", 2)
    with pytest.raises(DeviceNotFound, match="2 cameras have the serial number 00: name each by"):
        bus.names.find("00")
    ports = [str(bus.names.links / "by-path" / f"pci-0-usb-0:{n}-video-index0") for n in (1, 2)]
    assert len({bus.names.find(port).node for port in ports}) == 2


def test_a_camera_without_a_serial_number_is_named_by_its_link(tmp_path):
    bus = FakeBus(tmp_path)
    bus.plug("Webcam", 1, told="")
    assert bus.names.list_cameras()[0].serial == "usb-Acme_Cam_Webcam"
    assert bus.names.find("usb-Acme_Cam_Webcam").node.name == "video2"


def test_without_any_camera_the_folders_are_missing(tmp_path):
    names = V4lNames(tmp_path / "v4l", tmp_path / "sysfs")
    assert names.list_cameras() == ()
    with pytest.raises(DeviceNotFound, match="connected: none"):
        names.find("A1")
