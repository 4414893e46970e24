"""What happens to messages on the wire, and the terminal that a person types into."""

import os
import random
import select
import subprocess
import sys
import time

import pytest

from drivers.clock import ManualClock
from sim_devices.firmware import wire
from sim_devices.firmware.fast_clock import FastClock
from sim_devices.firmware.wire import Wire

pytestmark = pytest.mark.waits


class Talker:
    """Sends what it is told to."""

    def __init__(self) -> None:
        self.out: list[bytes] = []
        self.heard = b""

    def receive(self, data: bytes) -> None:
        self.heard += data

    def messages(self) -> list[bytes]:
        out, self.out = self.out, []
        return out

    def next_ns(self) -> int | None:
        return None


def arrivals(spoiler: wire.Spoiler, *messages: bytes) -> list[tuple[float, bytes]]:
    """Time in s and bytes of everything that arrives."""
    clock, talker = ManualClock(), Talker()
    line = Wire(talker, clock)
    line.spoiler = spoiler
    talker.out = list(messages)
    found = []
    while True:
        if data := line.take_arrived():
            found.append((clock.now_ns() / 1e9, data))
        if (next_ns := line.next_ns()) is None:
            return found
        clock.wait_until_ns(next_ns)


def test_what_happens_to_messages() -> None:
    assert arrivals(wire.whole, b"ab", b"c") == [(0.0, b"abc")]
    assert arrivals(wire.lose, b"ab") == []
    assert arrivals(wire.double, b"ab") == [(0.0, b"abab")]
    assert arrivals(wire.split(0.5), b"ab") == [(0.5, b"a"), (1.0, b"b")]
    assert arrivals(wire.late(2.0), b"ab") == [(2.0, b"ab")]
    assert arrivals(wire.precede_by(b"x"), b"ab") == [(0.0, b"xab")]
    assert arrivals(wire.first(1, wire.lose), b"ab", b"cd") == [(0.0, b"cd")]
    ((_, data),) = arrivals(wire.corrupt(random.Random(1)), b"abcd")
    assert bin(int.from_bytes(data, "big") ^ int.from_bytes(b"abcd", "big")).count("1") == 1


def test_nothing_overtakes_on_a_wire() -> None:
    assert arrivals(wire.first(1, wire.late(2.0)), b"ab", b"cd") == [(2.0, b"abcd")]


def test_commands_may_suffer_too() -> None:
    talker = Talker()
    line = Wire(talker, ManualClock())
    line.command_spoiler = lambda data: data[1:]
    line.receive(b"abc")
    assert talker.heard == b"bc"


def test_a_fast_clock_passes_time_faster() -> None:
    clock = FastClock(100.0)
    begin_ns, begin_s = clock.now_ns(), time.monotonic()
    clock.wait_until_ns(begin_ns + 2 * 10**9)
    assert 0.02 <= time.monotonic() - begin_s < 0.5
    assert clock.now_ns() >= begin_ns + 2 * 10**9
    with pytest.raises(ValueError, match="positive"):
        FastClock(0.0)


@pytest.mark.parametrize(
    ("kind", "question", "answer"),
    [("escvp21", b"PWR?\r", b"PWR=04\r:"), ("zaber", b"/\n", b"@01 0 OK IDLE WR 0\r\n")],
)
def test_a_person_can_talk_to_it_with_a_terminal_program(kind, question, answer, tmp_path) -> None:
    path = tmp_path / "terminal"
    with subprocess.Popen(
        [sys.executable, "-m", "sim_devices.firmware", kind, "--path", str(path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as program:
        assert program.stdin is not None
        assert program.stdout is not None
        assert program.stdout.readline() == f"{kind} answers at {path}\n"
        assert "unplug" in program.stdout.readline()
        end = os.open(path, os.O_RDWR | os.O_NOCTTY)
        os.write(end, question)
        found = b""
        while select.select([end], [], [], 2.0)[0] and len(found) < len(answer):
            found += os.read(end, 100)
        assert found == answer
        os.close(end)
        program.stdin.write("melt\nunplug\n")
        program.stdin.flush()
        assert program.stdout.readline().startswith("'melt' is none of: ")
        program.stdin.close()
        assert program.wait(5.0) == 0
    assert not path.exists()
