"""OAK cameras on a bus made of files, with a stand-in that has the package's own names only."""

import os
import sys
from types import SimpleNamespace
from unittest.mock import Mock

import pytest

from drivers.discovery import OakCamera, list_oak_cameras
from drivers.discovery.oak_cameras import UDEV_RULE, list_oak_nodes

dai = pytest.importorskip("depthai", reason="the package depthai is not installed (navapp[oak])")


class Bus:
    """USB as sysfs and devfs show it, and DepthAI's answer."""

    def __init__(self, root, monkeypatch):
        self.devices, self.nodes = root / "sysfs", root / "dev"
        self.infos = []
        self.search = Mock(side_effect=lambda: self.infos)
        device = Mock(spec=dai.Device, getAllAvailableDevices=self.search)
        module = SimpleNamespace(Device=device, XLinkDeviceState=dai.XLinkDeviceState)
        monkeypatch.setitem(sys.modules, "depthai", module)

    def plug(self, number, vendor="03e7"):
        folder = self.devices / f"1-{number}"
        folder.mkdir(parents=True)
        for name, content in (("idVendor", vendor), ("busnum", "1"), ("devnum", str(number))):
            (folder / name).write_text(f"{content}\n")
        node = self.nodes / "001" / f"{number:03d}"
        node.parent.mkdir(parents=True, exist_ok=True)
        node.touch()
        return node

    def answer(self, device_id, state):
        info = dai.DeviceInfo(device_id)
        info.name, info.state = f"1.{len(self.infos)}", state
        self.infos.append(info)

    def listing(self):
        return list_oak_cameras(self.devices, self.nodes)


@pytest.fixture
def bus(tmp_path, monkeypatch):
    return Bus(tmp_path, monkeypatch)


def test_cameras_are_listed_with_their_ids_and_whether_somebody_has_them(bus):
    bus.answer("14442C10D13EABCE00", dai.XLinkDeviceState.X_LINK_UNBOOTED)
    bus.answer("18443010B1234F0F00", dai.XLinkDeviceState.X_LINK_BOOTED)
    listing = bus.listing()
    assert listing.unseen == ()
    assert listing.found == (
        OakCamera("14442C10D13EABCE00", "1.0", False),
        OakCamera("18443010B1234F0F00", "1.1", True),
    )


def test_a_bus_without_cameras_is_an_empty_list(bus):
    bus.plug(3, vendor="046d")
    assert bus.listing().found == bus.listing().unseen == ()


def test_without_permission_the_exact_rule_is_the_remedy(bus, monkeypatch):
    node = bus.plug(5)
    bus.answer("", dai.XLinkDeviceState.X_LINK_UNBOOTED)
    real = os.access
    monkeypatch.setattr(os, "access", lambda path, mode: path != node and real(path, mode))
    listing = bus.listing()
    assert listing.found == ()
    (why,) = listing.unseen
    assert f"connected at {node}" in why.problem
    assert UDEV_RULE == 'SUBSYSTEM=="usb", ATTRS{idVendor}=="03e7", MODE="0666"'
    assert UDEV_RULE in why.remedy


def test_a_camera_that_a_container_was_not_given_is_told(bus):
    bus.plug(5).unlink()
    (why,) = bus.listing().unseen
    assert why.remedy.endswith(f"the folder {bus.nodes}")


def test_without_the_package_a_sentence_says_what_to_do_and_the_bus_still_tells(bus, monkeypatch):
    monkeypatch.setitem(sys.modules, "depthai", None)
    bus.plug(5).unlink()
    assert [one.subject for one in bus.listing().unseen] == [str(bus.nodes / "001/005"), "depthai"]


def test_a_bus_that_cannot_be_searched_is_no_error(bus):
    bus.search.side_effect = RuntimeError("status 12")
    (why,) = bus.listing().unseen
    assert "cannot be searched for OAK cameras (status 12)" in why.problem


def test_what_is_unplugged_meanwhile_or_nonsense_is_passed_over(bus):
    bus.plug(5)
    (bus.devices / "1-5" / "devnum").unlink()
    bus.plug(6)
    (bus.devices / "1-6" / "busnum").write_text("?\n")
    assert list_oak_nodes(bus.devices, bus.nodes) == ()
