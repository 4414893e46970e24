"""A serial port's bytes, and the one place that knows how pyserial fails.

What pyserial raises when a line goes away depends on the call (SerialException, OSError,
termios.error, TypeError, ValueError); here it becomes DeviceNotFound while opening and DeviceLost
afterwards. A port is closed by the thread that reads it.
"""

import errno
import os
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from navapp.errors import DeviceError, DeviceLost, DeviceNotFound, DeviceTimeout

if TYPE_CHECKING:
    from serial import Serial

_WRITE_LIMIT_S = 2.0


class Port(Protocol):
    """An open line of bytes."""

    def read(self, timeout_s: float) -> bytes:
        """What has come, at least one byte; empty when nothing came within the time.

        Raises:
            DeviceLost: the other end is gone.
        """
        ...

    def write(self, data: bytes) -> None:
        """Send all.

        Raises:
            DeviceLost: the other end is gone. DeviceTimeout: it takes nothing.
        """
        ...

    def close(self) -> None:
        """Release; never fails."""
        ...


class Address(Protocol):
    """Where a port is, and how it is opened."""

    @property
    def name(self) -> str:
        """For people."""
        ...

    @property
    def is_simulated(self) -> bool:
        """No cable: a program answers."""
        ...

    def open(self) -> Port:
        """A fresh port.

        Raises:
            DeviceNotFound: nothing can be opened there.
        """
        ...


@dataclass(frozen=True, slots=True)
class SerialAddress:
    """A port of this machine (`/dev/serial/by-id/...`) or of the network (`socket://host:port`)."""

    name: str  # path or URL
    baud_rate: int  # 8 data bits, no parity, one stop bit, no flow control

    @property
    def is_simulated(self) -> bool:
        """A pseudo-terminal is no cable."""
        return os.path.realpath(self.name).startswith("/dev/pts/")

    def open(self) -> "SerialPort":
        """Open for this program alone.

        Raises:
            DeviceNotFound: with the reason and what to do.
        """
        return SerialPort(self.name, self.baud_rate)


class SerialPort:
    """An open port of pyserial."""

    def __init__(self, name: str, baud_rate: int) -> None:
        self._name = name
        self._serial = _open_serial(name, baud_rate)

    def read(self, timeout_s: float) -> bytes:
        """What has come; waits for the first byte only, because a socket waits for all."""
        port = self._serial
        try:
            port.timeout = max(0.0, timeout_s)
            first = port.read(1)
            # A closed socket still says that one byte waits: the next read then tells.
            rest = port.read(port.in_waiting) if first and port.in_waiting else b""
        except _failures() as error:
            raise self._make_lost_error(error) from error
        return bytes(first + rest)

    def write(self, data: bytes) -> None:
        """Send all within two seconds."""
        from serial import SerialTimeoutException

        try:
            self._serial.write(data)
        except SerialTimeoutException as error:
            raise DeviceTimeout(
                f"{self._name} takes no more bytes",
                subject=self._name,
                remedy="check that the device is switched on",
            ) from error
        except _failures() as error:
            raise self._make_lost_error(error) from error

    def close(self) -> None:
        """Release; a line that is gone cannot be flushed, which does not matter any more."""
        # Of a socket that was reset pyserial only forgets the handle.
        handle = getattr(self._serial, "_socket", None)
        with suppress(*_failures()):
            if handle is not None:
                handle.close()
            self._serial.close()

    def _make_lost_error(self, error: Exception) -> DeviceLost:
        return DeviceLost(
            f"the line {self._name} is gone ({error})",
            subject=self._name,
            remedy="check the cable and the device's mains",
        )


def _failures() -> tuple[type[Exception], ...]:
    """All that pyserial lets through when a line fails; see the module's words."""
    import termios

    from serial import SerialException

    return (SerialException, OSError, termios.error, TypeError, ValueError)


def _open_serial(name: str, baud_rate: int) -> "Serial":
    try:
        import serial
    except ImportError as error:
        raise DeviceError(
            "serial lines need the package pyserial", subject=name, remedy="install pyserial"
        ) from error
    try:
        port = serial.serial_for_url(
            name, baud_rate, do_not_open=True, timeout=0.0, write_timeout=_WRITE_LIMIT_S
        )
        if "://" not in name:
            # Of two programs that both ask for it alone, the second is refused.
            port.exclusive = True
        port.open()
        return port
    except _failures() as error:
        number = getattr(error, "errno", None)
        why = os.strerror(number) if number else str(error)
        raise DeviceNotFound(
            f"the line {name} cannot be opened ({why})",
            subject=name,
            remedy=_REMEDIES.get(number, "check the port in the settings"),
        ) from error


_REMEDIES: dict[int | None, str] = {
    errno.ENOENT: "connect the device, or check the port in the settings",
    errno.EACCES: "add the user to the group dialout and log in again",
    errno.EAGAIN: "close the other program that uses it",
    errno.EBUSY: "close the other program that uses it",
}
