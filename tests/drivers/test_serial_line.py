"""The real port under the line: every way in which pyserial loses a device."""

import os
import socket
import termios
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest
import serial

from drivers import serial_line
from drivers.clock import SystemClock
from drivers.serial_line import SerialLine
from drivers.serial_port import SerialAddress
from navapp.errors import DeviceLost, DeviceNotFound, DeviceProtocolError, DeviceTimeout
from tests.drivers.footprints import (
    CYCLES,
    assert_nothing_is_left,
    footprint,
    needs_descriptors,
)
from tests.many import few_rows_of

pytestmark = pytest.mark.waits

SOON_S = 1.0


class Peer:
    """The other end of a pseudo-terminal.

    Its name is a link of its own: the terminal's number is anybody's once this end is closed.
    """

    def __init__(self, link: Path) -> None:
        self.end, slave = os.openpty()
        link.symlink_to(os.ttyname(slave))
        self.name = str(link)
        os.close(slave)
        self.is_there = True

    def hang_up(self) -> None:
        if self.is_there:
            os.unlink(self.name)
            os.close(self.end)
        self.is_there = False


@pytest.fixture
def peer(tmp_path: Path) -> Iterator[Peer]:
    made = Peer(tmp_path / "terminal")
    yield made
    made.hang_up()


@pytest.fixture
def line(peer) -> Iterator[SerialLine]:
    made = SerialLine(SerialAddress(peer.name, 9600), SystemClock(), "device", b":")
    made.open()
    yield made
    made.close()


def soon(line: SerialLine) -> int:
    return line.deadline_ns(SOON_S)


def later(action, delay_s: float = 0.1) -> threading.Thread:
    thread = threading.Timer(delay_s, action)
    thread.start()
    return thread


def test_packets_are_whole_however_they_are_cut(line, peer) -> None:
    whole = b"PWR=01\r:SNO=X\r::ERR\r:"
    for data in (whole[i : i + 1] for i in range(len(whole))):
        os.write(peer.end, data)
        time.sleep(0.001)
    expected = [b"PWR=01\r", b"SNO=X\r", b"", b"ERR\r"]
    assert [line.next(soon(line)) for _ in expected] == expected


def test_half_a_packet_waits_for_its_other_half(line, peer) -> None:
    os.write(peer.end, b"PWR=")
    begin_s = time.monotonic()
    assert line.next(line.deadline_ns(0.1)) is None
    assert 0.09 < time.monotonic() - begin_s < 0.09 + SOON_S
    os.write(peer.end, b"01\r:")
    assert line.next(soon(line)) == b"PWR=01\r"


def test_what_was_sent_arrives(line, peer) -> None:
    line.send(b"PWR?\r")
    assert os.read(peer.end, 100) == b"PWR?\r"


def test_discarding_forgets_what_came(line, peer) -> None:
    os.write(peer.end, b"old:half")
    line.discard()
    os.write(peer.end, b"new:")
    assert line.next(soon(line)) == b"new"


@pytest.mark.parametrize("use", ["next", "send", "discard"])
def test_a_line_whose_other_end_is_gone_is_lost_and_closed(line, peer, use) -> None:
    peer.hang_up()
    uses = {
        "next": lambda: line.next(soon(line)),
        "send": lambda: line.send(b"\r"),
        "discard": line.discard,
    }
    with pytest.raises(DeviceLost, match=r"is gone .*check the cable"):
        uses[use]()
    assert not line.is_open
    with pytest.raises(DeviceLost, match="not connected"):
        uses[use]()
    # Another program may have got the number of the terminal that is gone.
    others = os.openpty()
    try:
        with pytest.raises(DeviceNotFound, match="No such file"):
            line.open()
    finally:
        for end in others:
            os.close(end)


FAILURES = (
    serial.SerialException("device reports readiness to read but returned no data"),
    OSError(5, "Input/output error"),
    termios.error(5, "Input/output error"),
    TypeError("argument must be an int, or have a fileno() method"),
    serial.PortNotOpenError(),
    ValueError("unknown"),
)


@pytest.mark.parametrize("failure", FAILURES, ids=lambda failure: type(failure).__name__)
@pytest.mark.parametrize("call", ["read", "in_waiting", "write"])
def test_whatever_pyserial_raises_is_a_lost_line(line, peer, monkeypatch, call, failure) -> None:
    """Which of them comes depends on the call, the platform and the moment."""

    def fail(*_: object) -> None:
        raise failure

    os.write(peer.end, b"half")
    monkeypatch.setattr(serial.Serial, call, property(fail) if call == "in_waiting" else fail)
    with pytest.raises(DeviceLost, match=r"is gone .*check the cable"):
        line.send(b"\r") if call == "write" else line.next(soon(line))
    assert not line.is_open


def test_a_blocked_read_ends_when_the_other_end_goes(line, peer) -> None:
    thread = later(peer.hang_up)
    begin_s = time.monotonic()
    with pytest.raises(DeviceLost):
        line.next(line.deadline_ns(20.0))
    assert time.monotonic() - begin_s < SOON_S
    thread.join()


def test_a_line_closed_by_another_thread_is_lost(line) -> None:
    thread = later(line.close)
    begin_s = time.monotonic()
    try:
        with pytest.raises(DeviceLost):
            line.next(line.deadline_ns(2.0))
    finally:
        thread.join()
    assert time.monotonic() - begin_s < 5.0


def test_a_line_closed_while_it_is_read_is_lost_whatever_the_read_returned(
    line, monkeypatch
) -> None:
    """pyserial, closed by another thread, ends a read as if its time were over, or fails."""

    def read_nothing(*_: object) -> bytes:
        thread = threading.Thread(target=line.close)
        thread.start()
        thread.join()
        return b""

    monkeypatch.setattr(serial.Serial, "read", read_nothing)
    with pytest.raises(DeviceLost):
        line.next(soon(line))


def test_a_peer_that_takes_nothing_times_out(line) -> None:
    with pytest.raises(DeviceTimeout, match="takes no more bytes"):
        line.send(bytes(1_000_000))


def test_a_packet_without_end_is_refused_and_forgotten(line, peer) -> None:
    os.write(peer.end, b"x" * 2000)
    with pytest.raises(DeviceProtocolError, match="sends without end"):
        line.next(soon(line))
    line.discard()
    os.write(peer.end, b"y:")
    assert line.next(soon(line)) == b"y"


@pytest.mark.parametrize(
    ("n_bytes", "pause_s"), few_rows_of([(1000, 0.0), (1, 0.005)]), ids=["fast", "slow"]
)
def test_a_line_that_never_stops_is_refused_soon(line, peer, n_bytes, pause_s, monkeypatch) -> None:
    # Longer than a busy computer keeps the sender waiting.
    monkeypatch.setattr(serial_line, "_QUIET_S", 0.5)
    os.set_blocking(peer.end, False)
    stopping = threading.Event()

    def babble() -> None:
        while not stopping.wait(pause_s):
            with suppress(BlockingIOError):
                os.write(peer.end, b"x" * n_bytes)

    thread = threading.Thread(target=babble)
    thread.start()
    begin_s = time.monotonic()
    try:
        with pytest.raises(DeviceProtocolError, match="never stops sending"):
            line.discard()
        assert time.monotonic() - begin_s < 2.0 + 3.0 * SOON_S
    finally:
        stopping.set()
        thread.join()


def test_a_second_program_on_the_same_port_is_refused(line, peer) -> None:
    with pytest.raises(DeviceNotFound, match="close the other program"):
        SerialAddress(peer.name, 9600).open()


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("/dev/nothing-here", "connect the device"),
        ("/etc/hostname", "check the port"),
        ("nonsense://x", "check the port"),
        ("socket://127.0.0.1:1", "check the port"),
        ("", "check the port"),
    ],
)
def test_a_port_that_cannot_be_opened_says_why(name, words) -> None:
    with pytest.raises(DeviceNotFound, match=words):
        SerialAddress(name, 9600).open()


def test_a_port_without_permission_names_the_group(monkeypatch) -> None:
    def refuse(self) -> None:
        raise serial.SerialException(13, "Permission denied")

    monkeypatch.setattr(serial.Serial, "open", refuse)
    with pytest.raises(DeviceNotFound, match=r"Permission denied.*group dialout"):
        SerialAddress("/dev/ttyS0", 9600).open()


def test_a_pseudo_terminal_is_no_cable(peer) -> None:
    assert SerialAddress(peer.name, 9600).is_simulated
    assert not SerialAddress("/dev/ttyUSB0", 9600).is_simulated
    assert not SerialAddress("socket://host:1", 9600).is_simulated


@pytest.fixture
def server() -> Iterator[socket.socket]:
    with socket.create_server(("127.0.0.1", 0)) as made:
        yield made


def test_a_line_over_a_socket_and_its_end(server) -> None:
    name = f"socket://127.0.0.1:{server.getsockname()[1]}"
    line = SerialLine(SerialAddress(name, 9600), SystemClock(), "device", b":")
    line.open()
    other, _ = server.accept()
    line.send(b"PWR?\r")
    assert other.recv(100) == b"PWR?\r"
    begin_s = time.monotonic()
    other.sendall(b"PWR=01\r:")
    assert line.next(line.deadline_ns(10.0)) == b"PWR=01\r"
    assert time.monotonic() - begin_s < SOON_S
    assert line.next(line.deadline_ns(0.05)) is None
    other.close()
    with pytest.raises(DeviceLost):
        line.next(soon(line))
    assert not line.is_open
    line.close()


def test_a_socket_that_is_reset_is_lost(server) -> None:
    name = f"socket://127.0.0.1:{server.getsockname()[1]}"
    line = SerialLine(SerialAddress(name, 9600), SystemClock(), "device", b":")
    line.open()
    other, _ = server.accept()
    # Closing with this set sends a reset.
    other.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
    other.close()
    with pytest.raises(DeviceLost):
        line.next(soon(line))
    line.close()


@needs_descriptors
@pytest.mark.parametrize("n_cycles", CYCLES)
def test_many_plugs_leave_nothing(n_cycles: int, tmp_path: Path) -> None:
    def cycle() -> None:
        peer = Peer(tmp_path / "terminal")
        line = SerialLine(SerialAddress(peer.name, 9600), SystemClock(), "device", b":")
        line.open()
        peer.hang_up()
        with pytest.raises(DeviceLost):
            line.next(soon(line))

    settled = (0, 0, 0, 0.0)
    for k in range(n_cycles):
        cycle()
        if k == n_cycles // 2:
            settled = footprint()
    assert_nothing_is_left(settled, n_cycles)
