"""A rotary stage that speaks Zaber's ASCII protocol: motion, warnings, alerts, checksums."""

from collections import deque
from collections.abc import Callable

from drivers.clock import Clock
from sim_devices.firmware.stage_motion import StageModel, Travel, travel_to, travel_to_rest

# The most urgent first.
_FAULTS = ("FF", "FN", "FZ", "FH", "FV", "FO", "FC", "FM", "FD", "FQ", "FI", "FA", "FR", "FS", "FB")
_WARNINGS = ("FP", "FE", "FT", "WL", "WV", "WT", "WS", "WM", "WP", "WR", "WH")
_NOTES = ("NC", "NI", "ND", "NR", "NT", "NU", "NJ")
_ORDER = (*_FAULTS, *_WARNINGS, *_NOTES)
_OF_ONE_MOTION = {"NC", "NI", "FS", "WM", "WS"}
_DEVICE_SETTINGS = ("deviceid", "system.serial", "version", "system.axiscount")
_SPEED_UNIT = 1.6384


def _nothing() -> None:
    """Happens at the end of most motions."""


class StageFirmware:
    """One device with one axis; see `Firmware`.

    Attributes:
        model: of the stage.
        flags: warnings that stand.
        rejections: reasons with which the next motion commands are rejected.
        stalls_at: share of the way at which the next motion stalls; None: it arrives.
    """

    def __init__(self, clock: Clock, model: StageModel | None = None) -> None:
        self._clock = clock
        self.model = model or StageModel()
        self._pending = bytearray()
        self._out: deque[bytes] = deque()
        self._settings = {"comm.checksum": 0, "comm.alert": 0}
        self.rejections: list[str] = []
        self.stalls_at: float | None = None
        self.has_power = True
        self._place = self.model.unhomed_steps
        self._travel: Travel | None = None
        self._at_end: Callable[[], None] = _nothing
        self.flags: set[str] = set()
        self._start_up()

    @property
    def true_deg(self) -> float:
        """Where the mirror really stands, from home."""
        return self._true_place() / self.model.steps_per_turn * 360.0

    @property
    def is_busy(self) -> bool:
        """It moves."""
        travel = self._travel
        return travel is not None and self._clock.now_ns() < travel.end_ns

    def receive(self, data: bytes) -> None:
        """Bytes of commands."""
        self._advance()
        if not self.has_power:
            return
        self._pending += data
        while (end := self._pending.find(b"\n")) >= 0:
            line = self._pending[:end].decode("latin-1").rstrip("\r")
            del self._pending[: end + 1]
            self._handle(line)
        if len(self._pending) > 256:
            self._pending.clear()

    def messages(self) -> list[bytes]:
        """What was sent."""
        self._advance()
        out = list(self._out)
        self._out.clear()
        return out

    def next_ns(self) -> int | None:
        """When it arrives."""
        return None if self._travel is None else self._travel.end_ns

    def turn_by_hand(self, change_deg: float) -> None:
        """Somebody turns the knob: the motor follows and counts."""
        self._set_off(self._true_place() + change_deg / 360.0 * self.model.steps_per_turn)
        self.flags.add("NC")
        self._alert()

    def push(self, change_deg: float) -> None:
        """Somebody pushes the mirror where it stands: the encoder sees it."""
        self._place = self._true_place() + change_deg / 360.0 * self.model.steps_per_turn
        self._travel = None
        self.flags.add("WM")
        self._alert()

    def lose_power(self) -> None:
        """Silent; it stops where it is."""
        self._place, self._travel, self.has_power = self._true_place(), None, False
        self._pending.clear()
        self._out.clear()

    def restore_power(self) -> None:
        """It counts from zero wherever it stands."""
        self.has_power = True
        self._start_up()

    def _start_up(self) -> None:
        self.flags = {"WR"}
        self._travel, self._at_end = None, _nothing
        # Counted = true - this.
        self._zero = self._place

    def _true_place(self) -> float:
        if self._travel is None:
            return self._place
        return self._travel.at(self._clock.now_ns())[0]

    def _advance(self) -> None:
        if self._travel is None or self._clock.now_ns() < self._travel.end_ns:
            return
        self._place, self._travel = self._travel.at(self._travel.end_ns)[0], None
        self._at_end()
        self._alert()

    def _set_off(self, end: float, at_end: Callable[[], None] = _nothing) -> None:
        start, model = self._true_place(), self.model
        self._at_end = at_end
        if self.stalls_at is not None:
            share, self.stalls_at = self.stalls_at, None
            end = start + share * (end - start)
            self._at_end = self._stall
        self._travel = travel_to(self._clock.now_ns(), start, end, model.speed, model.acceleration)

    def _stall(self) -> None:
        self.flags.add("FS")

    def _mark_home(self) -> None:
        self._zero = 0.0
        self._place = 0.0
        self.flags -= {"WR", "WH"}

    def _alert(self) -> None:
        if self._settings["comm.alert"] and self.has_power:
            self._send(f"!01 1 {self._state()} {self._worst()}")

    def _state(self) -> str:
        return "BUSY" if self.is_busy else "IDLE"

    def _worst(self) -> str:
        return next((flag for flag in _ORDER if flag in self.flags), "--")

    def _send(self, text: str) -> None:
        tail = f":{_lrc(text[1:])}" if self._settings["comm.checksum"] else ""
        self._out.append(f"{text}{tail}\r\n".encode("latin-1"))

    def _handle(self, line: str) -> None:
        """A line that is not for us, or spoilt, has no answer."""
        if not line.startswith("/"):
            return
        text = line[1:]
        if text[-3:-2] == ":":
            if _lrc(text[:-3]) != text[-2:]:
                return
            text = text[:-3]
        words = text.split(" ")
        numbers: list[str] = []
        while words and len(numbers) < 3 and (words[0].isdigit() or words[0] == "--"):
            numbers.append(words.pop(0))
        address, axis, number = [*numbers, *("0", "0", "--")[len(numbers) :]]
        if address not in ("0", "1", "01"):
            return
        done, data = self._do(words, axis) if axis in ("0", "1") else (False, "BADAXIS")
        mark = f" {number}" if number != "--" else ""
        word = "OK" if done else "RJ"
        self._send(f"@01 {axis}{mark} {word} {self._state()} {self._worst()} {data}")

    def _do(self, words: list[str], axis: str) -> tuple[bool, str]:
        """Whether a command is accepted, and what is said to it."""
        match [word for word in words if word]:
            case []:
                return True, "0"
            case ["home"] | ["move", _] | ["move", _, _] if self.rejections:
                return False, self.rejections.pop(0)
            case ["home"]:
                self._forget()
                self._set_off(0.0, self._mark_home)
                return True, "0"
            case ["move", ("abs" | "rel" | "min" | "max") as kind, *rest]:
                return self._move(kind, rest)
            case ["stop"] | ["estop"]:
                self._stop()
                return True, "0"
            case ["warnings"] | ["warnings", "clear"]:
                return True, self._warnings(is_cleared=len(words) == 2)
            case ["get", name]:
                return self._get(name, axis)
            case ["set", ("comm.checksum" | "comm.alert") as name, ("0" | "1") as value]:
                self._settings[name] = int(value)
                return True, "0"
            case ["system", "reset"]:
                self.lose_power()
                self.restore_power()
                return True, "0"
        return False, "BADCOMMAND"

    def _move(self, kind: str, rest: list[str]) -> tuple[bool, str]:
        counted = self._true_place() - self._zero
        ends = {"min": 0.0, "max": float(self.model.highest)}
        if kind in ends and not rest:
            end = ends[kind]
        elif len(rest) == 1 and rest[0].lstrip("-").isdigit() and len(rest[0]) < 12:
            end = float(rest[0]) + (counted if kind == "rel" else 0.0)
        else:
            return False, "BADDATA"
        is_homed = "WR" not in self.flags
        if is_homed and not -1e-6 <= end <= self.model.highest:
            return False, "BADDATA"
        self._forget()
        self._set_off(end + self._zero)
        return True, "0"

    def _forget(self) -> None:
        """A new motion ends the notes of the last one."""
        self.flags -= _OF_ONE_MOTION
        if self.is_busy:
            self.flags.add("NI")

    def _stop(self) -> None:
        if self._travel is None:
            return
        now_ns = self._clock.now_ns()
        place, speed = self._travel.at(now_ns)
        self._at_end = _nothing
        self._travel = travel_to_rest(now_ns, place, speed, self.model.acceleration)
        self.flags.add("NI")

    def _warnings(self, *, is_cleared: bool) -> str:
        standing = [flag for flag in _ORDER if flag in self.flags]
        if is_cleared:
            self.flags -= _OF_ONE_MOTION
        return " ".join([f"{len(standing):02d}", *standing])

    def _get(self, name: str, axis: str) -> tuple[bool, str]:
        model = self.model
        if name in _DEVICE_SETTINGS and axis != "0":
            return False, "DEVICEONLY"
        values: dict[str, object] = {
            "deviceid": 50081,
            "system.serial": model.serial,
            "version": "7.34",
            "system.axiscount": 1,
            "pos": round(self._true_place() - self._zero),
            "limit.min": 0,
            "limit.max": model.highest,
            "limit.cycle.dist": model.steps_per_turn,
            "limit.home.triggered": int(abs(self._true_place()) < 1.0),
            "maxspeed": round(model.speed * _SPEED_UNIT),
            **self._settings,
        }
        return (True, str(values[name])) if name in values else (False, "BADCOMMAND")


def _lrc(text: str) -> str:
    """Two's complement of the sum of all bytes, as two hexadecimal digits."""
    return format((256 - sum(map(ord, text)) % 256) % 256, "02X")
