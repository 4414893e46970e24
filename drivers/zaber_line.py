"""Zaber's ASCII protocol on a line: numbered commands, replies, alerts and checksums.

Sources: Zaber's ASCII Protocol Manual; the open library zproto. Every command carries a number and
a checksum; a reply counts only with that number, so that late, doubled and damaged ones do no harm.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass

from drivers.clock import Clock
from drivers.serial_line import SerialLine
from drivers.serial_port import Address
from navapp.errors import DeviceProtocolError, DeviceTimeout, UnsupportedControl

BAUD_RATE = 115_200

_ANSWER_S = 0.5
_MOST_UNASKED = 64
_NO_WARNING = "--"
_REPLY = re.compile(r"@(\d{1,2}) (\d) (\d{2}) (OK|RJ) (IDLE|BUSY) (--|[A-Z][A-Z0-9]) ([ -9;-~]+)")
_ALERT = re.compile(r"!(\d{1,2}) (\d) (IDLE|BUSY) (--|[A-Z][A-Z0-9])")
_REJECTIONS = {
    "BADCOMMAND": "it knows no such command",
    "BADDATA": "the value is out of its range",
    "BADAXIS": "it has no such axis",
    "BADMESSAGEID": "the command's number is wrong",
    "AGAIN": "it cannot just now",
    "STATUSBUSY": "it is moving",
    "DEVICEONLY": "that is not for an axis",
    "AXISONLY": "that is for an axis",
    "FULL": "it has no room for more commands",
    "LOCKSTEP": "the axis is locked to another one",
    "NOACCESS": "access is not allowed",
    "PARKED": "it is parked",
    "DRIVERDISABLED": "its motor driver is off",
    "REMOTE": "another controller is in charge",
}


@dataclass(frozen=True, slots=True)
class Reply:
    """What the device answered."""

    is_busy: bool  # the axis moves
    warning: str  # two letters, the most urgent one; empty for none
    data: str  # what was asked for; of a rejection its reason
    is_accepted: bool  # not rejected


class ZaberLine:
    """Gives commands to one axis of one device.

    Attributes:
        line: of bytes; its lock is held over a command and its reply.
    """

    def __init__(
        self, address: Address, clock: Clock, axis: tuple[int, int], on_alert: Callable[[str], None]
    ) -> None:
        self.line = SerialLine(address, clock, "mirror", b"\n")
        self._device, self._axis = axis
        self._on_alert = on_alert
        self._number = 0
        self._needs_checksum = False

    def open(self) -> None:
        """Connect; nothing happens when open.

        Raises:
            DeviceNotFound, DeviceLost, DeviceProtocolError.
        """
        with self.line.lock:
            if self.line.is_open:
                return
            self.line.open()
            self._needs_checksum = False
            try:
                self.line.discard()
                # Ends a command that was left half sent.
                self.line.send(b"\n")
                self.line.discard()
            except BaseException:
                self.line.close()
                raise

    def ask(self, command: str, *, of_device: bool = False) -> Reply:
        """Give a command that may be given twice, and once more when its reply is missing.

        Raises:
            DeviceLost, DeviceTimeout, DeviceProtocolError.
        """
        with self.line.lock:
            try:
                return self.give(command, of_device=of_device)
            except (DeviceTimeout, DeviceProtocolError):
                return self.give(command, of_device=of_device)

    def give(self, command: str, *, of_device: bool = False) -> Reply:
        """Give a command and wait for its reply, accepted or not.

        Raises:
            DeviceLost, DeviceTimeout; DeviceProtocolError: nothing but damaged replies.
        """
        with self.line.lock:
            self._number = (self._number + 1) % 100
            axis = 0 if of_device else self._axis
            key = (self._device, axis, self._number)
            words = f"/{self._device} {axis} {self._number:02d} {command}".rstrip()
            self.line.send(f"{words}:{compute_checksum(words[1:])}\n".encode("ascii"))
            return self._reply(key, self.line.deadline_ns(_ANSWER_S))

    def value(self, name: str, form: re.Pattern[str], *, of_device: bool = False) -> str:
        """A setting as text of that form.

        Raises:
            UnsupportedControl: it has no such setting.
            DeviceLost, DeviceTimeout, DeviceProtocolError.
        """
        reply = self.ask(f"get {name}", of_device=of_device)
        if not reply.is_accepted:
            raise make_rejection(f"get {name}", reply.data)
        if form.fullmatch(reply.data) is None:
            raise _misunderstood(f"{name} = {reply.data}")
        return reply.data

    def close(self) -> None:
        """Disconnect; never fails."""
        self.line.close()

    def _reply(self, key: tuple[int, int, int], deadline_ns: int) -> Reply:
        damaged = ""
        for _ in range(_MOST_UNASKED):
            packet = self.line.next(deadline_ns)
            if packet is None:
                break
            text = self._unwrap(packet.decode("latin-1"))
            if text.startswith("!"):
                self._hear(text)
            elif (match := _REPLY.fullmatch(text)) is None:
                damaged = packet.decode("latin-1") if not text.startswith("#") else damaged
            elif key == (int(match[1]), int(match[2]), int(match[3])):
                warning = match[6].replace(_NO_WARNING, "")
                return Reply(match[5] == "BUSY", warning, match[7], match[4] == "OK")
        raise _misunderstood(damaged) if damaged else self.line.silence()

    def _hear(self, text: str) -> None:
        match = _ALERT.fullmatch(text)
        if match is not None and (int(match[1]), int(match[2])) == (self._device, self._axis):
            self._on_alert(match[4].replace(_NO_WARNING, ""))

    def _unwrap(self, text: str) -> str:
        """A packet from its first character on, without checksum; empty when that is wrong."""
        text = text.rstrip("\r")
        text = text[max(0, *(text.rfind(mark) for mark in "@#!")) :]
        if text[-3:-2] == ":":
            if compute_checksum(text[1:-3]) != text[-2:]:
                return ""
            self._needs_checksum = True
            return text[:-3]
        return "" if self._needs_checksum else text


def compute_checksum(text: str) -> str:
    """Two hexadecimal digits: with them the bytes between first character and colon sum to 0."""
    return f"{-sum(text.encode('latin-1')) & 0xFF:02X}"


def make_rejection(command: str, word: str) -> UnsupportedControl:
    """The error of a rejected command."""
    why = _REJECTIONS.get(word, "for an unknown reason")
    return UnsupportedControl(f"the mirror rejects '{command}': {why} ({word})", subject="mirror")


def _misunderstood(text: str) -> DeviceProtocolError:
    return DeviceProtocolError(
        f"the mirror answers {text[:60]!r}",
        subject="mirror",
        remedy="check the cable and that the device speaks Zaber ASCII",
    )
