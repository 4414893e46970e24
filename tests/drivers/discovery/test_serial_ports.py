import os
import sys
from types import SimpleNamespace

import pytest
from serial.tools import list_ports

from drivers.discovery import list_serial_ports


class Desk:
    """Ports as pyserial, udev and sysfs show them."""

    def __init__(self, root, monkeypatch):
        self.root, self.ports = root, []
        (root / "dev").mkdir()
        monkeypatch.setattr(list_ports, "comports", lambda: self.ports)

    def plug(self, name, description="n/a", vid=None, serial=None, maker=None):
        device = self.root / "dev" / name
        device.touch()
        port = SimpleNamespace(
            device=str(device),
            description=description,
            vid=vid,
            serial_number=serial,
            manufacturer=maker,
        )
        self.ports.append(port)
        return device

    def link(self, folder, name, device):
        (self.root / "serial" / folder).mkdir(parents=True, exist_ok=True)
        link = self.root / "serial" / folder / name
        link.symlink_to(device)
        return str(link)

    def chip(self, name, kind):
        (self.root / "tty" / name).mkdir(parents=True)
        (self.root / "tty" / name / "type").write_text(f"{kind}\n")

    def listing(self):
        return list_serial_ports(self.root / "serial", self.root / "tty")


@pytest.fixture
def desk(tmp_path, monkeypatch):
    return Desk(tmp_path, monkeypatch)


def test_adapters_are_named_by_what_stays(desk):
    first = desk.plug("ttyUSB1", "FT232R USB UART", 0x0403, "A50285BI", "FTDI")
    second = desk.plug("ttyACM0", "Epson", 0x04B8)
    by_id = desk.link("by-id", "usb-FTDI_A50285BI-if00-port0", first)
    desk.link("by-path", "pci-0-usb-0:1", first)
    by_path = desk.link("by-path", "pci-0-usb-0:2", second)
    epson, ftdi = desk.listing().found
    assert (ftdi.path, ftdi.usb_serial, ftdi.description) == (by_id, "A50285BI", "FT232R USB UART")
    assert (epson.path, epson.usb_serial) == (by_path, "")
    assert (ftdi.maker, epson.maker) == ("FTDI", "")


def test_a_built_in_port_is_listed_when_a_chip_is_behind_it(desk):
    device = desk.plug("ttyS0")
    desk.plug("ttyS1")
    desk.chip("ttyS0", 4)
    desk.chip("ttyS1", 0)
    (port,) = desk.listing().found
    assert (port.path, port.description) == (str(device), "built-in port")


def test_a_port_that_may_not_be_opened_is_listed_with_the_remedy(desk, monkeypatch):
    device = desk.plug("ttyUSB0", "FT232R", 0x0403)
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    listing = desk.listing()
    assert len(listing.found) == 1
    (why,) = listing.unseen
    assert why.problem == f"this user may not open the port {device}"
    assert "usermod -aG dialout" in why.remedy


def test_no_port_is_opened(desk, monkeypatch):
    desk.plug("ttyUSB0", "FT232R", 0x0403)
    opened = []
    monkeypatch.setattr(os, "open", lambda *arguments: opened.append(arguments))
    monkeypatch.setattr("serial.Serial", lambda *arguments: opened.append(arguments))
    assert len(desk.listing().found) == 1
    assert opened == []


def test_without_the_package_a_sentence_says_what_to_do(monkeypatch):
    for name in ("serial", "serial.tools", "serial.tools.list_ports"):
        monkeypatch.setitem(sys.modules, name, None)
    (why,) = list_serial_ports().unseen
    assert "need the package pyserial" in why.problem
