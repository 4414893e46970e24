"""What the system must grant: said only of what is connected or configured."""

import os
from dataclasses import replace
from pathlib import Path

import pytest

from drivers.discovery import Listing
from drivers.discovery.oak_cameras import UDEV_RULE
from navapp.config import Configuration, parse
from navapp.inventory import system_checks
from navapp.inventory.finding import Health
from navapp.inventory.system_checks import check_system
from tests.inventory.inventories import BEAMER, EVERYTHING, NOTHING, PORT, USB

USB_PAIR = parse({"camera": {"backend": "opencv", "opencv": {"left": "A1"}}}, "x")
OAK = parse({"camera": {"backend": "depthai"}}, "x")
WINDOW = parse({"display": {"backend": "window", "size_px": [1280, 720]}}, "x")
LINE = parse({"mirror": {"backend": "zaber", "port": "/dev/serial/by-id/x"}}, "x")
NETWORK_LINE = parse({"mirror": {"backend": "zaber", "port": "socket://host:1"}}, "x")


@pytest.fixture(autouse=True)
def _stranger(monkeypatch):
    """A user who is not root and belongs to no group."""
    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    monkeypatch.setattr(os, "getegid", lambda: 99999)
    monkeypatch.setattr(os, "getgroups", list)
    monkeypatch.setattr(system_checks, "list_oak_nodes", tuple)


def finding(name, configuration=None, found=NOTHING):
    findings = check_system(configuration or Configuration(), found)
    return {one.name: one for one in findings}.get(name)


def with_devices(folder):
    camera, port = folder / "video0", folder / "ttyUSB0"
    camera.touch()
    port.touch()
    return replace(
        EVERYTHING,
        usb_cameras=Listing((replace(USB, node=camera),)),
        serial_ports=Listing((replace(PORT, device=str(port)),)),
    )


@pytest.mark.parametrize("name", ["group video", "group dialout", "udev rule for OAK"])
def test_nothing_is_said_of_what_nobody_has_or_wants(name):
    assert finding(name) is None


@pytest.mark.parametrize(
    ("name", "configured"), [("group video", USB_PAIR), ("group dialout", LINE)]
)
def test_a_group_is_looked_at_when_its_devices_are_there_or_configured(
    tmp_path, monkeypatch, name, configured
):
    group = name.split()[1]
    # Nothing to try: membership decides, and the session may yet work another way.
    absent = finding(name, configured)
    assert absent.health is Health.WARNING
    assert f"usermod -aG {group}" in absent.remedy
    there = with_devices(tmp_path)
    assert finding(name, found=there).health is Health.OK
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    # Whether it is one of the configured ones, and so a failure, another check says.
    forbidden = finding(name, found=there)
    assert forbidden.health is Health.WARNING
    assert str(tmp_path) in forbidden.detail
    assert f"usermod -aG {group}" in forbidden.remedy


def test_root_needs_no_group(monkeypatch):
    monkeypatch.setattr(os, "geteuid", lambda: 0)
    assert finding("group video", USB_PAIR).health is Health.OK
    assert finding("udev rule for OAK", OAK).detail == "root needs none"


def test_a_line_over_the_network_needs_no_group():
    assert finding("group dialout", NETWORK_LINE) is None


def test_the_udev_rule_is_seen_on_the_camera_itself(tmp_path, monkeypatch):
    node = tmp_path / "005"
    node.touch()
    monkeypatch.setattr(system_checks, "list_oak_nodes", lambda: (node,))
    assert finding("udev rule for OAK").health is Health.OK
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    forbidden = finding("udev rule for OAK")
    assert forbidden.health is Health.WARNING
    assert UDEV_RULE in forbidden.remedy


def test_without_a_camera_the_udev_rule_is_looked_up(tmp_path, monkeypatch):
    monkeypatch.setattr(system_checks, "_RULE_FOLDERS", (tmp_path, tmp_path / "absent"))
    missing = finding("udev rule for OAK", OAK)
    assert missing.health is Health.WARNING
    assert UDEV_RULE in missing.remedy
    (tmp_path / "80-movidius.rules").write_text(UDEV_RULE)
    assert finding("udev rule for OAK", OAK).health is Health.OK


def test_libraries_of_a_window_are_needed_by_a_window_only(monkeypatch):
    assert finding("window libraries", found=EVERYTHING).health in (Health.OK, Health.WARNING)
    monkeypatch.setattr(system_checks, "_WINDOW_LIBRARIES", ("libX11.so.6", "libnone-such.so.9"))
    missing = finding("window libraries")
    assert missing.health is Health.WARNING
    assert "libnone-such.so.9" in missing.detail
    assert finding("window libraries", WINDOW).health is Health.FAILED


def test_the_display_server_is_needed_by_a_window_only():
    assert finding("display server").health is Health.WARNING
    without = finding("display server", WINDOW)
    assert (without.health, without.remedy) == (Health.FAILED, "let me look")
    reached = finding("display server", WINDOW, replace(NOTHING, displays=Listing((BEAMER,))))
    assert (reached.health, reached.detail) == (Health.OK, "X11 shows EPSON PJ (1280x720)")


def test_the_libraries_are_those_that_the_makefile_installs():
    makefile = Path(__file__).resolve().parents[2] / "Makefile"
    installed = makefile.read_text(encoding="utf-8").lower()
    for library in (*system_checks._WINDOW_LIBRARIES, *system_checks._OPEN3D_LIBRARIES):
        assert library.partition(".so")[0].lower() in installed, library
