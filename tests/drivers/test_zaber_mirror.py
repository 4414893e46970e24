"""The Zaber driver on simulated firmware: where it says the mirror stands, and when it will not."""

import random
import threading
import time
from collections.abc import Callable

import pytest

from drivers import zaber_warnings
from drivers.zaber_line import Reply, compute_checksum
from drivers.zaber_mirror import ZaberMirror
from navapp.errors import (
    DeviceError,
    DeviceLost,
    DeviceNotFound,
    DeviceProtocolError,
    DeviceTimeout,
    UnsupportedControl,
    WrongDevice,
)
from sim_devices.firmware import wire
from sim_devices.firmware.memory_port import MemoryAddress
from sim_devices.firmware.stage_motion import StageModel
from tests.drivers.firmware_rigs import STAGE_SERIAL, StageRig, mirror_at, stage_terminal

pytestmark = pytest.mark.waits

# Of the public test-suites of other implementations.
CHECKSUMS = {"01 0 OK IDLE -- 0": "8D", "01 0 OK IDLE -- 7z": "0C", "1 3 9 OK IDLE -- 0": "61",
             "1 0 foo 2": "C9"}  # fmt: skip


def homed(model: StageModel | None = None) -> StageRig:
    return StageRig(model).homed()


def at_45() -> StageRig:
    rig = homed()
    rig.driver.move_to(45.0, 30.0)
    return rig


@pytest.mark.parametrize(("text", "expected"), CHECKSUMS.items())
def test_checksums_are_those_of_others(text, expected) -> None:
    assert compute_checksum(text) == expected


def test_it_homes_and_goes_where_it_is_sent() -> None:
    rig = homed()
    assert rig.driver.position_deg() == 0.0
    for angle_deg in (45.0, 12.5, 120.0, 0.0):
        rig.driver.move_to(angle_deg, 30.0)
        assert rig.driver.position_deg() == pytest.approx(angle_deg, abs=0.001)
        assert rig.firmware.true_deg == pytest.approx(angle_deg, abs=0.001)


def test_relative_moves_keep_the_range() -> None:
    rig = at_45()
    rig.driver.move_by(-5.0, 30.0)
    assert rig.driver.position_deg() == pytest.approx(40.0, abs=0.001)
    with pytest.raises(UnsupportedControl, match="cannot be moved to 130 deg"):
        rig.driver.move_by(90.0, 30.0)
    with pytest.raises(UnsupportedControl, match="by 400 deg"):
        rig.driver.move_by(400.0, 30.0)
    assert rig.firmware.true_deg == pytest.approx(40.0, abs=0.001)


def test_a_relative_move_without_reference_moves_but_tells_no_place() -> None:
    rig = StageRig()
    rig.driver.open()
    before_deg = rig.firmware.true_deg
    with pytest.raises(DeviceError, match=r"no reference position \(WR\)"):
        rig.driver.move_by(3.0, 30.0)
    assert rig.firmware.true_deg == pytest.approx(before_deg + 3.0, abs=0.001)
    assert rig.driver.position_deg() is None


def test_an_absolute_move_before_homing_is_not_even_sent() -> None:
    rig = StageRig()
    rig.driver.open()
    before_deg = rig.firmware.true_deg
    with pytest.raises(UnsupportedControl, match="no reference position: home it first"):
        rig.driver.move_to(45.0, 30.0)
    rig.clock.advance_ns(10**10)
    assert rig.firmware.true_deg == before_deg


def test_it_is_still_homed_when_only_the_program_was_away() -> None:
    rig = at_45()
    rig.driver.close()
    rig.driver.open()
    assert rig.driver.position_deg() == pytest.approx(45.0, abs=0.001)


def test_a_stall_is_named_and_costs_the_reference() -> None:
    rig = homed()
    rig.firmware.stalls_at = 0.5
    with pytest.raises(DeviceError, match=r"moving the mirror failed: stalled and stopped \(FS\)"):
        rig.driver.move_to(45.0, 30.0)
    assert rig.driver.position_deg() is None
    with pytest.raises(UnsupportedControl, match="home it first"):
        rig.driver.move_to(45.0, 30.0)
    rig.driver.home(30.0)
    rig.driver.move_to(45.0, 30.0)
    assert rig.driver.position_deg() == pytest.approx(45.0, abs=0.001)


def miscounting() -> StageRig:
    """At 67.5 deg, stalled on its way to 90; it counted all its steps."""
    rig = at_45()
    stall = rig.firmware._stall

    def stalled() -> None:
        stall()
        rig.firmware._zero -= 24_000.0

    rig.firmware._stall = stalled
    rig.firmware.stalls_at = 0.5
    with pytest.raises(DeviceError, match=r"\(FS\)"):
        rig.driver.move_to(90.0, 30.0)
    assert int(rig.firmware._get("pos", "1")[1]) == 96_000
    assert rig.firmware.true_deg == pytest.approx(67.5, abs=0.001)
    return rig


def test_a_reopening_does_not_bring_the_reference_back() -> None:
    rig = miscounting()
    rig.firmware.flags.clear()
    rig.driver.close()
    rig.driver.open()
    assert rig.driver.position_deg() is None
    with pytest.raises(UnsupportedControl, match="home it first"):
        rig.driver.move_to(45.0, 30.0)
    rig.driver.home(30.0)
    assert rig.driver.position_deg() == 0.0
    assert rig.firmware.true_deg == 0.0


def test_a_reopening_does_not_forget_an_interruption() -> None:
    rig = at_45()
    rig.firmware.turn_by_hand(1.0)
    assert rig.driver.position_deg() is None
    rig.clock.advance_ns(10**9)
    rig.firmware.flags.clear()
    rig.driver.close()
    rig.driver.open()
    assert rig.driver.position_deg() is None


@pytest.mark.parametrize(
    "motion", [lambda driver: driver.home(30.0), lambda driver: driver.move_by(1.0, 30.0)]
)
def test_a_motion_that_is_refused_leaves_the_device_its_flags(motion) -> None:
    """Another program, which knows nothing else, must see them."""
    rig = miscounting()
    rig.firmware.rejections = ["PARKED"]
    with pytest.raises(UnsupportedControl, match="it is parked"):
        motion(rig.driver)
    assert "FS" in rig.firmware.flags
    rig.driver.close()
    other = ZaberMirror(MemoryAddress(rig.wire), rig.clock, STAGE_SERIAL)
    other.open()
    assert other.position_deg() is None


def test_homing_clears_what_only_a_command_clears() -> None:
    rig = at_45()
    rig.firmware._forget = lambda: None
    rig.firmware.flags.add("NC")
    rig.driver.home(30.0)
    assert rig.driver.position_deg() == 0.0


def test_a_home_that_is_not_at_zero_is_not_believed() -> None:
    rig = at_45()
    rig.firmware._set_off = lambda end, at_end=None: None
    with pytest.raises(DeviceProtocolError, match="counts 48000 steps at its home position"):
        rig.driver.home(30.0)
    assert rig.driver.position_deg() is None


def test_a_stall_while_homing_is_named() -> None:
    rig = StageRig()
    rig.driver.open()
    rig.firmware.stalls_at = 0.5
    with pytest.raises(DeviceError, match=r"homing the mirror failed: stalled .*\(FS\).*\(WR\)"):
        rig.driver.home(30.0)
    assert rig.driver.position_deg() is None


def test_a_mirror_turned_by_hand_has_no_place_until_it_is_sent_again() -> None:
    rig = at_45()
    rig.firmware.turn_by_hand(2.0)
    assert rig.driver.position_deg() is None
    with pytest.raises(UnsupportedControl, match="is moving"):
        rig.driver.move_to(45.0, 30.0)
    rig.clock.advance_ns(10**9)
    assert rig.driver.position_deg() is None, "it stands, but not where it was sent"
    rig.firmware.flags.clear()
    assert rig.driver.position_deg() is None, "somebody else cleared the flag"
    rig.driver.move_to(45.0, 30.0)
    assert rig.driver.position_deg() == pytest.approx(45.0, abs=0.001)


def test_a_pushed_mirror_must_be_homed_again() -> None:
    rig = at_45()
    rig.firmware.push(1.0)
    assert rig.driver.position_deg() is None
    with pytest.raises(UnsupportedControl, match="home it first"):
        rig.driver.move_to(45.0, 30.0)


@pytest.mark.parametrize("flag", [f for f in zaber_warnings.NAMES if f not in ("ND", "NR")])
def test_each_flag_means_a_place_or_none(flag) -> None:
    rig = at_45()
    if flag == "NB":
        rig.firmware._worst = lambda: "NB"
    rig.firmware.flags.add(flag)
    is_known = rig.driver.position_deg() is not None
    assert is_known == (flag in ("WV", "WT", "WP", "ND", "NR", "NT", "NU"))


def test_a_flag_behind_a_more_urgent_one_is_seen() -> None:
    """WT alone would be harmless; WR is hidden behind it."""
    rig = at_45()
    rig.firmware.flags |= {"WT", "WR"}
    assert rig.driver.position_deg() is None
    with pytest.raises(UnsupportedControl, match="home it first"):
        rig.driver.move_to(45.0, 30.0)


def test_an_alert_between_two_replies_counts() -> None:
    rig = at_45()
    alert = f"!01 1 IDLE WM:{compute_checksum('01 1 IDLE WM')}\r\n".encode()
    rig.wire.spoiler = wire.first(1, wire.precede_by(alert))
    assert rig.driver.position_deg() is None


def test_an_alert_of_another_axis_does_not() -> None:
    rig = at_45()
    alert = f"!02 1 IDLE WM:{compute_checksum('02 1 IDLE WM')}\r\n".encode()
    rig.wire.spoiler = wire.precede_by(alert)
    assert rig.driver.position_deg() == pytest.approx(45.0, abs=0.001)


@pytest.mark.parametrize(
    ("word", "text"),
    [
        ("BADDATA", "the value is out of its range"),
        ("PARKED", "it is parked"),
        ("DRIVERDISABLED", "its motor driver is off"),
        ("WHATEVER", "for an unknown reason"),
    ],
)
def test_a_rejection_is_named(word, text) -> None:
    rig = homed()
    rig.firmware.rejections = [word]
    with pytest.raises(UnsupportedControl, match=rf"rejects 'move abs 48000': {text} \({word}\)"):
        rig.driver.move_to(45.0, 30.0)


@pytest.mark.parametrize("word", ["AGAIN", "STATUSBUSY", "FULL"])
def test_a_rejection_for_now_is_tried_again(word) -> None:
    rig = homed()
    rig.firmware.rejections = [word] * 5
    rig.driver.move_to(45.0, 30.0)
    assert rig.driver.position_deg() == pytest.approx(45.0, abs=0.001)
    rig.firmware.rejections = [word] * 1000
    begin_s = rig.now_s
    with pytest.raises(UnsupportedControl, match=word):
        rig.driver.move_to(40.0, 30.0)
    assert rig.now_s - begin_s < 4.0


def test_a_motion_that_takes_too_long_is_stopped() -> None:
    rig = homed()
    rig.firmware.model.speed /= 10.0
    with pytest.raises(DeviceTimeout, match=r"still moving after 2\.6 s and was stopped"):
        rig.driver.move_to(10.0, 30.0)
    rig.clock.advance_ns(10**9)
    assert not rig.firmware.is_busy
    assert 0.0 < rig.firmware.true_deg < 10.0
    assert rig.driver.position_deg() is None
    rig.firmware.model.speed *= 10.0
    rig.driver.move_to(10.0, 30.0)
    assert rig.driver.position_deg() == pytest.approx(10.0, abs=0.001)


def after(rig: StageRig, words: str, deed: Callable[[], object]) -> None:
    """Do something whenever those words were answered."""
    ask = rig.driver._talk.ask

    def asked(command: str, **more: bool) -> Reply:
        reply = ask(command, **more)
        if command.startswith(words):
            deed()
        return reply

    rig.driver._talk.ask = asked


@pytest.mark.parametrize("words", ["get pos", "warnings clear", "move abs"])
def test_a_stop_before_the_command_is_accepted_lets_nothing_move(words) -> None:
    rig = at_45()
    rig.firmware.rejections = ["AGAIN"]
    after(rig, words, rig.driver.stop)
    with pytest.raises(DeviceError, match="was stopped while moving"):
        rig.driver.move_to(10.0, 30.0)
    rig.clock.advance_ns(10**10)
    assert rig.firmware.true_deg == pytest.approx(45.0, abs=0.001)
    assert rig.driver.position_deg() is None


@pytest.mark.parametrize("words", ["get system.serial", "home"])
def test_a_stop_before_homing_is_accepted_lets_nothing_move(words) -> None:
    rig = at_45()
    rig.firmware.rejections = ["FULL"]
    after(rig, words, rig.driver.stop)
    with pytest.raises(DeviceError, match="was stopped while finding its home position"):
        rig.driver.home(30.0)
    rig.clock.advance_ns(10**10)
    assert rig.firmware.true_deg == pytest.approx(45.0, abs=0.001)
    assert rig.driver.position_deg() is None


@pytest.mark.parametrize("from_deg", [0.0, 20.0], ids=["at its beginning", "on its way"])
def test_a_motion_that_cannot_be_followed_is_stopped(from_deg) -> None:
    rig = homed()
    rig.wire.spoiler = lambda message: (
        [] if rig.firmware.is_busy and rig.firmware.true_deg >= from_deg else wire.whole(message)
    )
    with pytest.raises(DeviceTimeout, match="does not answer"):
        rig.driver.move_to(110.0, 30.0)
    rig.clock.advance_ns(10**10)
    assert from_deg <= rig.firmware.true_deg < 80.0
    assert rig.driver.position_deg() is None


def test_a_bug_in_following_a_motion_stops_it_as_well() -> None:
    rig = homed()

    def fail_on_the_way() -> None:
        if rig.firmware.true_deg > 20.0:
            raise RuntimeError("a bug")

    ask = rig.driver._talk.ask
    after(rig, "", fail_on_the_way)
    with pytest.raises(RuntimeError):
        rig.driver.move_to(110.0, 30.0)
    rig.driver._talk.ask = ask
    rig.clock.advance_ns(10**10)
    assert 20.0 < rig.firmware.true_deg < 80.0
    assert rig.driver.position_deg() is None


def test_a_device_that_says_idle_without_being_there_is_not_believed() -> None:
    rig = homed()
    rig.firmware._set_off = lambda end, at_end=None: None
    with pytest.raises(DeviceProtocolError, match=r"stands at 0\.000 deg, sent to 45"):
        rig.driver.move_to(45.0, 30.0)
    assert rig.driver.position_deg() is None


def test_loss_of_power_is_silence_and_costs_the_reference() -> None:
    rig = at_45()
    rig.firmware.lose_power()
    begin_s = rig.now_s
    with pytest.raises(DeviceTimeout, match="does not answer"):
        rig.driver.position_deg()
    assert rig.now_s - begin_s < 1.5
    rig.firmware.restore_power()
    assert rig.driver.position_deg() is None
    rig.driver.home(30.0)
    assert rig.driver.position_deg() == 0.0


def test_power_lost_in_a_motion_is_told() -> None:
    rig = homed()
    rig.wire.command_spoiler = lambda data: b"" if rig.firmware.true_deg > 20.0 else data
    with pytest.raises(DeviceTimeout, match="does not answer"):
        rig.driver.move_to(45.0, 30.0)


def test_another_mount_is_refused_at_opening_and_before_homing() -> None:
    rig = StageRig(serial="1")
    with pytest.raises(WrongDevice, match=f"serial number {STAGE_SERIAL}, the rig's is 1"):
        rig.driver.open()
    with pytest.raises(DeviceLost):
        rig.driver.position_deg()
    rig = homed()
    rig.firmware.lose_power()
    rig.firmware.model.serial = 7
    rig.firmware.restore_power()
    with pytest.raises(WrongDevice, match="serial number 7"):
        rig.driver.home(30.0)


def test_without_a_configured_serial_number_it_is_bound_to_the_first_one() -> None:
    rig = StageRig(serial="").homed()
    assert rig.driver.info.serial == STAGE_SERIAL
    rig.driver.close()
    rig.firmware.model.serial = 7
    with pytest.raises(WrongDevice, match=f"number 7, the session's is {STAGE_SERIAL}"):
        rig.driver.open()
    rig.firmware.model.serial = int(STAGE_SERIAL)
    rig.driver.open()
    assert rig.driver.position_deg() == 0.0


def test_a_pulled_plug_is_lost_and_opening_brings_it_back() -> None:
    rig = at_45()
    rig.wire.is_connected = False
    with pytest.raises(DeviceLost):
        rig.driver.position_deg()
    rig.driver.close()
    with pytest.raises(DeviceNotFound):
        rig.driver.open()
    rig.wire.is_connected = True
    rig.driver.open()
    assert rig.driver.position_deg() == pytest.approx(45.0, abs=0.001)


def test_a_stage_that_is_no_rotary_one_is_refused() -> None:
    with pytest.raises(DeviceProtocolError, match="check that it is a rotary stage"):
        StageRig(StageModel(steps_per_turn=0)).driver.open()


@pytest.mark.parametrize("axis", [(2, 1), (1, 2)])
def test_a_wrong_number_on_the_line_is_silence_or_a_rejection(axis) -> None:
    rig = StageRig()
    rig.driver._talk._device, rig.driver._talk._axis = axis
    with pytest.raises((DeviceTimeout, UnsupportedControl), match=r"does not answer|no such axis"):
        rig.driver.open()


ALWAYS = {
    "split": wire.split(0.001),
    "late": wire.late(0.2),
    "doubled": wire.double,
    "noise": wire.precede_by(b"\x00\xff@01\r\n"),
    "noise without end": wire.precede_by(b"\x00#!@\xff"),
    "info": wire.precede_by(b"#01 0 hello\r\n"),
}


@pytest.mark.parametrize("spoiler", ALWAYS.values(), ids=ALWAYS)
def test_a_line_that_is_always_spoilt_in_this_way_still_works(spoiler) -> None:
    rig = StageRig()
    rig.wire.spoiler = spoiler
    rig.driver.open()
    rig.driver.home(30.0)
    rig.driver.move_to(45.0, 30.0)
    assert rig.driver.position_deg() == pytest.approx(45.0, abs=0.001)


SOMETIMES = {
    "lost": wire.lose,
    "too late": wire.late(0.7),
    "corrupted": wire.corrupt(random.Random(3)),
    "garbage": lambda message: wire.whole(b"\x80\x81\r\n"),
}


@pytest.mark.parametrize("spoiler", SOMETIMES.values(), ids=SOMETIMES)
def test_one_spoilt_reply_is_asked_for_again(spoiler) -> None:
    rig = at_45()
    rig.wire.spoiler = wire.first(1, spoiler)
    assert rig.driver.position_deg() == pytest.approx(45.0, abs=0.001)


def test_every_single_turned_bit_is_noticed() -> None:
    """Once checksums were seen, a reply counts only with the right one."""
    rig = at_45()
    for bit in range(8 * 25):

        def turned(message: bytes, bit: int = bit) -> wire.Pieces:
            changed = bytearray(message)
            changed[bit // 8 % len(changed)] ^= 1 << bit % 8
            return wire.whole(bytes(changed))

        rig.wire.spoiler = wire.first(1, turned)
        assert rig.driver.position_deg() == pytest.approx(45.0, abs=0.001)


def test_a_device_without_checksums_and_alerts_still_works() -> None:
    rig = StageRig()
    do = rig.firmware._do
    rig.firmware._do = lambda words, axis: (
        (False, "BADCOMMAND") if words[:1] == ["set"] else do(words, axis)
    )
    rig.driver.open()
    rig.driver.home(30.0)
    rig.driver.move_to(45.0, 30.0)
    assert rig.driver.position_deg() == pytest.approx(45.0, abs=0.001)


def test_readings_that_differ_are_no_position() -> None:
    rig = at_45()
    get = rig.firmware._get
    places = iter(range(1000))
    rig.firmware._get = lambda name, axis: (
        (True, str(next(places))) if name == "pos" else get(name, axis)
    )
    with pytest.raises(DeviceProtocolError, match="0, 1 and 2 steps at rest"):
        rig.driver.position_deg()


def test_stopping_from_another_thread_ends_a_motion(tmp_path) -> None:
    with stage_terminal(tmp_path, speed=1.0) as terminal:
        mirror = mirror_at(terminal)
        mirror.open()
        mirror.home(30.0)
        stopper = threading.Timer(0.3, mirror.stop)
        stopper.start()
        begin_s = time.monotonic()
        with pytest.raises(DeviceError, match="was stopped while moving"):
            mirror.move_to(110.0, 30.0)
        assert time.monotonic() - begin_s < 1.5
        assert mirror.position_deg() is None
        stopper.join()
        mirror.close()


def test_a_pulled_plug_in_a_motion_is_lost_at_once(tmp_path) -> None:
    with stage_terminal(tmp_path, speed=1.0) as terminal:
        mirror = mirror_at(terminal)
        mirror.open()
        mirror.home(30.0)
        puller = threading.Timer(0.3, terminal.unplug)
        puller.start()
        begin_s = time.monotonic()
        with pytest.raises(DeviceLost, match="is gone"):
            mirror.move_to(110.0, 30.0)
        assert time.monotonic() - begin_s < 1.5
        puller.join()
        mirror.close()
