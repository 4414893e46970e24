"""The configuration's own devices, present and absent."""

import os
from dataclasses import replace

import pytest

from drivers.discovery import Listing, Unseen
from navapp.config import parse
from navapp.inventory.configured_checks import check_configured_devices
from navapp.inventory.finding import Health
from tests.drivers.fake_capture import FakeBus
from tests.inventory.inventories import ACME, BEAMER, DESK, EVERYTHING, NOTHING, OAK, WHY

OK, WARNING, FAILED = Health.OK, Health.WARNING, Health.FAILED


def finding(name, found=NOTHING, names=None, **tables):
    findings = check_configured_devices(parse(tables, "x"), found, names)
    return next(one for one in findings if one.name == name)


def test_a_simulated_session_needs_nothing():
    findings = check_configured_devices(parse({}, "x"), NOTHING)
    assert {one.name: (one.health, one.detail) for one in findings} == {
        "camera": (OK, "simulated"),
        "display": (OK, "simulated"),
        "projector": (OK, "none"),
        "mirror": (OK, "fixed at 45 deg"),
    }


def test_each_usb_camera_is_looked_up_by_its_name(tmp_path):
    bus = FakeBus(tmp_path)
    bus.plug("A1", 1)
    camera = {"backend": "opencv", "opencv": {"left": "A1", "right": "B2"}}
    left = finding("camera, left", names=bus.names, camera=camera)
    assert (left.health, left.detail) == (OK, f"A1 is {bus.root / 'dev' / 'video2'}")
    right = finding("camera, right", names=bus.names, camera=camera)
    assert (right.health, right.detail) == (
        FAILED,
        "camera B2 is not connected (connected: A1)",
    )


def test_a_usb_camera_that_this_user_may_not_open_is_a_failure(tmp_path, monkeypatch):
    bus = FakeBus(tmp_path)
    bus.plug("A1", 1)
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    camera = {"backend": "opencv", "opencv": {"left": "A1"}}
    told = finding("camera, left", names=bus.names, camera=camera)
    assert told.health is FAILED
    assert "the group video" in told.remedy


@pytest.mark.parametrize(
    ("left", "words"), [("", "names none"), ("/dev/video0", "does not name a camera for good")]
)
def test_a_name_that_names_no_camera_is_told(tmp_path, left, words):
    camera = {"backend": "opencv", "opencv": {"left": left}}
    told = finding("camera, left", names=FakeBus(tmp_path).names, camera=camera)
    assert told.health is FAILED
    assert words in told.detail


def oak(device, *ids, unseen=()):
    found = Listing(tuple(replace(OAK, device_id=one) for one in ids), unseen)
    camera = {"backend": "depthai", "depthai": {"device": device}}
    return finding("camera", replace(NOTHING, oak_cameras=found), camera=camera)


def test_an_oak_camera_is_looked_up_by_its_id_or_is_the_only_one():
    assert oak("ONE", "ONE", "TWO").health is oak("", "ONE").health is OK
    assert oak("THREE", "ONE").detail == "OAK camera THREE is not connected (connected: ONE)"
    assert oak("").detail == "OAK camera is not connected (connected: none)"
    assert "several OAK cameras" in oak("", "ONE", "TWO").detail
    blind = oak("ONE", unseen=(WHY,))
    assert (blind.health, blind.detail, blind.remedy) == (FAILED, WHY.problem, WHY.remedy)


def test_a_camera_of_another_package_is_there_broken_or_missing():
    camera = {"backend": "acme"}
    assert finding("camera", EVERYTHING, camera=camera).health is OK
    assert ACME.package in finding("camera", EVERYTHING, camera=camera).detail
    broken = Unseen("camera.acme", "it cannot be loaded", "mend it")
    found = replace(NOTHING, installed_cameras=Listing((), (WHY, broken)))
    assert finding("camera", found, camera=camera).detail == broken.problem
    assert finding("camera", camera=camera).detail == "there is no camera backend 'acme'"


@pytest.mark.parametrize(
    ("outputs", "health", "words"),
    [
        ((DESK, BEAMER), OK, r"EPSON PJ (1280x720) is connected"),
        ((DESK,), FAILED, "there is no output 'EPSON PJ'"),
        ((replace(BEAMER, width=800),), FAILED, "has another size than 1280x720"),
        ((), FAILED, WHY.problem),
    ],
)
def test_a_windows_output_must_be_there_with_its_size(outputs, health, words):
    found = replace(NOTHING, displays=Listing(outputs, () if outputs else (WHY,)))
    display = {"backend": "window", "output": "EPSON PJ", "size_px": [1280, 720]}
    told = finding("display", found, display=display)
    assert told.health is health
    assert words in told.detail


def test_a_port_must_be_there_and_allowed(tmp_path, monkeypatch):
    port = tmp_path / "usb-FT"
    mirror, projector = (
        {"backend": backend, "port": str(port)} for backend in ("zaber", "escvp21")
    )
    assert finding("mirror", mirror=mirror).detail == f"there is no port {port}"
    port.touch()
    assert finding("projector", projector=projector).health is OK
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    forbidden = finding("mirror", mirror=mirror)
    assert forbidden.health is FAILED
    assert "the group dialout" in forbidden.remedy


@pytest.mark.parametrize(
    "projector",
    [
        {"backend": "pjlink", "host": "10.0.0.2", "tcp_port": 3629},
        {"backend": "escvp21", "port": "socket://10.0.0.2:3629"},
    ],
)
def test_what_is_on_the_network_is_not_asked_and_not_called_fine(projector):
    told = finding("projector", projector=projector)
    assert told.health is WARNING
    assert "10.0.0.2:3629" in told.detail
