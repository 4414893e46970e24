"""The simulated projector on its socket, with the real driver at the other end."""

import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial

import pytest

from drivers.clock import ManualClock, SystemClock
from drivers.interfaces import PowerState
from drivers.pjlink_line import TcpConnection
from drivers.pjlink_projector import PjlinkProjector
from navapp.errors import DeviceLost, DeviceNotFound, DeviceTimeout
from sim_devices.firmware import pjlink
from sim_devices.firmware.pjlink_server import PjlinkServer, Trouble

pytestmark = pytest.mark.waits


@contextmanager
def served(trouble: Trouble | None = None) -> Iterator[PjlinkServer]:
    server = PjlinkServer(pjlink.PjlinkProjector(ManualClock()), trouble)
    server.start()
    try:
        yield server
    finally:
        server.close()


def driver(port: int) -> PjlinkProjector:
    projector = PjlinkProjector("test", SystemClock(), partial(TcpConnection, "127.0.0.1", port))
    projector.open()
    return projector


def wait_until(is_so: Callable[[], bool]) -> None:
    end_s = time.monotonic() + 5.0
    while not is_so():
        assert time.monotonic() < end_s
        time.sleep(0.01)


def test_late_replies_are_waited_for() -> None:
    with served(Trouble(late_s=0.2, is_split=True)) as server:
        begin_s = time.monotonic()
        assert driver(server.port).status().power is PowerState.STANDBY
        assert time.monotonic() - begin_s > 1.6  # two connections, seven answers


def test_a_projector_that_serves_someone_else_says_so_in_time(monkeypatch) -> None:
    monkeypatch.setattr("drivers.pjlink_line._REPLY_S", 0.3)
    with served() as server:
        projector = driver(server.port)
        other = TcpConnection("127.0.0.1", server.port, 5.0)
        try:
            assert other.receive(5.0) == b"PJLINK 0\r"
            with pytest.raises(DeviceTimeout, match="most projectors serve one at a time"):
                projector.status()
        finally:
            other.close()
        wait_until(lambda: projector.status().power is PowerState.STANDBY)


def test_a_client_that_is_idle_is_hung_up_on_and_a_later_call_connects_again() -> None:
    with served() as server:
        idle = TcpConnection("127.0.0.1", server.port, 5.0)
        try:
            assert idle.receive(5.0) == b"PJLINK 0\r"
            server.projector.clock.wait_until_ns(30 * 10**9)
            assert idle.receive(5.0) == b""
        finally:
            idle.close()
        projector = driver(server.port)
        server.projector.clock.wait_until_ns(600 * 10**9)
        assert projector.status().power is PowerState.STANDBY


def test_mains_pulled_and_put_back() -> None:
    with served() as server:
        projector = driver(server.port)
        server.projector.cut_power()
        with pytest.raises(DeviceLost, match="connection to the projector is lost"):
            projector.status()
        server.projector.restore_power()
        assert projector.status().power is PowerState.STANDBY
    with pytest.raises(
        DeviceNotFound, match=f"no projector answers at 127.0.0.1 port {server.port}"
    ):
        projector.status()


def test_a_reply_that_is_cut_off_is_a_lost_connection() -> None:
    with served(Trouble(cut=1.0)) as server, pytest.raises(DeviceLost, match="hung up"):
        driver(server.port)


def test_trouble_comes_as_often_as_asked_for() -> None:
    trouble = Trouble(lost=0.25, corrupted=0.25, seed=3)
    arrived = [b"".join(trouble.pieces(b"%1POWR=0\r")) for _ in range(4000)]
    lost = sum(not reply for reply in arrived)
    corrupted = sum(reply not in (b"", b"%1POWR=0\r") for reply in arrived)
    assert lost == pytest.approx(1000, abs=120)
    assert corrupted == pytest.approx(750, abs=120)


def test_the_command_for_a_person() -> None:
    command = [sys.executable, "-m", "sim_devices.firmware", "pjlink", "--port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as running:
        assert running.stdout is not None
        words = running.stdout.readline().replace(";", "").split()
        projector = driver(int(words[words.index("port") + 1]))
        assert projector.name == "sim:projector"
        running.send_signal(signal.SIGINT)
        try:
            assert running.wait(20.0) == 0
        finally:
            running.kill()
