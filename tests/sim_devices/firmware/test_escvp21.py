"""The projector's firmware beside the exchanges of the maker's guide."""

import random

import pytest

from drivers.clock import ManualClock
from sim_devices.firmware.escvp21 import Power, ProjectorFirmware, ProjectorModel
from tests.sim_devices.firmware.terminals import Terminal


def terminal_of_a_projector(**model: object) -> Terminal:
    clock = ManualClock()
    return Terminal(ProjectorFirmware(clock, ProjectorModel(**model)), clock)


def test_the_guides_exchanges() -> None:
    terminal = terminal_of_a_projector(serial="X4YZ1200123", hours=(1633, 1633))
    assert terminal.type(b"\r") == b":"
    assert terminal.type(b"PWR?\r") == b"PWR=04\r:"
    assert terminal.type(b"PWR ON\r") == b""
    assert terminal.after_s(39.9) == b""
    assert terminal.after_s(0.2) == b":"
    assert terminal.type(b"PWR?\r\n") == b"PWR=01\r:"
    assert terminal.type(b"SNO?\r") == b"SNO=X4YZ1200123\r:"
    assert terminal.type(b"HREVERSE?\r") == b"HREVERSE=OFF\r:"
    assert terminal.type(b"MUTE ON\r") == b":"
    assert terminal.type(b"MUTE?\r") == b"MUTE=ON\r:"
    assert terminal.type(b"FOO\r") == b"ERR\r:"
    assert terminal.type(b"LAMP?\r") == b"LAMP=1633 1633\r:"


def test_a_quick_model_answers_while_it_warms_up() -> None:
    terminal = terminal_of_a_projector(is_quick=True)
    assert terminal.type(b"PWR ON\r") == b":"
    assert terminal.type(b"PWR?\r") == b"PWR=02\r:"
    assert terminal.type(b"MUTE ON\r") == b"ERR\r:"
    assert terminal.type(b"PWR OFF\r") == b"ERR\r:"


def test_what_is_typed_while_the_lamp_burns_up_is_answered_afterwards() -> None:
    terminal = terminal_of_a_projector()
    assert terminal.type(b"PWR ON\rPWR?\r") == b""
    assert terminal.after_s(40.1) == b":PWR=01\r:"


def test_events_tell_of_the_lamp() -> None:
    terminal = terminal_of_a_projector(has_events=True)
    warming = b"IMEVENT=0001 02 00000000 00000000 T1 F1\r:"
    assert terminal.type(b"PWR ON\r") == warming
    assert terminal.after_s(40.1) == warming.replace(b" 02 ", b" 03 ") + b":"


def test_an_abnormal_projector_is_silent_and_takes_the_lamp_after_its_pause() -> None:
    terminal = terminal_of_a_projector(n_failing=3)
    assert terminal.type(b"PWR ON\r") == b""
    assert terminal.after_s(100.1) == b""
    assert terminal.firmware.power is Power.ABNORMAL
    for command in (b"\r", b"PWR?\r", b"PWR ON\r"):
        assert terminal.type(command) == b""
    terminal.firmware.model.n_failing = 0
    terminal.after_s(130.0)
    assert terminal.type(b"PWR ON\r") == b""
    assert terminal.after_s(40.1) == b":"


@pytest.mark.parametrize(
    ("given", "kept"), [(0, 0), (126, 126), (127, 126), (128, 130), (255, 251)]
)
def test_keystone_has_61_steps(given, kept) -> None:
    terminal = terminal_of_a_projector(is_quick=True)
    terminal.type(b"PWR ON\r")
    terminal.after_s(41.0)
    assert terminal.type(f"HKEYSTONE {given}\r".encode()) == b":"
    assert terminal.type(b"HKEYSTONE?\r") == f"HKEYSTONE={kept}\r:".encode()


def test_random_bytes_do_it_no_harm() -> None:
    terminal, bits = terminal_of_a_projector(), random.Random(1)
    for _ in range(1000):
        terminal.type(bits.randbytes(100))
    terminal.type(b"\r")
    assert terminal.type(b"PWR?\r") == b"PWR=04\r:"
