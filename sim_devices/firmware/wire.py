"""A simulated cable between firmware and driver that can split, delay, lose or spoil messages."""

import random
from collections import deque
from collections.abc import Callable, Sequence
from typing import Protocol

from drivers.clock import Clock

# Pieces of one message: how long after the one before, ns, and the bytes.
Pieces = Sequence[tuple[int, bytes]]
Spoiler = Callable[[bytes], Pieces]


class Firmware(Protocol):
    """Protocol of a simulated device's firmware."""

    def receive(self, data: bytes) -> None:
        """Take bytes in; never fails."""
        ...

    def messages(self) -> list[bytes]:
        """What it has sent since the last call, message by message."""
        ...

    def next_ns(self) -> int | None:
        """When it will do something by itself; None when only a command makes it."""
        ...


class Wire:
    """Carries bytes between a firmware and a driver, both ways.

    Attributes:
        firmware: at its far end.
        spoiler: what happens to each of the device's messages.
        command_spoiler: what happens to bytes on their way to the device.
        is_connected: the plug is in.
    """

    def __init__(self, firmware: Firmware, clock: Clock) -> None:
        self.firmware = firmware
        self._clock = clock
        self._under_way: deque[tuple[int, bytes]] = deque()
        self.spoiler: Spoiler = whole
        self.command_spoiler: Callable[[bytes], bytes] = bytes
        self.is_connected = True

    @property
    def clock(self) -> Clock:
        """On which bytes travel."""
        return self._clock

    def receive(self, data: bytes) -> None:
        """From the driver."""
        self.firmware.receive(self.command_spoiler(data))

    def say(self, data: bytes) -> None:
        """Bytes that nobody asked for, now."""
        self._put([(0, data)])

    def take_arrived(self) -> bytes:
        """What has reached the driver's end since the last call."""
        for message in self.firmware.messages():
            self._put(self.spoiler(message))
        out = bytearray()
        while self._under_way and self._under_way[0][0] <= self._clock.now_ns():
            out += self._under_way.popleft()[1]
        return bytes(out)

    def next_ns(self) -> int | None:
        """When something more may arrive by itself."""
        moments = [self.firmware.next_ns(), self._under_way[0][0] if self._under_way else None]
        return min((moment for moment in moments if moment is not None), default=None)

    def _put(self, pieces: Pieces) -> None:
        # A cable never changes the order.
        moment_ns = max(self._clock.now_ns(), self._under_way[-1][0] if self._under_way else 0)
        for delay_ns, data in pieces:
            moment_ns += delay_ns
            self._under_way.append((moment_ns, data))


def whole(message: bytes) -> Pieces:
    """As it was sent."""
    return [(0, message)]


def lose(message: bytes) -> Pieces:
    """Never comes."""
    return []


def double(message: bytes) -> Pieces:
    """Comes twice."""
    return [(0, message), (0, message)]


def split(gap_s: float) -> Spoiler:
    """Comes byte by byte."""
    gap_ns = round(gap_s * 1e9)
    return lambda message: [(gap_ns, message[i : i + 1]) for i in range(len(message))]


def late(delay_s: float) -> Spoiler:
    """Comes after that time."""
    return lambda message: [(round(delay_s * 1e9), message)]


def precede_by(noise: bytes) -> Spoiler:
    """Other bytes come just before."""
    return lambda message: [(0, noise + message)]


def corrupt(random_bits: random.Random) -> Spoiler:
    """One bit is turned."""

    def spoil(message: bytes) -> Pieces:
        changed = bytearray(message)
        changed[random_bits.randrange(len(changed))] ^= 1 << random_bits.randrange(8)
        return [(0, bytes(changed))]

    return spoil


def first(n: int, spoiler: Spoiler) -> Spoiler:
    """The next n messages are spoilt, the others come whole."""
    left = [spoiler] * n
    return lambda message: (left.pop() if left else whole)(message)
