"""The ESC/VP21 driver on simulated firmware: what it says, and when it says that it is sure."""

import random
from itertools import pairwise

import pytest

from drivers.clock import ManualClock
from drivers.escvp21_projector import SILENT, EscVp21Projector
from drivers.interfaces import CommandResult, PowerState
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
from sim_devices.firmware.escvp21 import Power, ProjectorFirmware, ProjectorModel
from sim_devices.firmware.escvpnet import NetworkedProjectorFirmware
from sim_devices.firmware.memory_port import MemoryAddress
from sim_devices.firmware.wire import Wire
from tests.drivers.firmware_rigs import SERIAL, ProjectorRig

VERIFIED, FINISHED, ACCEPTED = (
    CommandResult.VERIFIED, CommandResult.FINISHED, CommandResult.ACCEPTED,
)  # fmt: skip


def opened(model: ProjectorModel | None = None, serial: str = SERIAL) -> ProjectorRig:
    rig = ProjectorRig(model, serial)
    rig.driver.open()
    return rig


def lit(model: ProjectorModel | None = None) -> ProjectorRig:
    return ProjectorRig(model).lit()


@pytest.mark.parametrize("is_quick", [False, True])
@pytest.mark.parametrize(("n_failing", "burns_s"), [(0, 40.0), (1, 70.0), (2, 100.0)])
def test_a_lamp_that_catches_late_is_waited_for(is_quick, n_failing, burns_s) -> None:
    rig = opened(ProjectorModel(is_quick=is_quick, n_failing=n_failing))
    begin_s = rig.now_s
    assert rig.driver.set_power(True, 150.0) is VERIFIED
    assert burns_s <= rig.now_s - begin_s < burns_s + 3.0
    assert rig.driver.status().power is PowerState.ON


def test_a_lamp_that_does_not_catch_is_silence_and_told_as_abnormal() -> None:
    rig = opened(ProjectorModel(n_failing=3))
    with pytest.raises(DeviceTimeout, match="does not answer"):
        rig.driver.set_power(True, 150.0)
    status = rig.driver.status()
    assert status.power is PowerState.FAULT
    assert status.faults == (SILENT,)
    # After its pause it takes the command again, and tells its faults.
    rig.firmware.model.n_failing = 0
    rig.clock.advance_ns(130 * 10**9)
    assert rig.driver.status().power is PowerState.FAULT
    with pytest.raises(DeviceTimeout):
        rig.driver.set_power(True, 150.0)


@pytest.mark.parametrize("question", ["PWR?", "ERR?", "SOURCE?", "FREEZE?"])
def test_one_that_breaks_down_while_it_is_read_is_told_as_silent(monkeypatch, question) -> None:
    rig = lit()
    handle = rig.firmware._handle

    def handle_until_broken(command: str) -> None:
        if command == question:
            rig.firmware.break_down(0x04)
        else:
            handle(command)

    monkeypatch.setattr(rig.firmware, "_handle", handle_until_broken)
    status = rig.driver.status()
    assert status.power is PowerState.FAULT
    assert status.faults == (SILENT,)


def test_a_quick_model_is_accepted_long_before_it_is_on() -> None:
    rig = opened(ProjectorModel(is_quick=True))
    assert rig.driver.set_power(True, 5.0) is ACCEPTED
    assert rig.driver.status().power is PowerState.WARMING
    rig.clock.advance_ns(40 * 10**9)
    assert rig.driver.set_power(True, 5.0) is VERIFIED


def test_a_slow_model_gives_no_colon_in_that_time_and_comes_back_into_step() -> None:
    rig = opened()
    with pytest.raises(DeviceTimeout):
        rig.driver.set_power(True, 5.0)
    rig.clock.advance_ns(40 * 10**9)
    assert rig.driver.status().power is PowerState.ON
    assert rig.driver.set_mute(True, 3.0) is VERIFIED


def test_a_cooling_lamp_is_waited_for_before_it_is_lit_again() -> None:
    rig = lit(ProjectorModel(is_quick=True))
    assert rig.driver.set_power(False, 5.0) is FINISHED
    assert rig.driver.status().power is PowerState.COOLING
    with pytest.raises(DeviceTimeout, match="still cooling"):
        rig.driver.set_power(True, 5.0)
    assert rig.firmware.power is Power.COOLING
    assert rig.driver.set_power(True, 150.0) is VERIFIED


def test_nothing_is_verified_before_the_serial_number_was_read() -> None:
    rig = opened()
    value = rig.firmware._value
    rig.firmware._value = lambda name: None if name == "SNO" else value(name)
    assert rig.driver.set_power(True, 150.0) is FINISHED
    assert rig.driver.set_mute(True, 3.0) is FINISHED
    assert rig.firmware.model.settings["MUTE"] == "ON"
    assert rig.driver.set_power(False, 150.0) is FINISHED
    assert rig.firmware.power is Power.STANDBY


def test_a_lamp_that_is_out_proves_nothing_of_whose_it_is() -> None:
    rig = opened()
    assert rig.driver.set_power(False, 150.0) is FINISHED
    rig.driver.set_power(True, 150.0)
    assert rig.driver.set_power(False, 150.0) is VERIFIED
    rig.driver.status()
    assert rig.driver.set_power(False, 150.0) is FINISHED, "it may have been swapped since"


def test_a_stranger_is_not_switched_off() -> None:
    rig = lit()
    rig.firmware.model.serial = "OTHER"
    with pytest.raises(WrongDevice, match="OTHER"):
        rig.driver.set_power(False, 150.0)
    rig.clock.advance_ns(10**11)
    assert rig.firmware.power is Power.ON


@pytest.mark.parametrize("serial", [SERIAL, ""])
def test_without_a_configured_serial_number_nothing_is_proven_either(serial) -> None:
    """The lamp is out, so that not even the first number can be read."""
    assert opened(serial=serial).driver.set_power(False, 150.0) is FINISHED


@pytest.mark.parametrize(
    ("setting", "command"),
    [
        ("SOURCE", lambda driver: driver.set_source("A0", 5.0)),
        ("MUTE", lambda driver: driver.set_mute(True, 3.0)),
        ("HREVERSE", lambda driver: driver.set_flips(True, False, 3.0)),
        ("VREVERSE", lambda driver: driver.set_flips(False, True, 3.0)),
    ],
)
class TestThreeResults:
    """Of a setting that is executed; cannot be read back; is ignored."""

    def test_verified(self, setting, command) -> None:
        rig = lit()
        assert command(rig.driver) is VERIFIED
        assert rig.firmware.model.settings[setting] in ("A0", "ON")

    def test_finished(self, setting, command) -> None:
        rig = lit()
        value = rig.firmware._value
        rig.firmware._value = lambda name: None if name == setting else value(name)
        assert command(rig.driver) is FINISHED

    def test_accepted(self, setting, command) -> None:
        rig = lit()
        rig.firmware._as_kept = lambda name, parameter: rig.firmware.model.settings[name]
        begin_s = rig.now_s
        assert command(rig.driver) is ACCEPTED
        assert rig.now_s - begin_s < 6.0

    def test_one_reading_alone_proves_nothing(self, setting, command) -> None:
        """The first reading is spoilt so that it looks right."""
        rig = lit()
        rig.firmware._as_kept = lambda name, parameter: rig.firmware.model.settings[name]
        lies = [b"SOURCE=A0\r:" if setting == "SOURCE" else f"{setting}=ON\r:".encode()]

        def lie(message: bytes) -> wire.Pieces:
            is_reading = message.startswith(setting.encode())
            return wire.whole(lies.pop() if is_reading and lies else message)

        rig.wire.spoiler = lie
        assert command(rig.driver) is ACCEPTED
        assert not lies

    def test_refused_in_standby(self, setting, command) -> None:
        rig = opened()
        with pytest.raises(UnsupportedControl, match="the projector refuses '"):
            command(rig.driver)


@pytest.mark.parametrize("source", ["no such source", "3", "30\rPWR OFF", "", "3g"])
def test_what_is_no_source_is_not_even_sent(source) -> None:
    rig = lit()
    with pytest.raises(UnsupportedControl, match="two hexadecimal digits"):
        rig.driver.set_source(source, 5.0)
    assert rig.firmware.power is Power.ON


def test_a_source_that_it_lacks_is_refused() -> None:
    with pytest.raises(UnsupportedControl, match="refuses 'SOURCE 77'"):
        lit().driver.set_source("77", 5.0)


def test_everything_is_read_back() -> None:
    rig = lit(ProjectorModel(hours=(1633, 20)))
    rig.firmware.model.settings |= {"HREVERSE": "ON", "VKEYSTONE": "130", "FREEZE": "ON"}
    status = rig.driver.status()
    assert status.power is PowerState.ON
    assert (status.source, status.is_muted) == ("30", False)
    assert (status.flips_horizontally, status.flips_vertically) == (True, False)
    assert (status.keystone, status.is_frozen) == ((126, 130), True)
    assert (status.lamp_hours, status.serial, status.faults) == ((1633, 20), SERIAL, ())


@pytest.mark.parametrize(
    ("code", "name"), [(0x0A, "auto iris"), (0x10, "cooling element"), (0x7F, "fault 7F")]
)
def test_fault_codes_are_hexadecimal_and_have_names(code, name) -> None:
    rig = lit()
    rig.firmware.model.fault = code
    assert rig.driver.status().faults == (name,)


@pytest.mark.parametrize("code", ["05", "06", "FF"])
def test_a_power_state_that_is_not_known_is_a_fault(code) -> None:
    rig = opened()
    value = rig.firmware._value
    rig.firmware._value = lambda name: code if name == "PWR" else value(name)
    status = rig.driver.status()
    assert status.power is PowerState.FAULT
    assert status.faults == (f"power state {code}",)


def test_another_projector_is_refused_when_it_can_say_who_it_is() -> None:
    rig = opened(serial="THE-RIGS")
    with pytest.raises(WrongDevice, match=f"has serial number {SERIAL}, the rig's is THE-RIGS"):
        rig.driver.set_power(True, 150.0)
    with pytest.raises(WrongDevice):
        rig.driver.open()
    with pytest.raises(DeviceLost):
        rig.driver.status()


def test_a_projector_swapped_while_it_was_off_is_refused() -> None:
    rig = lit()
    rig.firmware.lose_mains()
    rig.firmware.model.serial = "OTHER"
    rig.firmware.restore_mains()
    assert rig.driver.status().power is PowerState.STANDBY
    with pytest.raises(WrongDevice, match="OTHER"):
        rig.driver.set_power(True, 150.0)


def test_without_a_configured_serial_number_it_is_bound_to_the_first_one() -> None:
    rig = opened(serial="")
    assert "memory" in rig.driver.name
    rig.driver.set_power(True, 150.0)
    assert rig.driver.name.endswith(SERIAL)
    rig.wire.is_connected = False
    with pytest.raises(DeviceLost):
        rig.driver.status()
    rig.firmware.model.serial = "OTHER"
    rig.wire.is_connected = True
    with pytest.raises(WrongDevice, match=f"number OTHER, the session's is {SERIAL}"):
        rig.driver.open()
    rig.firmware.model.serial = SERIAL
    rig.driver.open()
    assert rig.driver.status().serial == SERIAL


@pytest.mark.parametrize("serial", [SERIAL, ""])
def test_a_serial_number_that_was_misread_neither_binds_nor_ends_a_session(serial) -> None:
    rig = opened(serial=serial)
    lies = ["SIM1200133", "SIM1200122"]

    def lie(message: bytes) -> wire.Pieces:
        is_serial = message.startswith(b"SNO=")
        return wire.whole(f"SNO={lies.pop()}\r:".encode() if is_serial and lies else message)

    rig.wire.spoiler = lie
    rig.driver.set_power(True, 150.0)
    assert not lies
    assert rig.driver.set_mute(True, 3.0) is VERIFIED
    assert rig.driver.status().serial == SERIAL


def test_loss_of_mains_is_silence_and_it_comes_back_by_itself() -> None:
    rig = lit()
    rig.firmware.lose_mains()
    status = rig.driver.status()
    assert (status.power, status.faults) == (PowerState.FAULT, (SILENT,))
    begin_s = rig.now_s
    rig.driver.status()
    assert rig.now_s - begin_s < 4.0, "one that is known to be silent is probed once"
    with pytest.raises(DeviceTimeout):
        rig.driver.set_mute(True, 3.0)
    rig.firmware.restore_mains()
    assert rig.driver.status().power is PowerState.STANDBY


def test_a_silent_projector_is_not_opened() -> None:
    rig = ProjectorRig()
    rig.firmware.break_down(fault=0x04)
    with pytest.raises(DeviceTimeout, match="does not answer"):
        rig.driver.open()
    with pytest.raises(DeviceLost):
        rig.driver.status()


def test_a_pulled_plug_is_lost_and_opening_brings_it_back() -> None:
    rig = lit()
    rig.wire.is_connected = False
    with pytest.raises(DeviceLost):
        rig.driver.status()
    with pytest.raises(DeviceNotFound):
        rig.driver.open()
    rig.wire.is_connected = True
    rig.driver.open()
    assert rig.driver.status().power is PowerState.ON


ONE_FAULT = {
    "split": wire.split(0.002),
    "late": wire.late(2.0),
    "doubled": wire.double,
    "noise": wire.precede_by(b"\x00\xffIMEV\r:"),
    "an event": wire.precede_by(b"IMEVENT=0001 02 00000000 00000000 T1 F1\r:"),
    "other answer": wire.precede_by(b"LAMP=1\r:"),
}


@pytest.mark.parametrize("spoiler", ONE_FAULT.values(), ids=ONE_FAULT)
def test_a_line_that_is_always_spoilt_in_this_way_still_works(spoiler) -> None:
    rig = ProjectorRig(ProjectorModel(is_quick=True))
    rig.wire.spoiler = spoiler
    rig.driver.open()
    assert rig.driver.set_power(True, 150.0) is VERIFIED
    assert rig.driver.set_mute(True, 5.0) is VERIFIED
    assert rig.driver.status().is_muted is True


SOMETIMES = {
    "lost": wire.lose,
    "too late": wire.late(3.5),
    "corrupted": wire.corrupt(random.Random(3)),
    "garbage": lambda message: wire.whole(b"\x80\x81:"),
}


@pytest.mark.parametrize("spoiler", SOMETIMES.values(), ids=SOMETIMES)
def test_one_spoilt_answer_is_asked_for_again(spoiler) -> None:
    rig = lit()
    rig.wire.spoiler = wire.first(1, spoiler)
    assert rig.driver.status().power is PowerState.ON
    assert rig.driver.set_mute(True, 3.0) is VERIFIED


def test_nothing_but_garbage_is_a_protocol_error_and_passes() -> None:
    rig = lit()
    rig.wire.spoiler = lambda message: wire.whole(b"\x80\x81:")
    with pytest.raises((DeviceProtocolError, DeviceTimeout)):
        rig.driver.set_mute(True, 3.0)
    rig.wire.spoiler = wire.whole
    assert rig.driver.status().is_muted is False, "who does not say who it is, is told nothing"
    assert rig.driver.set_mute(True, 3.0) is VERIFIED


def test_noise_after_plugging_in_does_no_harm() -> None:
    rig = ProjectorRig()
    rig.wire.say(b"\xff\xff\x00PWR=\r:")
    rig.driver.open()
    assert rig.driver.status().power is PowerState.STANDBY


def test_events_in_the_wait_for_the_lamp_are_not_taken_for_its_answer() -> None:
    rig = opened(ProjectorModel(has_events=True))
    begin_s = rig.now_s
    assert rig.driver.set_power(True, 150.0) is VERIFIED
    assert rig.now_s - begin_s >= 40.0


def test_events_without_end_are_no_answer() -> None:
    rig = lit()
    event = b"IMEVENT=0001 03 00000000 00000000 T1 F1\r:"
    rig.wire.spoiler = lambda message: [(1000, event)] * 70
    status = rig.driver.status()
    assert (status.power, status.faults) == (PowerState.FAULT, (SILENT,))


@pytest.mark.parametrize(
    "use", [lambda driver: driver.status(), lambda driver: driver.set_mute(True, 3.0)]
)
def test_answers_to_nobodys_question_without_end_hold_nobody_up(use) -> None:
    """They follow each other as fast as 9600 baud can carry them."""
    rig = lit()
    stranger = b"LAMP=1\r:"
    babble = wire.first(1, lambda message: [(8_000_000, stranger)] * 20_000)
    rig.wire.spoiler = lambda message: wire.whole(message) if b"SNO" in message else babble(message)
    begin_s = rig.now_s
    with pytest.raises(DeviceError):
        use(rig.driver)
    assert rig.now_s - begin_s < 20.0


def test_a_full_reading_takes_a_second_and_a_half() -> None:
    rig = lit()
    begin_s = rig.now_s
    rig.driver.status()
    assert 1.3 < rig.now_s - begin_s < 1.6


def test_a_tenth_of_a_second_passes_between_colon_and_command() -> None:
    rig = lit()
    moments_s = []

    def noted(data: bytes) -> bytes:
        moments_s.append(rig.now_s)
        return data

    rig.wire.command_spoiler = noted
    rig.driver.status()
    gaps_s = [after - before for before, after in pairwise(moments_s)]
    assert len(gaps_s) > 8
    assert min(gaps_s) >= 0.1


def networked(*, wants_password: bool) -> tuple[EscVp21Projector, Wire]:
    clock = ManualClock(10**9)
    firmware = NetworkedProjectorFirmware(ProjectorFirmware(clock), wants_password=wants_password)
    line = Wire(firmware, clock)
    return EscVp21Projector(MemoryAddress(line, "socket://projector:3629"), clock, SERIAL), line


def test_a_projector_on_a_network_is_greeted_first() -> None:
    projector, line = networked(wants_password=False)
    line.spoiler = wire.split(0.001)
    projector.open()
    assert projector.set_power(True, 150.0) is VERIFIED


def test_a_projector_that_wants_a_password_is_not_opened() -> None:
    projector, _ = networked(wants_password=True)
    with pytest.raises(DeviceProtocolError, match="refuses the connection: allow control"):
        projector.open()


def test_a_port_of_a_network_that_does_not_greet_is_silence() -> None:
    projector, line = networked(wants_password=False)
    line.spoiler = wire.lose
    with pytest.raises(DeviceTimeout, match="does not answer"):
        projector.open()


def test_its_name_says_that_it_is_simulated() -> None:
    assert ProjectorRig().driver.name == f"sim:ESC/VP21 projector {SERIAL}"
