"""A mirror on a Zaber rotary stage, over Zaber's ASCII protocol; angles from its home position."""

import math
import re
from contextlib import suppress
from dataclasses import dataclass

from drivers.clock import Clock
from drivers.interfaces import MirrorInfo
from drivers.serial_port import Address
from drivers.zaber_axis import INTERRUPTED, WHOLE, ZaberAxis
from drivers.zaber_line import ZaberLine
from navapp.errors import DeviceError, DeviceProtocolError, UnsupportedControl, WrongDevice

_REAL = re.compile(r"\d{1,12}(\.\d{1,9})?")
# Microsteps/s = the setting `maxspeed` / this (protocol manual, units of speed).
_SPEED_UNIT = 1.6384
# A stage that ramps is slower than its speed; beyond this it is stuck.
_PATIENCE, _PATIENCE_S = 1.5, 2.0


@dataclass(frozen=True, slots=True)
class _Travel:
    """What the stage says of its range, in microsteps and microsteps/s."""

    steps_per_turn: int
    lowest: int
    highest: int
    steps_per_s: float

    def steps(self, angle_deg: float) -> int:
        return round(angle_deg / 360.0 * self.steps_per_turn)

    def angle_deg(self, steps: int) -> float:
        return steps / self.steps_per_turn * 360.0

    def longest_s(self, steps: int) -> float:
        return abs(steps) / self.steps_per_s * _PATIENCE + _PATIENCE_S


class ZaberMirror:
    """The mirror's mount, bound to a serial number: the given one, otherwise the first one read.

    `stop` may be called by any thread; the motion that it ends then raises.
    """

    def __init__(
        self,
        address: Address,
        clock: Clock,
        serial: str = "",
        axis: tuple[int, int] = (1, 1),
    ) -> None:
        """`axis` is the device's number on the line and the axis' number in the device."""
        self._talk = ZaberLine(address, clock, axis, self._hear)
        self._axis = ZaberAxis(self._talk, clock)
        self._address = address
        self._serial = serial
        self._whose = "rig" if serial else "session"
        self._travel: _Travel | None = None

    @property
    def info(self) -> MirrorInfo:
        """Movable; the serial number once it is known."""
        mark = "sim:" if self._address.is_simulated else ""
        name = f"{mark}Zaber mount {self._serial or self._address.name}"
        return MirrorInfo(
            name,
            "zaber",
            is_simulated=self._address.is_simulated,
            is_movable=True,
            serial=self._serial,
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
            self._axis.look()
        except BaseException:
            self._talk.close()
            raise

    def home(self, timeout_s: float) -> None:
        """Find the reference position.

        Raises:
            DeviceError: it stalled or has another fault; the flags are named.
            DeviceTimeout: it does not get there; it was stopped.
        """
        self._axis.begin()
        self._require_serial()
        self._axis.home(timeout_s)

    def move_to(self, angle_deg: float, timeout_s: float) -> None:
        """Move and wait until it stands there, read twice.

        Raises:
            UnsupportedControl: not homed, out of range, moving already, or rejected.
            DeviceError: it stalled, was stopped or turned by hand; the flags are named.
            DeviceTimeout: it does not get there in the time, or in that of its speed.
        """
        self._axis.begin()
        travel, steps = self._target(angle_deg)
        self._require_rest()
        if not self._axis.is_homed:
            raise UnsupportedControl(
                "the mirror has no reference position", subject="mirror", remedy="home it first"
            )
        limit_s = min(timeout_s, travel.longest_s(steps - self._axis.steps()))
        self._axis.move(f"move abs {steps}", limit_s, is_repeatable=True)
        if (found := self._axis.steps()) != steps:
            self._axis.against = INTERRUPTED
            raise DeviceProtocolError(
                f"the mirror stands at {travel.angle_deg(found):.3f} deg, "
                f"sent to {angle_deg:.3f} deg",
                subject="mirror",
                remedy="home it again",
            )

    def move_by(self, change_deg: float, timeout_s: float) -> None:
        """Move by that much from where it stands, homed or not; errors as of `move_to`."""
        self._axis.begin()
        travel, change = self._target(change_deg, is_change=True)
        self._require_rest()
        if self._axis.is_homed:
            self._target(travel.angle_deg(self._axis.steps() + change))
        limit_s = min(timeout_s, travel.longest_s(change))
        self._axis.move(f"move rel {change}", limit_s, is_repeatable=False)

    def position_deg(self) -> float | None:
        """Where it stands.

        None while it moves, without reference, and when it was displaced, turned by hand or
        interrupted since it was last sent somewhere.
        """
        is_moving = self._axis.look()
        if is_moving or not self._axis.is_placed or self._travel is None:
            return None
        steps = self._axis.steps()
        # An alert may have come with the position.
        return self._travel.angle_deg(steps) if self._axis.is_placed else None

    def stop(self) -> None:
        """Stop moving, now."""
        self._axis.stop()

    def close(self) -> None:
        """Stop and disconnect; never fails."""
        if self._talk.line.is_open:
            with suppress(DeviceError):
                self._talk.give("stop")
        self._talk.close()

    def _hear(self, flag: str) -> None:
        self._axis.note(flag)

    def _require_serial(self) -> None:
        serial = self._talk.value("system.serial", WHOLE, of_device=True)
        self._serial = self._serial or serial
        if serial != self._serial:
            self._talk.close()
            raise WrongDevice(
                f"the mirror's mount has serial number {serial}, "
                f"the {self._whose}'s is {self._serial}",
                subject="mirror",
                remedy="connect the rig's mount, or calibrate with this one",
            )

    def _read_travel(self) -> _Travel:
        names = ("limit.cycle.dist", "limit.min", "limit.max")
        turn, lowest, highest = (int(self._talk.value(name, WHOLE)) for name in names)
        speed = float(self._talk.value("maxspeed", _REAL)) / _SPEED_UNIT
        if turn <= 0 or lowest >= highest or speed <= 0.0:
            raise DeviceProtocolError(
                f"the mirror's stage says {turn} steps a turn, {lowest} to {highest}, {speed:g}/s",
                subject="mirror",
                remedy="check that it is a rotary stage",
            )
        return _Travel(turn, lowest, highest, speed)

    def _require_rest(self) -> None:
        if self._axis.look():
            raise UnsupportedControl(
                "the mirror is moving", subject="mirror", remedy="wait, or stop it first"
            )

    def _target(self, angle_deg: float, *, is_change: bool = False) -> tuple[_Travel, int]:
        """The range, and the steps to or by that angle.

        Raises:
            DeviceLost: not open. UnsupportedControl: out of range, or no number.
        """
        travel = self._travel
        if not self._talk.line.is_open or travel is None:
            raise self._talk.line.absence()
        span = travel.highest - travel.lowest
        lowest, highest = (-span, span) if is_change else (travel.lowest, travel.highest)
        if not math.isfinite(angle_deg) or not lowest <= travel.steps(angle_deg) <= highest:
            low_deg, high_deg = travel.angle_deg(lowest), travel.angle_deg(highest)
            raise UnsupportedControl(
                f"the mirror cannot be moved {'by' if is_change else 'to'} {angle_deg:g} deg",
                subject="mirror",
                remedy=f"give {low_deg:.1f} to {high_deg:.1f} deg",
            )
        return travel, travel.steps(angle_deg)
