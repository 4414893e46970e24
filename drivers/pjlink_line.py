"""One connection to a PJLink projector: who greets whom, and one question at a time.

After any trouble the connection is over: an answer that comes late dies with it and can never be
taken for the answer to the next question.
"""

import contextlib
import socket
from collections.abc import Callable
from typing import Protocol

from drivers.clock import Clock
from drivers.pjlink_messages import (
    MOST_REPLY_BYTES,
    PasswordRefused,
    Reply,
    compute_digest,
    make_request,
    parse_reply,
    salt_of,
)
from navapp.errors import DeviceLost, DeviceNotFound, DeviceProtocolError, DeviceTimeout

_CONNECT_S, _REPLY_S = 3.0, 5.0
_HUNG_UP = "it has hung up"


class Connection(Protocol):
    """A stream of bytes to a projector; the seam at which tests put theirs."""

    def send(self, data: bytes) -> None:
        """All of it, or OSError."""
        ...

    def receive(self, timeout_s: float) -> bytes:
        """What has come, empty at the end of the stream; OSError, of which TimeoutError is one."""
        ...

    def close(self) -> None:
        """Never fails."""
        ...


# Makes a connection within so many seconds; DeviceNotFound when nothing answers.
Connect = Callable[[float], Connection]


class TcpConnection:
    """Over the network.

    Raises:
        DeviceNotFound: nothing answers there.
    """

    def __init__(self, host: str, port: int, timeout_s: float) -> None:
        try:
            self._socket = socket.create_connection((host, port), timeout_s)
        except (OSError, UnicodeError) as error:
            raise DeviceNotFound(
                f"no projector answers at {host} port {port} ({error})",
                subject=host,
                remedy="check its address, its cable, and that its PJLink is on also in standby",
            ) from error

    def send(self, data: bytes) -> None:
        """All of it."""
        self._socket.sendall(data)

    def receive(self, timeout_s: float) -> bytes:
        """What has come."""
        self._socket.settimeout(max(timeout_s, 1e-3))
        return self._socket.recv(4096)

    def close(self) -> None:
        """Hang up."""
        with contextlib.suppress(OSError):
            self._socket.close()


class PjlinkLine:
    """An authenticated connection, to be closed as soon as its questions are asked.

    Raises:
        DeviceNotFound, DeviceLost, DeviceTimeout, DeviceProtocolError, PasswordRefused.
    """

    def __init__(self, connect: Connect, password: str, clock: Clock, until_ns: int) -> None:
        self._clock = clock
        self._until_ns = until_ns
        self._received = b""
        left_s = (until_ns - clock.now_ns()) / 1e9
        if left_s <= 0.0:
            raise _silent()
        self._connection = connect(min(_CONNECT_S, left_s))
        try:
            self._prefix = self._authentication(password)
        except BaseException:
            self.close()
            raise

    def ask(self, command: str, parameter: str = "?") -> Reply:
        """Send one request and wait for its answer."""
        line = self._prefix + make_request(command, parameter)
        self._prefix = ""
        try:
            self._connection.send(line.encode())
        except OSError as error:
            raise _make_lost_error(_cause(error)) from error
        return parse_reply(self._line(), command)

    def close(self) -> None:
        """Hang up."""
        self._connection.close()

    def _authentication(self, password: str) -> str:
        salt = salt_of(self._line())
        if salt and not password:
            raise PasswordRefused(
                "the projector wants a password",
                subject="projector",
                remedy="write the one of its network menu into [projector] password_file",
            )
        return compute_digest(salt, password) if salt else ""

    def _line(self) -> str:
        """The next line that the projector says."""
        end_ns = min(self._until_ns, self._clock.now_ns() + round(_REPLY_S * 1e9))
        while b"\r" not in self._received:
            if len(self._received) > MOST_REPLY_BYTES:
                raise DeviceProtocolError("the projector's answer has no end", subject="projector")
            self._received += self._more((end_ns - self._clock.now_ns()) / 1e9)
        line, _, self._received = self._received.partition(b"\r")
        if self._received:
            # It may speak only when asked: what follows would answer the next question.
            raise DeviceProtocolError(
                "the projector says more than one answer", subject="projector"
            )
        return line.decode("ascii", "replace")

    def _more(self, timeout_s: float) -> bytes:
        if timeout_s <= 0.0:
            raise _silent()
        try:
            data = self._connection.receive(timeout_s)
        except TimeoutError as error:
            raise _silent() from error
        except OSError as error:
            raise _make_lost_error(_cause(error)) from error
        if not data:
            raise _make_lost_error(_HUNG_UP)
        return data


def _silent() -> DeviceTimeout:
    return DeviceTimeout(
        "the projector is connected but does not answer",
        subject="projector",
        remedy="end other programs that control it: most projectors serve one at a time",
    )


def _cause(error: OSError) -> str:
    """Whether a stream ends quietly, is reset or is a broken pipe is a matter of microseconds."""
    return _HUNG_UP if isinstance(error, ConnectionError) else str(error)


def _make_lost_error(why: str) -> DeviceLost:
    return DeviceLost(f"the connection to the projector is lost ({why})", subject="projector")
