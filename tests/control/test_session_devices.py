"""The controller's devices: a camera that is lost or silent, a display that fails, the mirror."""

import numpy as np
import pytest

from drivers.fixed_mirror import FixedMirror
from drivers.interfaces import PowerState
from drivers.no_projector import NoProjector
from navapp.control.commands import Reconnect, Register
from navapp.control.device_handlers import MIRROR_TOLERANCE_DEG
from navapp.control.states import (
    DeviceHealth,
    DeviceLine,
    EventLevel,
)
from navapp.errors import DeviceLost, DeviceNotFound, DeviceTimeout, WrongDevice
from navapp.values import Reason
from tests.control.fakes import Bench, navigating


def test_a_lost_camera_is_a_fault_and_dark_and_it_comes_back_suspended(bench: Bench) -> None:
    navigating(bench)
    bench.camera.error = DeviceLost("the camera was unplugged")
    snapshot = bench.frames(1)
    assert snapshot.state.value == "fault"
    assert snapshot.reasons[0] is Reason.DEVICE_FAULT
    assert bench.is_dark
    assert not snapshot.is_over
    assert snapshot.devices[0].health is DeviceHealth.LOST
    bench.camera.opening_error = DeviceNotFound("still unplugged")
    for _ in range(20):
        assert bench.frames(1).state.value == "fault"
    assert "still unplugged" in bench.snapshot.devices[0].detail
    bench.camera.error = bench.camera.opening_error = None
    for _ in range(40):
        if bench.frames(1).state.value == "suspended":
            break
    assert bench.state == "suspended"
    assert bench.frames(1).state.value == "navigating"
    assert bench.shows_guides
    assert bench.snapshot.devices[0].health is DeviceHealth.OK


def test_a_camera_lost_before_a_registration_comes_back_ready(bench: Bench) -> None:
    bench.frames(1)
    bench.do(Register())
    bench.camera.error = DeviceLost("gone")
    bench.frames(1)
    assert bench.do(Register()).state.value == "fault"
    assert "camera is lost" in bench.refused()
    bench.camera.error = None
    bench.do(Reconnect())
    assert bench.frames(1).state.value == "ready"


def test_another_camera_is_not_taken_for_the_calibrated_one(bench: Bench) -> None:
    navigating(bench)
    bench.camera.error = DeviceLost("gone")
    bench.frames(1)
    bench.camera.opening_error = WrongDevice("serial numbers differ")
    bench.do(Reconnect())
    for _ in range(15):
        assert bench.frames(1).state.value == "fault"
    assert bench.is_dark
    assert "serial numbers differ" in bench.snapshot.devices[0].detail


def test_attempts_to_reopen_pause_for_longer_and_longer(bench: Bench) -> None:
    attempts = []
    bench.frames(1)
    bench.camera.error = DeviceLost("gone")
    bench.frames(1)

    def refuse() -> None:
        attempts.append(bench.clock.now_ns())
        raise DeviceNotFound("no")

    bench.camera.open = refuse
    start_ns = bench.clock.now_ns()
    while bench.clock.now_ns() < start_ns + 20 * 10**9:
        bench.frames(1)
    pauses_s = np.diff([start_ns, *attempts]) * 1e-9
    assert pauses_s == pytest.approx([1.0, 2.0, 4.0, 4.0, 4.0, 4.0], abs=0.3)


def test_a_bug_in_opening_a_camera_again_is_told_and_does_not_end_the_attempts(
    bench: Bench,
) -> None:
    navigating(bench)
    bench.camera.error = DeviceLost("gone")
    bench.frames(1)
    bench.camera.opening_error = RuntimeError("a bug")
    for _ in range(20):
        assert bench.frames(1).state.value == "fault"
    assert "opening the camera failed: RuntimeError('a bug')" in bench.line("camera").detail
    assert bench.is_dark
    bench.camera.error = bench.camera.opening_error = None
    bench.do(Reconnect())
    assert bench.frames(2).is_navigable


def test_a_camera_that_nobody_can_reopen_ends_the_session() -> None:
    bench = Bench(can_reopen=False)
    bench.frames(1)
    bench.camera.error = DeviceLost("gone")
    assert bench.frames(1).is_over


def test_a_silent_camera_turns_everything_dark(bench: Bench) -> None:
    navigating(bench)
    bench.camera.is_silent = True
    for _ in range(8):
        bench.controller.step(0.2)
    assert bench.is_dark
    assert Reason.CAMERA_SILENT in bench.snapshot.reasons
    assert Reason.POSE_TOO_OLD in bench.snapshot.reasons
    assert bench.line("camera").health is DeviceHealth.TROUBLE
    assert bench.line("camera").detail == "no frame"
    bench.camera.is_silent = False
    assert bench.frames(1).is_navigable
    assert bench.line("camera").health is DeviceHealth.OK


def test_guides_leave_the_display_when_their_pose_is_too_old() -> None:
    """However long a picture is said to stay valid."""
    bench = navigating(Bench(overlay_valid_ms=60_000.0))
    bench.camera.is_silent = True
    bench.controller.step(0.3)
    assert bench.shows_guides
    bench.controller.step(0.3)
    assert Reason.POSE_TOO_OLD in bench.snapshot.reasons
    assert not bench.shows_guides


def test_a_picture_is_dark_when_its_time_is_over(bench: Bench) -> None:
    navigating(bench)
    valid_ns = bench.results[-1].picture.valid_until_ns
    assert valid_ns == bench.results[-1].frame.captured_ns + 500_000_000
    bench.clock.wait_until_ns(valid_ns - 1)
    assert bench.shows_guides
    bench.clock.wait_until_ns(valid_ns)
    assert bench.is_dark


def test_a_failing_display_does_not_stop_the_line(bench: Bench) -> None:
    navigating(bench)
    show = bench.display.show

    def fail(image, valid_until_ns):
        raise DeviceTimeout("the display is silent")

    bench.display.show = fail
    bench.frames(3)
    assert bench.results[-1].frame.sequence == bench.snapshot.sequence
    assert bench.snapshot.devices[1].health is DeviceHealth.TROUBLE
    assert sum("display is silent" in event.text for event in bench.events) == 1
    bench.display.show = show
    bench.frames(1)
    assert bench.snapshot.devices[1].health is DeviceHealth.OK
    assert bench.shows_guides


class BrokenProjector(NoProjector):
    """Says nothing when asked."""

    def status(self):
        raise DeviceTimeout("the projector does not answer")


def device_line(bench: Bench, kind: str) -> DeviceLine:
    return next(line for line in bench.snapshot.devices if line.kind == kind)


def test_a_projector_that_does_not_answer_is_told_and_everything_is_dark() -> None:
    bench = Bench(projector=BrokenProjector())
    try:
        navigating(bench)
        line = device_line(bench, "projector")
        assert line.health is DeviceHealth.LOST
        assert "does not answer" in line.detail
        assert Reason.PROJECTOR_LOST in bench.snapshot.reasons
        assert bench.is_dark
    finally:
        bench.controller.close()
    assert NoProjector().status().power is PowerState.ABSENT


def test_a_mirror_that_does_not_answer_is_told_and_everything_is_dark() -> None:
    class Broken(FixedMirror):
        def position_deg(self) -> float:
            raise DeviceLost("the mirror's cable is out")

    bench = Bench(mirror=Broken(45.0))
    navigating(bench)
    line = device_line(bench, "mirror")
    assert line.health is DeviceHealth.LOST
    assert "cable is out" in line.detail
    assert Reason.MIRROR_AWAY in bench.snapshot.reasons
    assert bench.is_dark


def test_a_mirror_away_from_its_calibrated_angle_makes_everything_dark() -> None:
    class Turnable(FixedMirror):
        angle_deg = 45.0

        def position_deg(self) -> float:
            return self.angle_deg

    mirror = Turnable(45.0)
    bench = navigating(Bench(mirror=mirror))
    assert bench.shows_guides
    mirror.angle_deg = 45.0 + 2.0 * MIRROR_TOLERANCE_DEG
    snapshot = bench.frames(1)
    assert bench.is_dark
    assert snapshot.reasons == (Reason.MIRROR_AWAY,)
    assert snapshot.state.value == "navigating"
    assert bench.events[-1].level is EventLevel.ALARM
    assert "does not stand where the display was calibrated (45.1 deg" in bench.events[-1].text
    mirror.angle_deg = 45.0 - 0.5 * MIRROR_TOLERANCE_DEG
    assert bench.frames(1).is_navigable
    assert bench.shows_guides
    assert "no longer" in bench.events[-1].text


def test_no_frame_is_shown_between_a_turned_mirror_and_the_dark() -> None:
    """What was shown before is darkened also when no new frame comes."""
    mirror = FixedMirror(45.0)
    bench = navigating(Bench(mirror=mirror))
    mirror._angle_deg = 46.0
    bench.camera.is_silent = True
    bench.controller.step(0.01)
    assert bench.is_dark
