"""A projector's control line that speaks ESC/VP21: Epson's, over RS-232, USB or a socket.

Source: ESC/VP21 Command User's Guide for Business Projectors. Models differ widely, so nothing is
assumed to have happened: a colon says that a command was accepted or executed, and only what was
read back twice in a row is called verified, because the protocol has no checksum.
"""

import re
from collections.abc import Callable
from typing import TypeVar

from drivers.clock import Clock
from drivers.escvp21_codes import parse_faults, parse_power_state
from drivers.escvp21_line import EscVp21Line
from drivers.interfaces import CommandResult, PowerState, ProjectorStatus
from drivers.serial_port import Address
from navapp.errors import DeviceProtocolError, DeviceTimeout, UnsupportedControl, WrongDevice

BAUD_RATE = 9600
SILENT = "does not answer: busy with its lamp, abnormal (lamp, heat), without mains or cable"

_HEX, _SWITCH = re.compile("[0-9A-F]{2}"), re.compile("ON|OFF")
_KEYSTONE, _HOURS = re.compile(r"\d{1,3}"), re.compile(r"\d{1,6}( \d{1,6})*")
_SERIAL = re.compile(r"[\x21-\x7e]{1,32}")
_PASSING = (PowerState.WARMING, PowerState.COOLING)
_POLL_NS = 1_000_000_000
_SOURCE_S, _SETTING_S = 5.0, 3.0

T = TypeVar("T")


class EscVp21Projector:
    """A projector bound to a serial number: the given one, otherwise the first that is read.

    It can be read only while the lamp is on; nothing is verified in whose course it was not.
    """

    def __init__(self, address: Address, clock: Clock, serial: str = "") -> None:
        self._talk = EscVp21Line(address, clock)
        self._address = address
        self._clock = clock
        self._serial = serial
        self._whose = "rig" if serial else "session"

    @property
    def name(self) -> str:
        """For people."""
        mark = "sim:" if self._address.is_simulated else ""
        return f"{mark}ESC/VP21 projector {self._serial or self._address.name}"

    def open(self) -> None:
        """Connect, and refuse another projector than the bound one.

        Raises:
            DeviceNotFound, DeviceLost, DeviceProtocolError, WrongDevice.
            DeviceTimeout: silent, which is never just off.
        """
        if self._talk.line.is_open:
            return
        self._talk.open()
        try:
            if self._power() is PowerState.ON:
                self._read_serial()
        except BaseException:
            self.close()
            raise

    def set_power(self, is_on: bool, timeout_s: float) -> CommandResult:
        """Lamp on or off.

        A lamp that is warming or cooling is waited for first, because the command would be refused
        or lost. Going on takes 40 s as a rule, 100 s when the lamp does not catch at once.
        ACCEPTED: the lamp is not there yet; FINISHED: it is on (or out), but not proven. One that
        was out before does not tell whose it is.
        """
        deadline_ns = self._deadline_ns(timeout_s)
        wanted = PowerState.ON if is_on else PowerState.STANDBY
        power = self._wait_for_power(deadline_ns)
        if power in _PASSING:
            raise DeviceTimeout(
                f"the projector is still {power.value}", subject="projector", remedy="wait for it"
            )
        serial = self._read_serial() if power is PowerState.ON else ""
        if power is not wanted:
            command = "PWR ON" if is_on else "PWR OFF"
            self._talk.tell(command, self._talk.line.remaining_s(deadline_ns))
            power = self._wait_for_power(deadline_ns)
            serial = self._read_serial() if power is PowerState.ON else serial
        if power is not wanted:
            is_out = not is_on and power is PowerState.COOLING
            return CommandResult.FINISHED if is_out else CommandResult.ACCEPTED
        is_proven = serial and self._power() is wanted
        return CommandResult.VERIFIED if is_proven else CommandResult.FINISHED

    def set_source(self, source: str, timeout_s: float) -> CommandResult:
        """Choose the picture source, two hexadecimal digits: `30` is HDMI 1, `A0` HDMI 2."""
        if _HEX.fullmatch(source) is None:
            raise UnsupportedControl(
                f"'{source}' is no source of an ESC/VP21 projector",
                subject="projector",
                remedy="give two hexadecimal digits, for example 30",
            )
        return self._set("SOURCE", source, _HEX, min(timeout_s, _SOURCE_S))

    def set_mute(self, is_muted: bool, timeout_s: float) -> CommandResult:
        """Hide picture and sound."""
        return self._switch("MUTE", is_muted, timeout_s)

    def set_flips(self, horizontally: bool, vertically: bool, timeout_s: float) -> CommandResult:
        """Mirror the picture; the weaker of both results."""
        results = (
            self._switch("HREVERSE", horizontally, timeout_s),
            self._switch("VREVERSE", vertically, timeout_s),
        )
        return min(results, key=list(CommandResult).index)

    def status(self) -> ProjectorStatus:
        """Read everything back; with the lamp off most of it cannot be told.

        Silence is told as a fault, whichever question it meets: an abnormal projector says nothing
        at all.

        Raises:
            DeviceLost, DeviceTimeout, DeviceProtocolError, WrongDevice.
        """
        try:
            return self._read_status()
        except DeviceTimeout:
            if not self._talk.is_silent:
                raise
            return ProjectorStatus(PowerState.FAULT, faults=(SILENT,))

    def _read_status(self) -> ProjectorStatus:
        code = self._talk.ask("PWR", _HEX)
        power = parse_power_state(code)
        broken = parse_faults(self._talk.ask("ERR", _HEX))
        if power is PowerState.FAULT:
            broken = (*broken, f"power state {code or 'not told'}")
        if power is not PowerState.ON:
            return ProjectorStatus(power, lamp_hours=self._lamp_hours(), faults=broken)
        return ProjectorStatus(
            power,
            source=self._talk.ask("SOURCE", _HEX),
            is_muted=self._is_on("MUTE"),
            flips_horizontally=self._is_on("HREVERSE"),
            flips_vertically=self._is_on("VREVERSE"),
            lamp_hours=self._lamp_hours(),
            faults=broken,
            serial=self._read_serial(),
            keystone=self._keystone(),
            is_frozen=self._is_on("FREEZE"),
        )

    def close(self) -> None:
        """Disconnect; the lamp stays as it is. Never fails."""
        self._talk.close()

    def _deadline_ns(self, timeout_s: float) -> int:
        return self._talk.line.deadline_ns(timeout_s)

    def _power(self) -> PowerState:
        return parse_power_state(self._talk.ask("PWR", _HEX))

    def _wait_for_power(self, deadline_ns: int) -> PowerState:
        """The state once it is neither warming nor cooling, or at the end of the time."""
        while (power := self._power()) in _PASSING:
            now_ns = self._clock.now_ns()
            if now_ns >= deadline_ns:
                break
            self._clock.wait_until_ns(min(deadline_ns, now_ns + _POLL_NS))
        return power

    def _switch(self, name: str, is_on: bool, timeout_s: float) -> CommandResult:
        return self._set(name, "ON" if is_on else "OFF", _SWITCH, min(timeout_s, _SETTING_S))

    def _set(self, name: str, value: str, form: re.Pattern[str], timeout_s: float) -> CommandResult:
        serial = self._read_serial()
        deadline_ns = self._deadline_ns(timeout_s)
        self._talk.tell(f"{name} {value}", self._talk.line.remaining_s(deadline_ns))
        result = self._read_back(lambda: self._talk.ask(name, form), value, deadline_ns)
        return CommandResult.FINISHED if result is CommandResult.VERIFIED and not serial else result

    def _read_back(
        self, read: Callable[[], T | None], wanted: T, deadline_ns: int
    ) -> CommandResult:
        """VERIFIED: read twice in a row; FINISHED: not readable; ACCEPTED: reads otherwise."""
        n_agreeing = 0
        while n_agreeing < 2:
            try:
                value = read()
            except (DeviceTimeout, DeviceProtocolError):
                return CommandResult.FINISHED
            if value is None:
                return CommandResult.FINISHED
            n_agreeing = n_agreeing + 1 if value == wanted else 0
            if n_agreeing == 0 and self._clock.now_ns() >= deadline_ns:
                return CommandResult.ACCEPTED
        return CommandResult.VERIFIED

    def _read_serial(self) -> str:
        """What it says, empty when it does not.

        Raises:
            WrongDevice: not the bound one. The line is closed: nothing may be told to a stranger.
        """
        serial = self._ask_serial()
        self._serial = self._serial or serial
        if serial not in ("", self._serial):
            self.close()
            raise WrongDevice(
                f"the projector has serial number {serial}, the {self._whose}'s is {self._serial}",
                subject="projector",
                remedy="connect the rig's projector, or calibrate with this one",
            )
        return serial

    def _ask_serial(self) -> str:
        """One that is not expected must be told twice in a row; empty when none is."""
        before = ""
        for _ in range(3):
            serial = self._talk.ask("SNO", _SERIAL) or ""
            if serial in ("", before, self._serial):
                return serial
            # One byte that was changed on its way must neither bind nor end a session.
            before = serial
        return ""

    def _is_on(self, name: str) -> bool | None:
        value = self._talk.ask(name, _SWITCH)
        return None if value is None else value == "ON"

    def _keystone(self) -> tuple[int, int] | None:
        codes = [self._talk.ask(name, _KEYSTONE) for name in ("HKEYSTONE", "VKEYSTONE")]
        return None if codes[0] is None or codes[1] is None else (int(codes[0]), int(codes[1]))

    def _lamp_hours(self) -> tuple[int, ...]:
        hours = self._talk.ask("LAMP", _HOURS)
        return () if hours is None else tuple(int(part) for part in hours.split())
