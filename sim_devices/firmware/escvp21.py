"""A projector that speaks ESC/VP21: lamp, waits, settings, abnormal state and unasked events."""

from collections import deque
from dataclasses import dataclass, field
from enum import Enum

from drivers.clock import Clock


class Power(Enum):
    """The codes of `PWR?`."""

    STANDBY = "04"
    WARMING = "02"
    ON = "01"
    COOLING = "03"
    ABNORMAL = "05"


# Of IMEVENT, whose codes are not those of PWR?.
_EVENT_CODES = {Power.STANDBY: 1, Power.WARMING: 2, Power.ON: 3, Power.COOLING: 4}
_SOURCES = ("10", "1F", "30", "A0", "41")
_SWITCHES = ("MUTE", "HREVERSE", "VREVERSE", "FREEZE", "AUTOKEYSTONE")
_KEYSTONES = ("HKEYSTONE", "VKEYSTONE")
_KEYSTONE_STEPS = 61


@dataclass(slots=True)
class ProjectorModel:
    """What differs between models and days.

    Attributes:
        faults: code of `ERR?`.
    """

    serial: str = "SIM1200123"  # number
    # until the lamp burns, after one, two and three attempts.
    ignition_s: tuple[float, float, float] = (40.0, 70.0, 100.0)
    n_failing: int = 0  # ignitions that fail; three are a lamp fault
    cooling_s: float = 50.0  # until standby
    # the colon comes when a power command was accepted; otherwise when it was executed.
    is_quick: bool = False
    has_events: bool = False  # tells of changes of the lamp
    recovery_s: float = 130.0  # how long an abnormal projector refuses the lamp
    fault: int = 0
    hours: tuple[int, ...] = (1633,)  # of the lamp
    settings: dict[str, str] = field(
        default_factory=lambda: {
            "SOURCE": "30",
            "MSEL": "00",
            **dict.fromkeys(_SWITCHES, "OFF"),
            **dict.fromkeys(_KEYSTONES, "126"),
        }
    )


class ProjectorFirmware:
    """Answers commands; see `Firmware`."""

    def __init__(self, clock: Clock, model: ProjectorModel | None = None) -> None:
        self._clock = clock
        self.model = model or ProjectorModel()
        self.power = Power.STANDBY
        self.has_mains = True
        self._pending = bytearray()
        self._out: deque[bytes] = deque()
        self._change_ns: int | None = None
        self._after = Power.STANDBY
        self._owes_colon = False
        self._dead_until_ns = 0

    def receive(self, data: bytes) -> None:
        """Bytes of commands; while a slow model works on its lamp they wait."""
        self._advance()
        if self.has_mains:
            self._pending += data
            self._work()

    def messages(self) -> list[bytes]:
        """What was sent."""
        self._advance()
        out = list(self._out)
        self._out.clear()
        return out

    def next_ns(self) -> int | None:
        """When the lamp changes."""
        return self._change_ns

    def event(self) -> None:
        """Tell what the lamp does, unasked."""
        code = _EVENT_CODES.get(self.power, 1)
        self._out.append(f"IMEVENT=0001 {code:02d} 00000000 00000000 T1 F1\r:".encode())

    def break_down(self, fault: int) -> None:
        """Abnormal: silent, lamp out."""
        self.model.fault = fault
        self.power = Power.ABNORMAL
        self._change_ns = None
        self._owes_colon = False
        self._dead_until_ns = self._clock.now_ns() + round(self.model.recovery_s * 1e9)
        self._pending.clear()

    def lose_mains(self) -> None:
        """Silent, lamp out; standby when the mains come back."""
        self._advance()
        self.has_mains = False
        self.power = Power.STANDBY
        self._change_ns = None
        self._owes_colon = False
        self._pending.clear()
        self._out.clear()

    def restore_mains(self) -> None:
        """Standby; what was wrong is forgotten."""
        self.has_mains = True
        self.model.fault = 0

    def _advance(self) -> None:
        """What the lamp has done by now."""
        if self._change_ns is None or self._clock.now_ns() < self._change_ns:
            return
        self._change_ns = None
        if self._after is Power.ABNORMAL:
            self.break_down(fault=0x03)
            return
        self.power = self._after
        if self.model.has_events:
            self.event()
        if self._owes_colon:
            self._owes_colon = False
            self._out.append(b":")
        self._work()

    def _work(self) -> None:
        """Handle whole commands, until one takes its time."""
        while not self._owes_colon:
            end = self._pending.find(b"\r")
            if end < 0:
                # Nothing that long is a command.
                if len(self._pending) > 256:
                    self._pending.clear()
                return
            command = self._pending[:end].decode("latin-1").strip()
            del self._pending[: end + 1]
            self._handle(command)

    def _handle(self, command: str) -> None:
        if self.power is Power.ABNORMAL:
            is_ready = self._clock.now_ns() >= self._dead_until_ns
            if not (command == "PWR ON" and is_ready):
                return
            self.model.fault = 0
            self.power = Power.STANDBY
        if command in ("PWR ON", "PWR OFF"):
            self._switch_lamp(is_on=command == "PWR ON")
            return
        self._out.append(self._answer(command))

    def _switch_lamp(self, *, is_on: bool) -> None:
        if self.power in (Power.WARMING, Power.COOLING):
            self._out.append(b"ERR\r:")
            return
        if (self.power is Power.ON) == is_on:
            self._out.append(b":")
            return
        model = self.model
        duration_s = model.cooling_s
        self._after = Power.STANDBY
        if is_on:
            is_burning = model.n_failing < len(model.ignition_s)
            duration_s = model.ignition_s[min(model.n_failing, len(model.ignition_s) - 1)]
            self._after = Power.ON if is_burning else Power.ABNORMAL
        self.power = Power.WARMING if is_on else Power.COOLING
        self._change_ns = self._clock.now_ns() + round(duration_s * 1e9)
        if model.has_events:
            self.event()
        if model.is_quick:
            self._out.append(b":")
        else:
            self._owes_colon = True

    def _answer(self, command: str) -> bytes:
        if not command:
            return b":"
        name, is_question, _ = command.partition("?")
        if is_question:
            value = self._value(name)
            return b"ERR\r:" if value is None else f"{name}={value}\r:".encode()
        name, _, parameter = command.partition(" ")
        value = self._as_kept(name, parameter) if self.power is Power.ON else None
        if value is None:
            return b"ERR\r:"
        self.model.settings[name] = value
        return b":"

    def _value(self, name: str) -> str | None:
        if name == "PWR":
            return self.power.value
        if name == "ERR":
            return f"{self.model.fault:02X}"
        if self.power is not Power.ON:
            return None
        if name == "SNO":
            return self.model.serial
        if name == "LAMP":
            return " ".join(str(hours) for hours in self.model.hours)
        return self.model.settings.get(name)

    def _as_kept(self, name: str, parameter: str) -> str | None:
        """What a parameter becomes, None when it is refused."""
        if name in _SWITCHES:
            return parameter if parameter in ("ON", "OFF") else None
        if name == "SOURCE":
            return parameter if parameter in _SOURCES else None
        if name == "MSEL":
            return parameter if parameter in ("00", "01", "02") else None
        if name in _KEYSTONES and parameter.isascii() and parameter.isdigit():
            return _quantise(int(parameter))
        return None


def _quantise(value: int) -> str | None:
    """The nearest of 61 steps between 0 and 251."""
    if value > 255:
        return None
    unit = 251.0 / (_KEYSTONE_STEPS - 1)
    return str(round(round(min(value, 251) / unit) * unit))
