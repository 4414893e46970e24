"""The composition root: what it opens, refuses and closes again."""

import time
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import navapp.devices.cameras
from drivers.clock import SystemClock
from drivers.depthai_stereo import DepthaiStereo
from drivers.interfaces import PowerState
from drivers.opencv_stereo import OpencvStereo
from drivers.replay_camera import ReplaySettings
from navapp.config import Configuration, format_toml, parse
from navapp.devices import open_live, open_recording
from navapp.errors import (
    ConfigurationError,
    DeviceLost,
    DeviceNotFound,
    RigError,
    UsageError,
    WrongDevice,
)
from navapp.geometry import write_rig
from sim_devices.camera import SimulatedCamera
from sim_devices.firmware import pjlink
from sim_devices.firmware.pjlink_server import PjlinkServer
from tests.devices.package_cameras import Entry, announce
from tests.drivers.firmware_rigs import SERIAL, STAGE_SERIAL, projector_terminal, stage_terminal
from tests.drivers.losing import fails_within
from tests.drivers.recordings import write_pairs
from tests.drivers.usb_rigs import UsbRig
from tests.sim_devices.plain_world import plain_rig
from tests.x_servers import seen, xvfb

SMALL = {"camera": {"simulated": {"scale": 0.2}}}


@pytest.fixture
def camera(monkeypatch) -> SimulatedCamera:
    """Of an installed package; after 0.1 s another one stands in its place."""
    entry = Entry()
    announce(monkeypatch, [entry])
    return entry.camera


def acme(tmp_path, width: int = 64, height: int = 48) -> Configuration:
    write_rig(tmp_path / "rig.yml", plain_rig(width, height))
    return parse({"camera": {"backend": "acme", "rig": str(tmp_path / "rig.yml")}}, "x")


def is_closed(camera: SimulatedCamera) -> bool:
    try:
        camera.read(0.0)
    except DeviceLost:
        return True
    return False


def test_an_installed_camera_is_opened_and_reopened(camera, tmp_path) -> None:
    opened = open_live(acme(tmp_path), is_headless=True)
    assert opened.devices.camera is camera
    assert opened.simulation is None
    camera.close()
    assert opened.reopen_camera() is camera
    assert not is_closed(camera)
    opened.devices.close()


def test_an_installed_camera_of_another_size_is_refused_and_closed(camera, tmp_path) -> None:
    with pytest.raises(RigError, match="64x48, the rig was calibrated at 128x96"):
        open_live(acme(tmp_path, 128, 96), is_headless=True)
    assert is_closed(camera)


def test_a_camera_of_another_rig_is_refused_and_closed(camera, tmp_path) -> None:
    settings = acme(tmp_path)
    strangers = replace(plain_rig(64, 48), serials=("OTHER-L", "OTHER-R"))
    write_rig(tmp_path / "rig.yml", strangers)
    with pytest.raises(WrongDevice, match="the rig was calibrated with OTHER-L and OTHER-R"):
        open_live(settings, is_headless=True)
    assert is_closed(camera)


def test_another_camera_in_its_place_is_refused_and_closed(camera, tmp_path) -> None:
    opened = open_live(acme(tmp_path), is_headless=True)
    for _ in range(3):
        camera.read(1.0)
    camera.close()
    with pytest.raises(WrongDevice, match="-other"):
        opened.reopen_camera()
    assert is_closed(camera)
    opened.devices.close()


def test_a_simulated_camera_that_comes_back_as_another_is_refused() -> None:
    faults = [{"kind": "wrong_serial", "start_s": 0.1, "duration_s": 9.0}]
    content = {"camera": {"simulated": {"scale": 0.2, "faults": faults}}}
    opened = open_live(parse(content, "x"), is_headless=True)
    for _ in range(3):
        opened.devices.camera.read(1.0)
    opened.devices.camera.close()
    with pytest.raises(WrongDevice, match="-other"):
        opened.reopen_camera()
    opened.devices.close()


def test_a_simulated_rig_says_so_by_its_name() -> None:
    opened = open_live(parse(SMALL, "x"), is_headless=True)
    assert opened.rig.name.startswith("sim:")
    opened.devices.close()


def test_frames_and_rig_of_a_rolling_shutter_say_how_late_a_row_is() -> None:
    content = {"camera": {"simulated": {"scale": 0.2, "shutter_ms": 15.0}}}
    opened = open_live(parse(content, "x"), is_headless=True)
    frame = opened.devices.camera.read(1.0)
    opened.devices.close()
    assert frame.row_delay_ns == opened.rig.row_delay_ns
    assert frame.row_delay_ns * 720 * 0.2 == pytest.approx(15e6, rel=0.01)


def test_a_shutter_that_is_longer_than_a_frame_period_is_refused() -> None:
    content = {"camera": {"rate_hz": 30.0, "simulated": {"shutter_ms": 26.0}}}
    with pytest.raises(ConfigurationError, match=r"shutter_ms of at most 25\.3") as caught:
        open_live(parse(content, "x"), is_headless=True)
    assert caught.value.subject == "camera.simulated.shutter_ms"


def test_a_recording_of_another_size_is_refused(tmp_path) -> None:
    pairs = write_pairs(tmp_path / "pairs", range(2))
    with pytest.raises(RigError, match="48x32"):
        open_recording(str(pairs), ReplaySettings(), plain_rig(), Configuration())


def test_recorded_frames_have_the_row_delay_of_their_rig(tmp_path) -> None:
    pairs = write_pairs(tmp_path / "pairs", range(1))
    rig = replace(plain_rig(48, 32), row_delay_ns=20_862)
    opened = open_recording(str(pairs), ReplaySettings(), rig, Configuration())
    frame = opened.devices.camera.read(1.0)
    opened.devices.close()
    assert frame.row_delay_ns == 20_862


def test_an_unknown_backend_is_refused(tmp_path, monkeypatch) -> None:
    announce(monkeypatch, [])
    with pytest.raises(ConfigurationError, match="no camera backend 'acme'"):
        open_live(acme(tmp_path), is_headless=True)


def with_ports(folder: Path, projector: str = "", mirror: str = "") -> Configuration:
    ports = {
        "projector": {"backend": "escvp21", "port": f"{folder}/projector", "serial": projector},
        "mirror": {"backend": "zaber", "port": f"{folder}/stage", "serial": mirror},
    }
    return parse({**SMALL, **ports}, "x")


def test_projector_and_mirror_are_opened_on_their_ports(tmp_path) -> None:
    with projector_terminal(tmp_path), stage_terminal(tmp_path):
        opened = open_live(with_ports(tmp_path, SERIAL, STAGE_SERIAL), is_headless=True)
        assert opened.devices.projector.name == f"sim:ESC/VP21 projector {SERIAL}"
        assert opened.devices.mirror.info.name == f"sim:Zaber mount {STAGE_SERIAL}"
        assert opened.devices.projector.status().power is PowerState.STANDBY
        assert opened.devices.mirror.position_deg() is None
        opened.devices.close()


def test_another_mount_is_refused_and_everything_is_closed(tmp_path) -> None:
    with projector_terminal(tmp_path), stage_terminal(tmp_path):
        with pytest.raises(WrongDevice, match="has serial number 990123, the rig's is 1"):
            open_live(with_ports(tmp_path, SERIAL, "1"), is_headless=True)
        # A line that was left open would be refused to the second one.
        open_live(with_ports(tmp_path, SERIAL), is_headless=True).devices.close()


def test_a_port_that_is_not_there_says_what_to_do(tmp_path) -> None:
    with pytest.raises(
        DeviceNotFound, match=r"cannot be opened \(No such file.*: connect the device"
    ):
        open_live(with_ports(tmp_path), is_headless=True)


def test_a_recording_asks_no_projector_and_moves_no_mirror(tmp_path) -> None:
    write_pairs(tmp_path / "pairs", range(1))
    rig = plain_rig(48, 32)
    opened = open_recording(
        str(tmp_path / "pairs"), ReplaySettings(), rig, with_ports(tmp_path / "nowhere")
    )
    assert opened.devices.projector.status().power is PowerState.ABSENT
    assert not opened.devices.mirror.info.is_movable
    opened.devices.close()


WINDOW = {"backend": "window", "size_px": [320, 200]}


def test_a_window_is_opened_on_the_only_output(monkeypatch) -> None:
    with xvfb(320, 200) as server:
        monkeypatch.setenv("DISPLAY", server)
        content = {**SMALL, "display": {**WINDOW, "flip_vertically": True}}
        devices = open_live(parse(content, "x"), is_headless=True).devices
        info = devices.display.info
        assert (info.backend, info.width, info.height) == ("window", 320, 200)
        assert (info.flips_horizontally, info.flips_vertically) == (False, True)
        white = np.full((200, 320, 3), 255, np.uint8)
        devices.display.show(white, devices.clock.now_ns() + 60 * 10**9)
        end_s = time.monotonic() + 5.0
        while not seen(server, 0, 0, 320, 200).all():
            assert time.monotonic() < end_s
        devices.close()
        assert not seen(server, 0, 0, 320, 200).any()


def test_a_window_that_cannot_be_opened_closes_the_camera(camera, tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("DISPLAY", ":31999")
    settings = acme(tmp_path).model_copy(
        update={"display": parse({"display": WINDOW}, "x").display}
    )
    with pytest.raises(DeviceNotFound, match="no X11 screen"):
        open_live(settings, is_headless=True)
    assert is_closed(camera)


def test_a_recording_lights_no_display_and_asks_no_projector(tmp_path) -> None:
    pairs = write_pairs(tmp_path / "pairs", range(2))
    content = {"display": WINDOW, "projector": {"backend": "pjlink", "host": "192.0.2.1"}}
    opened = open_recording(str(pairs), ReplaySettings(), plain_rig(48, 32), parse(content, "x"))
    assert opened.devices.display.info.is_simulated
    assert opened.devices.projector.status().power is PowerState.ABSENT
    opened.devices.close()


def test_a_pjlink_projector_is_opened_with_the_password_of_a_file(tmp_path) -> None:
    server = PjlinkServer(pjlink.PjlinkProjector(SystemClock(), password="open sesame"))
    server.start()
    (tmp_path / "password").write_text("open sesame\n")
    settings = {
        "backend": "pjlink",
        "host": "127.0.0.1",
        "tcp_port": server.port,
        "password_file": str(tmp_path / "password"),
    }
    try:
        configuration = parse({**SMALL, "projector": settings}, "x")
        devices = open_live(configuration, is_headless=True).devices
        assert devices.projector.name == "sim:projector"
        assert devices.projector.status().power is PowerState.STANDBY
        devices.close()
        assert "sesame" not in format_toml(configuration, True) + repr(configuration)
        (tmp_path / "password").unlink()
        with pytest.raises(ConfigurationError, match=r"password file .* cannot be read"):
            open_live(configuration, is_headless=True)
    finally:
        server.close()


@pytest.fixture
def usb(tmp_path, monkeypatch) -> UsbRig:
    """Two fake USB cameras in the places where real ones are looked for."""
    rig = UsbRig(tmp_path)
    monkeypatch.setattr(
        navapp.devices.cameras,
        "OpencvStereo",
        partial(OpencvStereo, names=rig.bus.names, open_capture=rig.bus.open_capture),
    )
    return rig


def usb_configuration(tmp_path, **opencv: object) -> Configuration:
    write_rig(tmp_path / "rig.yml", replace(plain_rig(64, 48), serials=("L1", "R1")))
    table = {"left": "L1", "right": "R1", "width": 64, "height": 48, "max_skew_ms": 4.0, **opencv}
    camera = {"backend": "opencv", "rate_hz": 100.0, "rig": str(tmp_path / "rig.yml")}
    return parse({"camera": {**camera, "opencv": table}}, "x")


def test_usb_cameras_are_opened_as_configured_and_come_back(usb, tmp_path) -> None:
    opened = open_live(usb_configuration(tmp_path, exposure_ms=5.0), is_headless=True)
    camera = opened.devices.camera
    frame = camera.read(1.0)
    assert frame.rig_id == opened.rig.rig_id
    assert camera.info.controls["exposure_ms"] == 5.0
    camera.close()
    usb.bus.unplug(usb.left)
    with pytest.raises(DeviceNotFound, match="L1 is not connected"):
        opened.reopen_camera()
    usb.bus.plug("L1", 9)
    assert opened.reopen_camera().read(1.0).sequence > frame.sequence
    opened.devices.close()


def test_usb_cameras_of_another_rig_or_swapped_are_refused_and_closed(usb, tmp_path) -> None:
    with pytest.raises(WrongDevice, match="serial numbers R1 and L1, the rig was calibrated with"):
        open_live(usb_configuration(tmp_path, left="R1", right="L1"), is_headless=True)
    assert usb.left.n_open == usb.right.n_open == 0


def test_usb_cameras_without_a_name_are_refused(tmp_path) -> None:
    with pytest.raises(UsageError, match="no camera is named"):
        open_live(usb_configuration(tmp_path, left=""), is_headless=True)


def test_an_oak_camera_is_opened_as_configured(tmp_path, monkeypatch) -> None:
    host_oak = pytest.importorskip("tests.drivers.host_oak", reason="needs the package depthai")
    oak = host_oak.HostOak("OAK-1")
    monkeypatch.setattr(
        navapp.devices.cameras, "DepthaiStereo", partial(DepthaiStereo, open_device=oak.open_parts)
    )
    rig = replace(plain_rig(64, 48), serials=("OAK-1", "OAK-1"))
    write_rig(tmp_path / "rig.yml", rig)
    table = {"device": "OAK-1", "width": 64, "height": 48, "exposure_ms": 3.0}
    camera = {"backend": "depthai", "rate_hz": 100.0, "rig": str(tmp_path / "rig.yml")}
    opened = open_live(parse({"camera": {**camera, "depthai": table}}, "x"), is_headless=True)
    assert opened.devices.camera.read(1.0).rig_id == rig.rig_id
    assert opened.devices.camera.info.controls["exposure_ms"] == pytest.approx(3.0)
    oak.unplug()
    fails_within(opened.devices.camera, DeviceLost)
    opened.devices.camera.close()
    with pytest.raises(DeviceNotFound):
        opened.reopen_camera()
    opened.devices.close()


def test_an_oak_camera_that_is_absent_is_told_so(tmp_path) -> None:
    write_rig(tmp_path / "rig.yml", plain_rig(64, 48))
    camera = {"backend": "depthai", "rig": str(tmp_path / "rig.yml")}
    table = {"device": "NONE-OF-THEM"}
    with pytest.raises(DeviceNotFound):
        open_live(parse({"camera": {**camera, "depthai": table}}, "x"), is_headless=True)
