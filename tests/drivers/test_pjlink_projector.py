"""The driver with the simulated firmware at the other end of a wire without a network."""

import random
from collections.abc import Callable

import pytest

from drivers.clock import ManualClock
from drivers.interfaces import CommandResult, PowerState, ProjectorStatus
from drivers.pjlink_messages import PasswordRefused
from drivers.pjlink_projector import PjlinkProjector as Pjlink
from navapp.errors import DeviceError, DeviceLost, DeviceProtocolError, DeviceTimeout, WrongDevice
from navapp.errors import UnsupportedControl as Unsupported
from sim_devices.firmware.pjlink import Lamp, PjlinkProjector
from tests.drivers.pjlink_wires import driver


@pytest.fixture
def firmware() -> PjlinkProjector:
    return PjlinkProjector(ManualClock(10**9))


def first(count: int, spoil: Callable[[bytes], bytes | None]) -> Callable[[bytes], bytes | None]:
    """Spoils so many replies, then no more."""
    left = [count]

    def spoiled(reply: bytes) -> bytes | None:
        left[0] -= 1
        return spoil(reply) if left[0] >= 0 else reply

    return spoiled


def silent(reply: bytes) -> None:
    return None


def seconds(firmware: PjlinkProjector) -> float:
    return firmware.clock.now_ns() / 1e9 - 1.0


def test_the_lamp_is_waited_for(firmware) -> None:
    projector = driver(firmware)
    projector.open()
    assert projector.set_power(True, 150.0) is CommandResult.VERIFIED
    assert 40.0 <= seconds(firmware) <= 42.0
    assert firmware.lamp is Lamp.ON
    assert projector.set_power(False, 150.0) is CommandResult.VERIFIED
    assert 100.0 <= seconds(firmware) <= 104.0
    assert firmware.lamp is Lamp.STANDBY


def test_a_lamp_that_takes_too_long_is_accepted_and_no_more(firmware) -> None:
    projector = driver(firmware)
    projector.open()
    assert projector.set_power(True, 20.0) is CommandResult.ACCEPTED
    assert seconds(firmware) == pytest.approx(20.0)
    assert projector.status().power is PowerState.WARMING
    with pytest.raises(DeviceTimeout, match="not ready in time to set its power"):
        projector.set_power(False, 5.0)
    assert projector.set_power(False, 150.0) is CommandResult.VERIFIED


def test_a_hot_lamp_is_lit_again_after_it_has_cooled(firmware) -> None:
    projector = driver(firmware)
    projector.open()
    projector.set_power(True, 150.0)
    projector.set_power(False, 1.5)
    assert firmware.lamp is Lamp.COOLING
    assert projector.set_power(True, 150.0) is CommandResult.VERIFIED
    assert firmware.lamp is Lamp.ON


def test_everything_that_pjlink_tells_is_read_back(firmware) -> None:
    projector = driver(firmware)
    projector.open()
    assert projector.name == "sim:projector"
    standby = ProjectorStatus(PowerState.STANDBY, lamp_hours=(1633,))
    assert projector.status() == standby
    projector.set_power(True, 150.0)
    assert projector.set_source("32", 5.0) is CommandResult.VERIFIED
    assert projector.set_mute(True, 5.0) is CommandResult.VERIFIED
    assert firmware.is_picture_hidden
    firmware.faults = "010020"
    firmware.clock.wait_until_ns(firmware.clock.now_ns() + 2 * 3600 * 10**9)
    assert projector.status() == ProjectorStatus(
        PowerState.ON,
        source="32",
        is_muted=True,
        lamp_hours=(1635,),
        faults=("lamp warning", "filter error"),
    )


def test_what_class_1_or_this_projector_lacks_is_none(firmware) -> None:
    firmware.lacks = ("LAMP", "ERST", "AVMT", "NAME")
    projector = driver(firmware)
    projector.open()
    assert projector.name == "projector at test"
    projector.set_power(True, 150.0)
    assert projector.status() == ProjectorStatus(PowerState.ON, source="31")
    with pytest.raises(Unsupported, match=r"does not take its mute to be set \(ERR1\)"):
        projector.set_mute(True, 5.0)
    with pytest.raises(Unsupported, match="own menu"):
        projector.set_flips(True, False, 5.0)


def test_a_setting_that_cannot_be_read_back_is_accepted_at_once(firmware) -> None:
    def hides(reply: bytes) -> bytes:
        return reply if b"=OK" in reply or b"AVMT" not in reply else b"%1AVMT=ERR1\r"

    projector = driver(firmware, hides)
    projector.open()
    projector.set_power(True, 150.0)
    begin_s = seconds(firmware)
    assert projector.set_mute(True, 60.0) is CommandResult.ACCEPTED
    assert seconds(firmware) == begin_s
    assert firmware.is_picture_hidden


def test_a_setting_that_does_not_take_is_told_again_and_never_called_verified(firmware) -> None:
    told = []

    def deaf(reply: bytes) -> bytes:
        told.append(reply)
        return b"%1AVMT=30\r" if b"AVMT" in reply and b"=OK" not in reply else reply

    projector = driver(firmware, deaf)
    projector.open()
    projector.set_power(True, 150.0)
    assert projector.set_mute(True, 25.0) is CommandResult.ACCEPTED
    assert told.count(b"%1AVMT=OK\r") == 3


def test_refusals_have_names(firmware) -> None:
    projector = driver(firmware)
    projector.open()
    with pytest.raises(Unsupported, match="does not take its source to be set in standby"):
        projector.set_source("31", 5.0)
    with pytest.raises(Unsupported, match="'HDMI' is no PJLink source"):
        projector.set_source("HDMI", 5.0)
    projector.set_power(True, 150.0)
    with pytest.raises(Unsupported, match=r"source to be set \(ERR2\)"):
        projector.set_source("59", 5.0)
    firmware.is_failed = True
    assert projector.status().power is PowerState.FAULT
    with pytest.raises(DeviceError, match="reports a failure"):
        projector.set_mute(True, 5.0)


def test_the_password_is_digested_and_never_told(firmware) -> None:
    firmware.password = "JBMIAProjectorLink"
    projector = driver(firmware, password="JBMIAProjectorLink")
    projector.open()
    assert projector.status().power is PowerState.STANDBY
    for password, text in (("", "wants a password"), ("hunter2", "refuses the password")):
        with pytest.raises(PasswordRefused, match=text) as caught:
            driver(firmware, password=password).open()
        assert "hunter2" not in str(caught.value)
    firmware.password = "changed"
    with pytest.raises(PasswordRefused):
        projector.set_power(True, 150.0)
    assert seconds(firmware) == 0.0


@pytest.mark.parametrize(
    "spoil",
    [
        silent,
        lambda reply: reply[: len(reply) // 2],
        lambda reply: b"\x00\xff" + reply,
        lambda reply: reply + reply,
        lambda reply: b"x" * 200,
    ],
)
def test_trouble_on_the_way_is_overcome(firmware, spoil) -> None:
    kinds = (DeviceTimeout, DeviceLost, DeviceProtocolError)
    projector = driver(firmware, first(3, spoil))
    for _ in range(3):
        with pytest.raises(kinds):
            projector.open()
    projector.open()
    projector = driver(firmware)
    projector.open()
    projector._connect = driver(firmware, first(5, spoil))._connect
    with pytest.raises(kinds):
        projector.status()
    assert projector.set_power(True, 150.0) is CommandResult.VERIFIED
    projector.close()
    with pytest.raises(DeviceLost, match="is not open"):
        projector.status()


def test_another_projector_at_its_address_is_refused(firmware) -> None:
    projector = driver(firmware)
    projector.open()
    firmware.name = "OTHER"
    with pytest.raises(WrongDevice, match="calls itself 'OTHER', the session's is 'sim:projector'"):
        projector.status()
    with pytest.raises(DeviceLost, match="is not open"):
        projector.status()
    with pytest.raises(WrongDevice):
        projector.open()
    firmware.name = "sim:projector"
    projector.open()
    assert projector.status().power is PowerState.STANDBY


def test_a_name_that_was_misread_neither_binds_nor_ends_a_session(firmware) -> None:
    lies = [b"%1NAME=sin:projector\r"]

    def lie(reply: bytes) -> bytes:
        return lies.pop() if lies and reply.startswith(b"%1NAME") else reply

    projector = driver(firmware, lie)
    projector.open()
    assert projector.name == "projector at test"
    projector.status()
    assert projector.name == "sim:projector"
    lies.append(b"%1NAME=sim:projectos\r")
    assert projector.status().power is PowerState.STANDBY
    assert not lies


def spoiler(chance: random.Random) -> Callable[[bytes], bytes | None]:
    """Any bytes instead of a reply, or one byte of it changed, lost or added, or silence."""

    def spoiled(reply: bytes) -> bytes | None:
        kind, place = chance.randrange(8), chance.randrange(len(reply) + 1)
        if kind == 0:
            return None
        if kind == 1:
            return chance.randbytes(chance.randrange(200))
        if kind == 2:
            return chance.randbytes(chance.randrange(40)) + b"\r"
        if kind == 3:
            return reply[:place] + chance.randbytes(1) + reply[place + 1 :]
        if kind == 4:
            return reply[:place] + reply[place + 1 :]
        if kind == 5:
            return reply[:place] + chance.randbytes(1) + reply[place:]
        return reply

    return spoiled


def attempt(projector: Pjlink, firmware: PjlinkProjector, chance: random.Random) -> bool:
    """Give any command; whether it was called verified, which must then be true."""
    kind, is_on = chance.randrange(3), chance.random() < 0.5
    if kind == 0:
        result = projector.set_power(is_on, 30.0)
        is_so = firmware.lamp is (Lamp.ON if is_on else Lamp.STANDBY)
    elif kind == 1:
        result = projector.set_mute(is_on, 30.0)
        is_so = firmware.is_picture_hidden is is_on
    else:
        source = chance.choice(("11", "31", "32", "55"))
        result = projector.set_source(source, 30.0)
        is_so = firmware.picture_source == source
    is_verified = result is CommandResult.VERIFIED
    assert is_so or not is_verified
    return is_verified


def test_no_bytes_hang_it_or_make_it_lie() -> None:
    """100,000 replies of which three in four are spoilt."""
    chance = random.Random(11)
    n_replies, n_verified, n_raised = 0, 0, 0
    spoil = spoiler(chance)

    def counted(reply: bytes) -> bytes | None:
        nonlocal n_replies
        n_replies += 1
        return spoil(reply)

    while n_replies < 100_000:
        firmware = PjlinkProjector(ManualClock(10**9), password=chance.choice(("", "secret")))
        projector = driver(firmware, password="secret")
        projector.open()
        if chance.random() < 0.5:
            projector.set_power(True, 150.0)
        projector._connect = driver(firmware, counted)._connect
        for _ in range(20):
            begin_ns = firmware.clock.now_ns()
            try:
                n_verified += attempt(projector, firmware, chance)
                projector.status()
            except DeviceError:
                n_raised += 1
            # The time of a command, and ten seconds for a status.
            assert firmware.clock.now_ns() - begin_ns <= (30 + 10) * 10**9
    assert n_verified > 50
    assert n_raised > 1000
