"""The simulated PJLink projector on a loopback socket, with what goes wrong on the way.

`python -m sim_devices.firmware pjlink` runs one for a person with a terminal program.
"""

import argparse
import contextlib
import random
import select
import signal
import socket
import threading
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from drivers.clock import SystemClock
from sim_devices.firmware.pjlink import PjlinkProjector, PjlinkSession

_TICK_S = 0.02


@dataclass(slots=True)
class Trouble:
    """What happens to replies; shares are of all replies, greetings included."""

    is_split: bool = False  # every byte travels alone
    late_s: float = 0.0  # replies come later by this
    # lost, corrupted: share that never arrives, or arrives with a byte changed.
    lost: float = 0.0
    corrupted: float = 0.0
    cut: float = 0.0  # share after half of which the connection ends
    seed: int = 1  # of the chance
    _random: random.Random = field(init=False)

    def __post_init__(self) -> None:
        self._random = random.Random(self.seed)

    def pieces(self, reply: bytes) -> Iterator[bytes]:
        """What arrives of it, in pieces; an empty piece ends the connection."""
        if not reply or self._random.random() < self.lost:
            return
        if self._random.random() < self.corrupted:
            place = self._random.randrange(len(reply))
            wrong = reply[place] ^ self._random.randrange(1, 256)
            reply = reply[:place] + bytes([wrong]) + reply[place + 1 :]
        is_cut = self._random.random() < self.cut
        if is_cut:
            reply = reply[: len(reply) // 2]
        yield from (bytes([byte]) for byte in reply) if self.is_split else (reply,)
        if is_cut:
            yield b""


class PjlinkServer:
    """Serves one client at a time on 127.0.0.1, as most projectors do."""

    def __init__(
        self, projector: PjlinkProjector, trouble: Trouble | None = None, port: int = 0
    ) -> None:
        self.projector = projector
        self.trouble = trouble or Trouble()
        self._listener = socket.create_server(("127.0.0.1", port))
        self.port: int = self._listener.getsockname()[1]
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._serve, name="pjlink-server", daemon=True)

    def start(self) -> None:
        """Begin to listen."""
        self._thread.start()

    def close(self) -> None:
        """Hang up and end."""
        self._stopping.set()
        self._thread.join()
        self._listener.close()

    def _serve(self) -> None:
        while not self._stopping.is_set():
            if not _is_ready(self._listener):
                continue
            client, _ = self._listener.accept()
            with client, contextlib.suppress(OSError):
                client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                if self.projector.is_powered:
                    self._talk(client, self.projector.connection())

    def _talk(self, client: socket.socket, session: PjlinkSession) -> None:
        if not self._say(client, session.greeting()):
            return
        while not self._stopping.is_set():
            session.tick()
            if session.is_over:
                return
            if _is_ready(client):
                data = client.recv(4096)
                if not data or not self._say(client, session.receive(data)):
                    return

    def _say(self, client: socket.socket, reply: bytes) -> bool:
        """Send it as the trouble has it; False when the connection is to end."""
        if self.trouble.late_s:
            self._stopping.wait(self.trouble.late_s)
        for piece in self.trouble.pieces(reply):
            if not piece:
                return False
            client.sendall(piece)
        return True


def main(arguments: Sequence[str]) -> None:
    """Run a projector until interrupted."""
    parser = argparse.ArgumentParser(
        prog="python -m sim_devices.firmware pjlink",
        description="a simulated PJLink projector for a terminal program",
    )
    parser.add_argument("--port", type=int, default=4352, help="on 127.0.0.1; 0: any free one")
    parser.add_argument("--password", default="", help="of PJLink; empty: none")
    options = parser.parse_args(arguments)
    projector = PjlinkProjector(SystemClock(), password=options.password)
    server = PjlinkServer(projector, port=options.port)
    stopping = threading.Event()
    # Also where the shell that started it has interrupts ignored.
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stopping.set())
    server.start()
    print(f"PJLink projector on 127.0.0.1 port {server.port}; Ctrl-C ends it", flush=True)  # noqa: T201
    stopping.wait()
    server.close()


def _is_ready(stream: socket.socket) -> bool:
    return bool(select.select([stream], [], [], _TICK_S)[0])
