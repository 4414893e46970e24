"""The simulated projector, held against exchanges that are written down."""

import random

import pytest

from drivers.clock import ManualClock
from sim_devices.firmware.pjlink import PjlinkProjector

S = 10**9


@pytest.fixture
def projector() -> PjlinkProjector:
    return PjlinkProjector(ManualClock())


def test_the_documented_exchange(projector) -> None:
    session = projector.connection()
    assert session.greeting() == b"PJLINK 0\r"
    assert session.receive(b"%1POWR ?\r") == b"%1POWR=0\r"
    assert session.receive(b"%1POWR 1\r") == b"%1POWR=OK\r"
    assert session.receive(b"%1POWR ?\r") == b"%1POWR=3\r"
    assert session.receive(b"%1INPT 31\r") == b"%1INPT=ERR3\r"
    projector.clock.wait_until_ns(40 * S)
    assert session.receive(b"%1POWR ?\r") == b"%1POWR=1\r"
    assert session.receive(b"%1AVMT 31\r") == b"%1AVMT=OK\r"
    assert session.receive(b"%1ERST ?\r") == b"%1ERST=000000\r"
    assert session.receive(b"%1LAMP ?\r") == b"%1LAMP=1633 1\r"
    assert session.receive(b"%1POWR 0\r%1POWR ?\r") == b"%1POWR=OK\r%1POWR=2\r"
    assert session.receive(b"%1POWR 1\r") == b"%1POWR=ERR3\r"
    projector.clock.wait_until_ns(100 * S)
    assert session.receive(b"%1POWR ?\r") == b"%1POWR=0\r"


def test_a_password_is_wanted_once_a_connection() -> None:
    projector = PjlinkProjector(ManualClock(), password="JBMIAProjectorLink")
    session = projector.connection()
    session._salt = "498e4a67"
    assert session.greeting() == b"PJLINK 1 498e4a67\r"
    first = b"5d8409bc1c3fa39749434aa3a5c38682%1POWR ?\r"
    assert session.receive(first) == b"%1POWR=0\r"
    assert session.receive(b"%1POWR ?\r") == b"%1POWR=0\r"
    for wrong in (first, b"%1POWR ?\r"):
        session = projector.connection()
        assert session.receive(wrong) == b"PJLINK ERRA\r"
        assert session.is_over


def test_it_hangs_up_after_half_a_minute_of_silence(projector) -> None:
    session = projector.connection()
    projector.clock.wait_until_ns(20 * S)
    session.receive(b"%1POWR ?\r")
    projector.clock.wait_until_ns(49 * S)
    session.tick()
    assert not session.is_over
    projector.clock.wait_until_ns(50 * S)
    session.tick()
    assert session.is_over


@pytest.mark.parametrize(
    ("request_", "reply"),
    [
        (b"%1FOOO ?", b"%1FOOO=ERR1"),
        (b"%1POWR 2", b"%1POWR=ERR2"),
        (b"%1INPT 99", b"%1INPT=ERR2"),
        (b"%1powr ?", b"%1POWR=0"),
        (b"\n%1POWR ?", b"%1POWR=0"),
        (b"%1INST ?", b"%1INST=11 31 32"),
        (b"%2SNUM ?", b""),
        (b"", b""),
    ],
)
def test_refusals(projector, request_, reply) -> None:
    assert projector.connection().receive(request_ + b"\r") == reply + b"\r" * bool(reply)


def test_after_a_power_cut_it_is_in_standby(projector) -> None:
    session = projector.connection()
    session.receive(b"%1POWR 1\r")
    projector.clock.wait_until_ns(41 * S)
    projector.cut_power()
    session.tick()
    assert session.is_over
    projector.restore_power()
    assert projector.connection().receive(b"%1POWR ?\r") == b"%1POWR=0\r"


def test_any_bytes_leave_it_alive(projector) -> None:
    chance = random.Random(5)
    for _ in range(2000):
        session = projector.connection()
        session.receive(chance.randbytes(chance.randrange(300)) + b"\r%1POWR ")
        assert len(session._received) < 600
    assert projector.connection().receive(b"%1CLSS ?\r") == b"%1CLSS=1\r"
