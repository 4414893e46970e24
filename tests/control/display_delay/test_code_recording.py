"""A code that is played and watched: what is recorded, and what is dark afterwards."""

import threading

import numpy as np
import pytest

from calibration.latency.acceptance import WORST_MS, measure_accepted_latency
from calibration.latency.light_code import draw_pauses_ms
from calibration.latency.measurement import Latency
from navapp.control.display_delay.code_player import CodePlayer
from navapp.control.display_delay.code_recording import CodeRecording, record_code
from navapp.errors import DeviceLost, DeviceTimeout, ResultError
from sim_devices.faults import Fault, FaultKind
from tests.control.display_delay.rooms import MS, Breaking, Room

pytestmark = pytest.mark.waits

HALF_REFRESH_MS = 500.0 / 59.94


def nothing(_: float) -> None:
    pass


def player_of(room: Room, seconds: float) -> CodePlayer:
    return CodePlayer(room.display, room.clock, draw_pauses_ms(seconds, 0))


def players() -> list[threading.Thread]:
    return [thread for thread in threading.enumerate() if thread.name == "code"]


@pytest.mark.parametrize(
    "truth",
    [
        {"delay_ms": 12.5},
        {"delay_ms": 133.0, "unstamped_skew_ms": 11.0, "rate_hz": 29.0},
        {"delay_ms": 71.0, "skew_ms": 6.0, "unstamped_skew_ms": -17.0, "seed": 5},
    ],
)
def test_the_truth_of_the_room_is_recovered(truth: dict[str, float]) -> None:
    room = Room(**truth)
    recording = record_code(room.camera, player_of(room, 20.0), room.clock, nothing)
    found = measure_accepted_latency(recording.switches, recording.left, recording.right, 59.94)
    true_late_ms = truth.get("unstamped_skew_ms", 0.0)
    true_offset_ms = true_late_ms + truth.get("skew_ms", 0.0)
    assert found.delay.value_ms == pytest.approx(truth["delay_ms"] + HALF_REFRESH_MS, abs=WORST_MS)
    assert found.late.value_ms == pytest.approx(true_late_ms, abs=WORST_MS)
    assert found.offset.value_ms == pytest.approx(true_offset_ms, abs=WORST_MS)
    assert recording.age_ms is None


def recorded_and_judged(**truth: float) -> tuple[CodeRecording, Latency]:
    """In real time; again when the judge refuses what a busy machine did to a recording."""
    for is_last in (False, False, True):
        room = Room(is_stepped=False, **truth)
        recording = record_code(room.camera, player_of(room, 8.0), room.clock, nothing)
        try:
            found = measure_accepted_latency(
                recording.switches, recording.left, recording.right, 59.94
            )
        except ResultError:
            if is_last:
                raise
        else:
            break
    return recording, found


@pytest.mark.slow
def test_a_camera_that_runs_by_itself_is_read_while_a_thread_plays() -> None:
    recording, found = recorded_and_judged(rate_hz=43.0, delay_ms=55.0, unstamped_skew_ms=9.0)
    assert found.delay.value_ms == pytest.approx(55.0 + HALF_REFRESH_MS, abs=WORST_MS)
    assert found.late.value_ms == pytest.approx(9.0, abs=WORST_MS)
    assert recording.age_ms is not None
    assert recording.age_ms > 9.0
    assert not players()


def test_frames_that_are_dropped_or_repeated_are_borne() -> None:
    room = Room(
        Fault(FaultKind.DROP, 3.0, 1.0),
        Fault(FaultKind.FREEZE, 6.0, 0.5),
        Fault(FaultKind.DROP, 9.0, 2.0),
    )
    recording = record_code(room.camera, player_of(room, 20.0), room.clock, nothing)
    assert (np.diff(recording.left.times_ms) > 0.0).all()
    assert np.diff(recording.left.times_ms).max() > 1900.0
    found = measure_accepted_latency(recording.switches, recording.left, recording.right, 59.94)
    assert found.delay.value_ms == pytest.approx(40.0 + HALF_REFRESH_MS, abs=WORST_MS)


def test_progress_rises_to_one_and_the_display_is_dark_at_the_end() -> None:
    room, told = Room(), []
    record_code(room.camera, player_of(room, 3.0), room.clock, told.append)
    assert told == sorted(told)
    assert told[-1] == 1.0
    assert len(set(told)) > 20
    assert room.light_from_now() == 0.0


def test_switches_are_the_pauses_of_the_code_and_stand_in_no_step_with_the_frames() -> None:
    room = Room()
    recording = record_code(room.camera, player_of(room, 10.0), room.clock, nothing)
    np.testing.assert_allclose(
        np.diff(recording.switches.times_ms), draw_pauses_ms(10.0, 0), atol=0.01
    )
    phases = np.exp(2j * np.pi * recording.switches.times_ms / 40.0)
    assert abs(phases.mean()) < 0.3


@pytest.mark.parametrize("is_stepped", [True, False])
def test_an_interrupt_leaves_darkness_and_no_thread(is_stepped: bool) -> None:
    room = Room(is_stepped=is_stepped)
    player = player_of(room, 20.0)

    def interrupt() -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        record_code(Breaking(room.camera, 40, interrupt), player, room.clock, nothing)
    assert 5 < len(player.called_ns) < 40
    assert room.light_from_now() == 0.0
    assert not players()


@pytest.mark.parametrize("is_stepped", [True, False])
def test_a_display_that_is_lost_is_told_and_leaves_no_thread(is_stepped: bool) -> None:
    room = Room(is_stepped=is_stepped)
    camera = Breaking(room.camera, 30, room.display.close)
    with pytest.raises(DeviceLost, match="display"):
        record_code(camera, player_of(room, 20.0), room.clock, nothing)
    assert not players()


def test_a_camera_that_falls_silent_or_is_unplugged_is_told() -> None:
    for kind, error in ((FaultKind.DROP, DeviceTimeout), (FaultKind.UNPLUG, DeviceLost)):
        room = Room(Fault(kind, 2.0, 3600.0))
        with pytest.raises(error):
            record_code(room.camera, player_of(room, 20.0), room.clock, nothing)
        assert room.light_from_now() == 0.0


def test_a_player_that_stands_still_leaves_darkness() -> None:
    room = Room()
    player = player_of(room, 20.0)
    player.begin()
    while len(player.called_ns) < 3:
        player.play(room.clock.now_ns() + MS)
        room.clock.wait_until_ns(room.clock.now_ns() + MS)
    room.clock.wait_until_ns(room.clock.now_ns() + 400 * MS)
    assert room.light_from_now() == 0.0
