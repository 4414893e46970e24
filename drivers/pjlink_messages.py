"""PJLink class 1: formats requests and parses replies.

Source: the protocol's tables as the manufacturers print them. Class 2 and its SHA-256 greeting are
not spoken.
"""

import hashlib
import re
from dataclasses import dataclass

from drivers.interfaces import PowerState
from navapp.errors import DeviceError, DeviceProtocolError

PORT = 4352
# A reply has 136 bytes at most; what is longer is none.
MOST_REPLY_BYTES = 136

ON, STANDBY = "1", "0"
MUTED, LIT = "31", "30"
# Picture hidden: 1 video, 3 both; 2 is the sound alone.
_HIDDEN, _VISIBLE = frozenset({"11", "31"}), frozenset({"10", "20", "21", "30"})

_GREETING = re.compile(r"PJLINK (?:0|1 ([!-~]{8}))")
_REPLY = re.compile(r"%1([A-Za-z]{4}|[A-Za-z]{3}[0-9])=([ -~]*)")
_SOURCE = re.compile(r"[1-5][1-9]")
_LAMPS = re.compile(r"\d{1,5} [01](?: \d{1,5} [01]){0,7}")
_FAULTS = re.compile(r"[012]{6}")
_POWER = {
    STANDBY: PowerState.STANDBY,
    ON: PowerState.ON,
    "2": PowerState.COOLING,
    "3": PowerState.WARMING,
}
_PARTS = ("fan", "lamp", "temperature", "cover", "filter", "other")
_SEVERITY = ("", "warning", "error")


class PasswordRefused(DeviceError):  # noqa: N818 (named as its siblings)
    """The projector refuses the password; trying again does not help."""


@dataclass(frozen=True, slots=True)
class Reply:
    """Answer to one request: its value, or one of ERR1 to ERR4 and an empty value."""

    value: str
    error: str = ""


def salt_of(greeting: str) -> str:
    """Eight random characters to be digested with the password; empty when none is asked for.

    Raises:
        PasswordRefused, DeviceProtocolError.
    """
    _check_not_refused(greeting)
    match = _GREETING.fullmatch(greeting)
    if match is None:
        raise DeviceProtocolError(
            f"the projector greets with {greeting[:40]!r}, which is not PJLink class 1",
            subject="projector",
            remedy="set it to PJLink class 1, with or without a password",
        )
    return match[1] or ""


def compute_digest(salt: str, password: str) -> str:
    """What precedes the first request of a connection: MD5, 32 lower-case hexadecimal digits."""
    return hashlib.md5((salt + password).encode(), usedforsecurity=False).hexdigest()


def make_request(command: str, parameter: str) -> str:
    """One line, its end included; the parameter `?` asks."""
    return f"%1{command} {parameter}\r"


def parse_reply(line: str, command: str) -> Reply:
    """The answer to that command.

    Raises:
        PasswordRefused, DeviceProtocolError.
    """
    _check_not_refused(line)
    match = _REPLY.fullmatch(line)
    if match is None or match[1].upper() != command:
        raise DeviceProtocolError(
            f"the projector answers {line[:40]!r} to {command}", subject="projector"
        )
    value = match[2]
    if value.upper() in ("ERR1", "ERR2", "ERR3", "ERR4"):
        return Reply("", value.upper())
    return Reply(value)


def parse_power_state(value: str) -> PowerState:
    """Of a reply to POWR."""
    if value not in _POWER:
        raise _unreadable("power", value)
    return _POWER[value]


def is_hidden(value: str) -> bool:
    """Whether a reply to AVMT says that the picture is hidden."""
    if value not in _HIDDEN | _VISIBLE:
        raise _unreadable("mute", value)
    return value in _HIDDEN


def is_source(text: str) -> bool:
    """Whether it can be the name of a source: kind 1 to 5, number 1 to 9."""
    return _SOURCE.fullmatch(text) is not None


def parse_source(value: str) -> str:
    """Of a reply to INPT."""
    if not is_source(value):
        raise _unreadable("source", value)
    return value


def parse_lamp_hours(value: str) -> tuple[int, ...]:
    """Of a reply to LAMP."""
    if _LAMPS.fullmatch(value) is None:
        raise _unreadable("lamp hours", value)
    return tuple(int(hours) for hours in value.split()[::2])


def parse_faults(value: str) -> tuple[str, ...]:
    """Of a reply to ERST, such as «lamp error»."""
    if _FAULTS.fullmatch(value) is None:
        raise _unreadable("faults", value)
    return tuple(
        f"{part} {_SEVERITY[int(digit)]}"
        for part, digit in zip(_PARTS, value, strict=True)
        if digit != "0"
    )


def _check_not_refused(line: str) -> None:
    if line.upper() == "PJLINK ERRA":
        raise PasswordRefused(
            "the projector refuses the password",
            subject="projector",
            remedy="write the one of its network menu into [projector] password_file",
        )


def _unreadable(what: str, value: str) -> DeviceProtocolError:
    return DeviceProtocolError(
        f"the projector's {what} cannot be read from {value[:40]!r}", subject="projector"
    )
