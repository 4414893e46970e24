"""A mirror on a Zaber rotary stage, over Zaber's ASCII protocol.

A reply says OK when a command was accepted, not when the mirror has arrived: every motion is polled
to its end, its warnings are looked at, and the position is read twice.
"""

import math
import re
from dataclasses import dataclass

from drivers.clock import Clock
from drivers.interfaces import MirrorInfo
from drivers.serial_port import Address
from drivers.zaber_line import Reply, ZaberLine, rejection
from drivers.zaber_warnings import costs_reference, is_harmless, named
from navapp.errors import (
    DeviceError,
    DeviceProtocolError,
    DeviceTimeout,
    UnsupportedControl,
    WrongDevice,
)

_WHOLE, _REAL = re.compile(r"-?\d{1,12}"), re.compile(r"-?\d{1,12}(\.\d{1,9})?")
_FLAGS = re.compile(r"(\d{2}|--)( [A-Z][A-Z0-9])*")
_POLL_NS, _RETRY_NS = 50_000_000, 50_000_000
_RETRY_S = 2.0
_LATER = ("AGAIN", "STATUSBUSY", "FULL")
# Microsteps/s = the setting `maxspeed` / this (protocol manual, units of speed).
_SPEED_UNIT = 1.6384
# A stage that ramps is slower than its speed; beyond this it is stuck.
_PATIENCE, _PATIENCE_S = 1.5, 2.0


@dataclass(frozen=True, slots=True)
class _Travel:
    """What the stage says of its axis: whole microsteps, and steps a second."""

    steps_per_turn: int
    lowest: int
    highest: int
    steps_per_s: float

    def steps(self, angle_deg: float) -> int:
        return round(angle_deg / 360.0 * self.steps_per_turn)

    def angle_deg(self, steps: int) -> float:
        return steps / self.steps_per_turn * 360.0


class ZaberMirror:
    """One axis of a Zaber device as the mirror's mount; angles from its home position.

    `stop` may be called by any thread; the motion that it ends then raises.
    """

    def __init__(
        self,
        address: Address,
        clock: Clock,
        serial: str = "",
        axis: tuple[int, int] = (1, 1),
    ) -> None:
        self._talk = ZaberLine(address, clock, axis, self._note)
        self._address = address
        self._clock = clock
        self._bound_serial = serial
        self._serial = ""
        self._travel: _Travel | None = None
        self._is_homed = False
        self._is_placed = False
        self._is_stop_asked = False

    @property
    def info(self) -> MirrorInfo:
        """Movable; the serial number once it was read."""
        serial = self._serial or self._bound_serial
        mark = "sim:" if self._address.is_simulated else ""
        name = f"{mark}Zaber mount {serial or self._address.name}"
        return MirrorInfo(
            name,
            "zaber",
            is_simulated=self._address.is_simulated,
            is_movable=True,
            serial=serial,
        )

    def open(self) -> None:
        """Connect, refuse another device than the bound one, and see whether it is homed.

        Switches the device's checksums and alerts on, where it has them.

        Raises:
            DeviceNotFound, DeviceLost, DeviceTimeout, DeviceProtocolError, WrongDevice.
        """
        if self._talk.line.is_open:
            return
        self._talk.open()
        try:
            for setting in ("comm.checksum", "comm.alert"):
                self._talk.ask(f"set {setting} 1", of_device=True)
            self._require_serial()
            self._travel = self._read_travel()
            self._is_homed = self._is_placed = True
            self._look()
        except BaseException:
            self._talk.close()
            raise

    def home(self, timeout_s: float) -> None:
        """Find the reference position.

        Raises:
            DeviceError: it stalled or has another fault; the flags are named.
            DeviceTimeout: it does not get there; it was stopped.
        """
        self._is_stop_asked = False
        self._require_serial()
        self._is_homed = False
        self._tell("home")
        self._wait_until_idle(timeout_s, "finding its home position")
        # What the flags said on the way there does not count any more.
        self._is_homed = self._is_placed = True
        self._require_clear("homing")

    def move_to(self, angle_deg: float, timeout_s: float) -> None:
        """Move and wait until it stands there, read twice.

        Raises:
            UnsupportedControl: not homed, out of range, or rejected.
            DeviceError: it stalled, was stopped or turned by hand; the flags are named.
            DeviceTimeout: it does not get there in the time, or in that of its speed.
        """
        travel, steps = self._target(angle_deg)
        self._look()
        if not self._is_homed:
            raise UnsupportedControl(
                "the mirror has no reference position", subject="mirror", remedy="home it first"
            )
        distance = abs(steps - self._steps())
        self._move(f"move abs {steps}", travel, distance, timeout_s)
        if (found := self._steps()) != steps:
            self._is_placed = False
            raise DeviceProtocolError(
                f"the mirror stands at {travel.angle_deg(found):.3f} deg, "
                f"sent to {angle_deg:.3f} deg",
                subject="mirror",
                remedy="home it again",
            )

    def move_by(self, change_deg: float, timeout_s: float) -> None:
        """Move by that much from where it stands, homed or not; errors as of `move_to`."""
        travel, change = self._target(change_deg, is_relative=True)
        if self._is_homed:
            self._target(travel.angle_deg(self._steps() + change))
        self._move(f"move rel {change}", travel, abs(change), timeout_s)

    def position_deg(self) -> float | None:
        """Where it stands.

        None while it moves, without reference, and when it was displaced, turned by hand or
        interrupted since it was last sent somewhere.
        """
        is_busy = self._look()
        travel = self._travel
        if is_busy or travel is None or not (self._is_homed and self._is_placed):
            return None
        steps = self._steps()
        return travel.angle_deg(steps) if self._is_homed and self._is_placed else None

    def stop(self) -> None:
        """Stop moving, now."""
        self._is_stop_asked = True
        self._talk.ask("stop")

    def close(self) -> None:
        """Stop and disconnect; never fails."""
        if self._talk.line.is_open:
            try:
                self._talk.give("stop")
            except DeviceError:
                pass
        self._talk.close()

    def _require_serial(self) -> None:
        serial = self._talk.value("system.serial", _WHOLE, of_device=True)
        if self._bound_serial and serial != self._bound_serial:
            self._talk.close()
            raise WrongDevice(
                f"the mirror's mount has serial number {serial}, the rig's is {self._bound_serial}",
                subject="mirror",
                remedy="connect the rig's mount, or calibrate with this one",
            )
        self._serial = serial

    def _read_travel(self) -> _Travel:
        names = ("limit.cycle.dist", "limit.min", "limit.max")
        turn, lowest, highest = (int(self._talk.value(name, _WHOLE)) for name in names)
        speed = float(self._talk.value("maxspeed", _REAL)) / _SPEED_UNIT
        if turn <= 0 or lowest >= highest or not speed > 0.0:
            raise DeviceProtocolError(
                f"the mirror's stage says {turn} steps a turn, {lowest} to {highest}, {speed:g}/s",
                subject="mirror",
                remedy="check that it is a rotary stage",
            )
        return _Travel(turn, lowest, highest, speed)

    def _target(self, angle_deg: float, *, is_relative: bool = False) -> tuple[_Travel, int]:
        """The axis and the steps to or by that angle.

        Raises:
            DeviceLost: not open. UnsupportedControl: out of range, or no number.
        """
        if not self._talk.line.is_open or self._travel is None:
            self._talk.give("")
            raise AssertionError("a closed line must have raised")
        travel = self._travel
        is_inside = math.isfinite(angle_deg) and (
            is_relative or travel.lowest <= travel.steps(angle_deg) <= travel.highest
        )
        if not is_inside:
            low_deg, high_deg = travel.angle_deg(travel.lowest), travel.angle_deg(travel.highest)
            raise UnsupportedControl(
                f"the mirror cannot be moved to {angle_deg:g} deg",
                subject="mirror",
                remedy=f"it reaches {low_deg:.1f} to {high_deg:.1f} deg",
            )
        return travel, travel.steps(angle_deg)

    def _move(self, command: str, travel: _Travel, distance: int, timeout_s: float) -> None:
        self._is_stop_asked = False
        self._is_placed = False
        self._tell(command)
        limit_s = distance / travel.steps_per_s * _PATIENCE + _PATIENCE_S
        self._wait_until_idle(min(limit_s, timeout_s), "moving")
        # What the flags said on the way there does not count any more.
        self._is_placed = True
        self._require_clear("moving")

    def _tell(self, command: str) -> None:
        """Give a motion command; what the flags said of the last one is cleared first."""
        self._talk.ask("warnings clear")
        deadline_ns = self._talk.line.deadline_ns(_RETRY_S)
        reply = self._talk.give(command)
        while reply.data in _LATER and not reply.is_accepted:
            if self._clock.now_ns() >= deadline_ns:
                break
            self._clock.wait_until_ns(self._clock.now_ns() + _RETRY_NS)
            reply = self._talk.give(command)
        if not reply.is_accepted:
            raise rejection(command, reply.data)

    def _wait_until_idle(self, timeout_s: float, what: str) -> None:
        deadline_ns = self._talk.line.deadline_ns(timeout_s)
        while self._talk.ask("").is_busy:
            if self._clock.now_ns() >= deadline_ns:
                self._is_placed = False
                self.stop()
                raise DeviceTimeout(
                    f"the mirror was still {what} after {timeout_s:.1f} s and was stopped",
                    subject="mirror",
                    remedy="see whether something is in its way, then home it",
                )
            self._clock.wait_until_ns(self._clock.now_ns() + _POLL_NS)
        if self._is_stop_asked:
            self._is_placed = False
            raise DeviceError(f"the mirror was stopped while {what}", subject="mirror")

    def _require_clear(self, what: str) -> None:
        """Raise unless a motion ended without a flag that says otherwise."""
        self._look()
        if self._is_homed and self._is_placed:
            return
        raise DeviceError(
            f"{what} the mirror failed: {named(self._flags)}",
            subject="mirror",
            remedy="see what is in its way, then home it",
        )

    def _look(self) -> bool:
        """Note all flags; whether it moves."""
        reply = self._talk.ask("")
        self._flags: tuple[str, ...] = ()
        if reply.warning:
            self._flags = self._all_flags(reply)
        for flag in self._flags:
            self._note(flag)
        return reply.is_busy

    def _all_flags(self, reply: Reply) -> tuple[str, ...]:
        """A reply shows the most urgent flag only."""
        every = self._talk.ask("warnings")
        if not every.is_accepted or _FLAGS.fullmatch(every.data) is None:
            return (reply.warning,)
        others = every.data.split()[1:]
        return tuple(dict.fromkeys((reply.warning, every.warning, *others)))

    def _note(self, flag: str) -> None:
        if not flag or is_harmless(flag):
            return
        self._is_placed = False
        if costs_reference(flag):
            self._is_homed = False

    def _steps(self) -> int:
        """Position, the same in two readings one after the other."""
        readings = [int(self._talk.value("pos", _WHOLE)) for _ in range(2)]
        if readings[0] != readings[1]:
            readings.append(int(self._talk.value("pos", _WHOLE)))
        if readings[-1] != readings[-2]:
            raise DeviceProtocolError(
                f"the mirror tells {readings[0]}, {readings[1]} and {readings[2]} steps at rest",
                subject="mirror",
                remedy="check its cable",
            )
        return readings[-1]
