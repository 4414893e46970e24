"""Requests and answers on a serial line; received bytes are split at the terminator."""

import threading

from drivers.clock import Clock
from drivers.serial_port import Address, Port
from navapp.errors import DeviceLost, DeviceProtocolError, DeviceTimeout

_LONGEST_PACKET = 1024
# A line is quiet when nothing comes for this long: 20 characters at 9600 baud.
_QUIET_S = 0.02
# Whoever sends unasked for this long, some 40 events at 9600 baud, never stops.
_LONGEST_DISCARD_S = 2.0


class SerialLine:
    """One request and one answer at a time; many threads may ask, one after the other.

    Attributes:
        lock: held over a request and its answer.
    """

    def __init__(self, address: Address, clock: Clock, subject: str, terminator: bytes) -> None:
        self._address = address
        self._clock = clock
        self._subject = subject
        self._terminator = terminator
        self._port: Port | None = None
        self._received = bytearray()
        self.lock = threading.RLock()

    @property
    def address(self) -> Address:
        """Where it leads."""
        return self._address

    @property
    def is_open(self) -> bool:
        """It was opened and not lost since."""
        return self._port is not None

    def open(self) -> None:
        """Open with nothing received; nothing happens when open.

        Raises:
            DeviceNotFound: see `Address.open`.
        """
        with self.lock:
            if self._port is None:
                self._received.clear()
                self._port = self._address.open()

    def deadline_ns(self, timeout_s: float) -> int:
        """The moment when that time is over."""
        return self._clock.now_ns() + round(timeout_s * 1e9)

    def remaining_s(self, deadline_ns: int) -> float:
        """How long until then, not below zero."""
        return max(0, deadline_ns - self._clock.now_ns()) / 1e9

    def send(self, data: bytes) -> None:
        """Send all.

        Raises:
            DeviceLost: not open, or gone; it is closed then. DeviceTimeout: it takes nothing.
        """
        port = self._require_port()
        try:
            port.write(data)
        except DeviceLost:
            self.close()
            raise

    def next(self, deadline_ns: int) -> bytes | None:
        """The next packet without its terminator; None when it is not complete by then.

        Raises:
            DeviceLost: not open, or gone; it is closed then.
            DeviceProtocolError: a packet without end; it is forgotten.
        """
        while True:
            end = self._received.find(self._terminator)
            if end >= 0:
                packet = bytes(self._received[:end])
                del self._received[: end + len(self._terminator)]
                return packet
            if len(self._received) > _LONGEST_PACKET:
                self._received.clear()
                raise DeviceProtocolError(
                    f"the {self._subject} sends without end", subject=self._subject
                )
            if not self._receive(self.remaining_s(deadline_ns)):
                return None

    def take(self, n_bytes: int, deadline_ns: int) -> bytes | None:
        """So many bytes, whatever they are; None when they have not come by then.

        Raises:
            DeviceLost: not open, or gone; it is closed then.
        """
        while len(self._received) < n_bytes:
            if not self._receive(self.remaining_s(deadline_ns)):
                return None
        data = bytes(self._received[:n_bytes])
        del self._received[:n_bytes]
        return data

    def discard(self) -> None:
        """Forget what has come, and what comes until the line is quiet.

        Raises:
            DeviceLost: not open, or gone. DeviceProtocolError: it is never quiet.
        """
        deadline_ns = self.deadline_ns(_LONGEST_DISCARD_S)
        self._received.clear()
        while self._receive(_QUIET_S):
            self._received.clear()
            if self._clock.now_ns() >= deadline_ns:
                raise DeviceProtocolError(
                    f"the {self._subject} never stops sending", subject=self._subject
                )

    def close(self) -> None:
        """Release; never fails."""
        with self.lock:
            # Whoever reads it meanwhile must see that it is closed.
            port, self._port = self._port, None
            if port is not None:
                port.close()

    def silence(self) -> DeviceTimeout:
        """The error of an answer that did not come."""
        return DeviceTimeout(
            f"the {self._subject} at {self._address.name} does not answer",
            subject=self._subject,
            remedy="check its cable, its mains and its state",
        )

    def absence(self) -> DeviceLost:
        """The error of a line that is not open."""
        return DeviceLost(
            f"the {self._subject} at {self._address.name} is not connected",
            subject=self._subject,
            remedy="check its cable, then open it again",
        )

    def _receive(self, timeout_s: float) -> bool:
        port = self._require_port()
        try:
            data = port.read(timeout_s)
        except DeviceLost:
            self.close()
            raise
        if self._port is not port:
            # Closed by another thread, a read may end as if nothing had come.
            raise self.absence()
        self._received += data
        return bool(data)

    def _require_port(self) -> Port:
        if self._port is None:
            raise self.absence()
        return self._port
