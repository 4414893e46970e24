"""The stage's firmware beside the exchanges of the maker's manual."""

import random
from itertools import pairwise

import pytest

from drivers.clock import ManualClock
from sim_devices.firmware.stage_motion import travel_to, travel_to_rest
from sim_devices.firmware.zaber import StageFirmware
from tests.sim_devices.firmware.terminals import Terminal


def terminal_of_a_stage() -> Terminal:
    clock = ManualClock()
    return Terminal(StageFirmware(clock), clock)


def test_the_manuals_exchanges() -> None:
    terminal = terminal_of_a_stage()
    assert terminal.type(b"/1 1 get pos\n") == b"@01 1 OK IDLE WR 0\r\n"
    assert terminal.type(b"/1 1 home\n") == b"@01 1 OK BUSY WR 0\r\n"
    assert terminal.type(b"/1 1\n") == b"@01 1 OK BUSY WR 0\r\n"
    terminal.after_s(5.0)
    assert terminal.type(b"/1 1\n") == b"@01 1 OK IDLE -- 0\r\n"
    assert terminal.type(b"/1 1 move abs 10000\n") == b"@01 1 OK BUSY -- 0\r\n"
    terminal.after_s(5.0)
    assert terminal.type(b"/1 1 get pos\n") == b"@01 1 OK IDLE -- 10000\r\n"
    assert terminal.type(b"/1 1 move abs 99999999\n") == b"@01 1 RJ IDLE -- BADDATA\r\n"
    assert terminal.type(b"/1 0 12\n") == b"@01 0 12 OK IDLE -- 0\r\n"
    assert terminal.type(b"/\n") == b"@01 0 OK IDLE -- 0\r\n"
    assert terminal.type(b"/1 5 get pos\n") == b"@01 5 RJ IDLE -- BADAXIS\r\n"
    assert terminal.type(b"/1 1 frobnicate\n") == b"@01 1 RJ IDLE -- BADCOMMAND\r\n"


def test_checksums_are_checked_and_sent() -> None:
    terminal = terminal_of_a_stage()
    assert terminal.type(b"/1 get pos:FD\n") == b"@01 0 OK IDLE WR 0\r\n"
    assert terminal.type(b"/1 get pos:FE\n") == b""
    assert terminal.type(b"/1 0 set comm.checksum 1\n").startswith(b"@01 0 OK IDLE WR 0:")
    terminal.firmware.flags.clear()
    assert terminal.type(b"/1 0\n") == b"@01 0 OK IDLE -- 0:8D\r\n"


def test_an_absolute_move_without_reference_goes_wrong() -> None:
    """So that a driver that does not refuse it is found out."""
    terminal = terminal_of_a_stage()
    before_deg = terminal.firmware.true_deg
    terminal.type(b"/1 1 move abs 10000\n")
    terminal.after_s(5.0)
    assert terminal.firmware.true_deg == pytest.approx(before_deg + 10000 / 384000 * 360)


def test_warnings_are_listed_and_cleared() -> None:
    terminal = terminal_of_a_stage()
    terminal.firmware.flags.add("NC")
    assert terminal.type(b"/1 1 warnings\n") == b"@01 1 OK IDLE WR 02 WR NC\r\n"
    assert terminal.type(b"/1 1 warnings clear\n") == b"@01 1 OK IDLE WR 02 WR NC\r\n"
    assert terminal.type(b"/1 1 warnings\n") == b"@01 1 OK IDLE WR 01 WR\r\n"


def test_a_knob_alerts() -> None:
    terminal = terminal_of_a_stage()
    terminal.type(b"/1 1 home\n")
    terminal.after_s(5.0)
    terminal.type(b"/1 0 set comm.alert 1\n")
    terminal.firmware.turn_by_hand(1.0)
    assert terminal.type(b"") == b"!01 1 BUSY NC\r\n"


def test_random_bytes_do_it_no_harm() -> None:
    terminal, bits = terminal_of_a_stage(), random.Random(1)
    for _ in range(1000):
        terminal.type(b"/" + bits.randbytes(100))
    terminal.type(b"\n")
    assert terminal.type(b"/1 1\n") == b"@01 1 OK IDLE WR 0\r\n"


@pytest.mark.parametrize(("start", "end"), [(0.0, 1000.0), (50.0, 0.0), (0.0, 1.0), (3.0, 3.0)])
def test_a_travel_is_smooth_and_ends_where_it_should(start, end) -> None:
    travel = travel_to(0, start, end, 100.0, 500.0)
    moments_ns = range(0, travel.end_ns + 1_000_000, 1_000_000)
    places = [travel.at(t)[0] for t in moments_ns]
    steps = [abs(b - a) for a, b in pairwise(places)]
    assert max(steps, default=0.0) <= 0.1 + 1e-9
    assert travel.at(travel.end_ns)[0] == pytest.approx(end, abs=1e-6)
    assert travel.at(travel.end_ns)[1] == pytest.approx(0.0, abs=1e-3)


def test_stopping_takes_its_way() -> None:
    travel = travel_to_rest(0, 10.0, -100.0, 500.0)
    assert travel.at(travel.end_ns)[0] == pytest.approx(0.0)
    assert travel.end_ns == 200_000_000
