"""A projector that is controlled over the network by PJLink class 1.

Every call connects, asks and hangs up, as the protocol wants it: a projector closes an idle
connection after 30 s anyway, and most serve one controller at a time.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from drivers.clock import Clock
from drivers.interfaces import CommandResult, PowerState, ProjectorStatus
from drivers.pjlink_line import Connect, PjlinkLine
from drivers.pjlink_messages import (
    LIT,
    MUTED,
    ON,
    STANDBY,
    Reply,
    is_hidden,
    is_source,
    parse_faults,
    parse_lamp_hours,
    parse_power_state,
    parse_source,
)
from navapp.errors import (
    DeviceError,
    DeviceLost,
    DeviceNotFound,
    DeviceProtocolError,
    DeviceTimeout,
    UnsupportedControl,
    WrongDevice,
)

_POLL_NS = 1_000_000_000
# A projector that did not take a command to heart is told again, but not in the middle of obeying.
_RESEND_NS = 10_000_000_000
_STATUS_S = 10.0
# Its name, its maker, its product: what class 1 has instead of a serial number.
_IDENTITY = ("NAME", "INF1", "INF2")
_TROUBLE = (DeviceLost, DeviceNotFound, DeviceTimeout, DeviceProtocolError)


@dataclass(frozen=True, slots=True)
class _Wish:
    """A command, how its effect is read back, and what the projector is asked for."""

    name: str
    command: str
    parameter: str
    is_met: Callable[[str], bool]


class PjlinkProjector:
    """Speaks PJLink class 1, which has neither flips nor a serial number.

    It is bound to the first name, maker and product that it tells; they are asked for at opening
    and with every status.

    A command is VERIFIED when two questions after it, one after the other, are answered as it
    should be (the protocol has no checksum), ACCEPTED when the projector said OK and it did not
    come to that in time. PJLink has no answer that would mean FINISHED.
    """

    def __init__(self, address: str, clock: Clock, connect: Connect, password: str = "") -> None:
        """A projector that is not connected yet.

        Args:
            address: for people.
            clock: by which it waits.
            connect: makes a new connection.
            password: of PJLink, empty for none; appears in no message.
        """
        self._address = f"projector at {address}"
        self._clock = clock
        self._connect = connect
        self._password = password
        self._is_open = False
        self._identity: dict[str, str] = {}

    @property
    def name(self) -> str:
        """The one that the projector carries, once it has told it."""
        return self._identity.get("NAME", self._address)

    def open(self) -> None:
        """Connect once, to see that it is there and takes the password.

        Raises:
            DeviceNotFound, DeviceLost, DeviceTimeout, DeviceProtocolError, WrongDevice; DeviceError
            for a password that is refused.
        """
        if self._is_open:
            return
        with self._line(self._until_ns(_STATUS_S)) as line:
            line.ask("POWR")
            self._require_same(line)
        self._is_open = True

    def set_power(self, is_on: bool, timeout_s: float) -> CommandResult:
        """Lamp on or off, its minutes of warming or cooling included."""
        goal = ON if is_on else STANDBY
        return self._bring_about(
            _Wish("power", "POWR", goal, lambda value: value == goal), timeout_s
        )

    def set_source(self, source: str, timeout_s: float) -> CommandResult:
        """Choose a source: 1 to 5 (RGB, video, digital, storage, network) and its number."""
        self._check_open()
        if not is_source(source):
            raise UnsupportedControl(
                f"'{source[:40]}' is no PJLink source",
                subject=self.name,
                remedy="give two digits, such as 31 for the first digital input",
            )
        wish = _Wish("source", "INPT", source, lambda value: value == source)
        return self._bring_about(wish, timeout_s)

    def set_mute(self, is_muted: bool, timeout_s: float) -> CommandResult:
        """Hide the picture, and the sound with it."""
        wish = _Wish(
            "mute",
            "AVMT",
            MUTED if is_muted else LIT,
            lambda value: is_hidden(value) is is_muted,
        )
        return self._bring_about(wish, timeout_s)

    def set_flips(self, horizontally: bool, vertically: bool, timeout_s: float) -> CommandResult:
        """Refused: PJLink does not know them."""
        self._check_open()
        raise UnsupportedControl(
            f"{self.name} cannot be told over PJLink to mirror its picture",
            subject=self.name,
            remedy="set it in the projector's own menu",
        )

    def status(self) -> ProjectorStatus:
        """Read everything back that PJLink tells."""
        self._check_open()
        with self._line(self._until_ns(_STATUS_S)) as line:
            self._require_same(line)
            power, mute, chosen = (line.ask(name) for name in ("POWR", "AVMT", "INPT"))
            found, hours = line.ask("ERST"), line.ask("LAMP")
        return ProjectorStatus(
            power=_power(power),
            source=parse_source(chosen.value) if not chosen.error else None,
            is_muted=is_hidden(mute.value) if not mute.error else None,
            lamp_hours=parse_lamp_hours(hours.value) if not hours.error else (),
            faults=parse_faults(found.value) if not found.error else (),
        )

    def close(self) -> None:
        """Ask nothing any more."""
        self._is_open = False

    def _bring_about(self, wish: _Wish, timeout_s: float) -> CommandResult:
        """Ask for it until it is so or the time is over; what goes wrong meanwhile is tried again.

        A projector may hang up, stay silent or refuse while its lamp warms or cools.
        """
        self._check_open()
        until_ns, told_ns = self._until_ns(timeout_s), None
        trouble = late = self._late(wish)
        while (now_ns := self._clock.now_ns()) < until_ns:
            try:
                with self._line(until_ns) as line:
                    is_so = self._is_so(line, wish)
                    is_due = told_ns is None or now_ns - told_ns >= _RESEND_NS
                    if not is_so and is_due and self._takes(line, wish):
                        told_ns, is_so = now_ns, self._is_so(line, wish)
                if is_so:
                    return CommandResult.VERIFIED
                if is_so is None and told_ns is not None:
                    return CommandResult.ACCEPTED
                trouble = late
            except _TROUBLE as error:
                trouble = error
            self._clock.wait_until_ns(min(until_ns, self._clock.now_ns() + _POLL_NS))
        if told_ns is None:
            raise trouble
        return CommandResult.ACCEPTED

    def _require_same(self, line: PjlinkLine) -> None:
        for command in _IDENTITY:
            told = line.ask(command).value
            bound = self._identity.get(command)
            # What is not expected is believed when it is told twice: there is no checksum.
            if told in ("", bound) or line.ask(command).value != told:
                continue
            if self._identity.setdefault(command, told) != told:
                self.close()
                raise WrongDevice(
                    f"the projector calls itself {told[:40]!r}, the session's is {bound!r}",
                    subject=self.name,
                    remedy="connect the session's projector, or begin a new session",
                )

    def _is_so(self, line: PjlinkLine, wish: _Wish) -> bool | None:
        """Whether two answers agree that it is as wished; None when it cannot be asked."""
        for _ in range(2):
            answer = line.ask(wish.command)
            if answer.error == "ERR1":
                return None
            if answer.error or not wish.is_met(answer.value):
                return False
        return True

    def _takes(self, line: PjlinkLine, wish: _Wish) -> bool:
        """Give the command; False when the projector is not ready for it yet."""
        answer = line.ask(wish.command, wish.parameter)
        if answer.value.upper() == "OK":
            return True
        if answer.error == "ERR4":
            raise DeviceError(
                f"{self.name} reports a failure", subject=self.name, remedy="see its own lamps"
            )
        if answer.error == "ERR3":
            if wish.command != "POWR" and line.ask("POWR").value == STANDBY:
                raise self._make_refusal(wish, "in standby", "switch it on first")
            return False
        if answer.error:
            raise self._make_refusal(wish, f"({answer.error})", "see its manual for what it has")
        raise DeviceProtocolError(
            f"the projector answers {answer.value[:40]!r} to {wish.command}", subject=self.name
        )

    def _make_refusal(self, wish: _Wish, how: str, remedy: str) -> UnsupportedControl:
        return UnsupportedControl(
            f"{self.name} does not take its {wish.name} to be set {how}",
            subject=self.name,
            remedy=remedy,
        )

    def _late(self, wish: _Wish) -> DeviceError:
        return DeviceTimeout(
            f"{self.name} was not ready in time to set its {wish.name}", subject=self.name
        )

    def _check_open(self) -> None:
        if not self._is_open:
            raise DeviceLost(
                f"{self.name} is not open", subject=self.name, remedy="open it before use"
            )

    def _until_ns(self, timeout_s: float) -> int:
        return self._clock.now_ns() + round(timeout_s * 1e9)

    @contextmanager
    def _line(self, until_ns: int) -> Iterator[PjlinkLine]:
        line = PjlinkLine(self._connect, self._password, self._clock, until_ns)
        try:
            yield line
        finally:
            line.close()


def _power(answer: Reply) -> PowerState:
    if answer.error:
        return PowerState.FAULT if answer.error == "ERR4" else PowerState.UNKNOWN
    return parse_power_state(answer.value)
