"""What the session asks of its projector and its mirror, and what in the answers forbids guides."""

from dataclasses import dataclass
from typing import Protocol

from drivers.interfaces import (
    CommandResult,
    MirrorMount,
    PowerState,
    ProjectorControl,
    ProjectorStatus,
)
from navapp.control.states import DeviceHealth, DeviceLine
from navapp.errors import DeviceError, UnsupportedControl
from navapp.geometry.display_model import DisplayModel
from navapp.values import Reason

# A mirror turned by an angle turns what is seen in it by twice that: at half a metre this moves a
# guide by 0.5 mm, half of what the strictest stage tolerates.
MIRROR_TOLERANCE_DEG = 0.028
_MOTION_S = 60.0
_NO_KEYSTONE = (0, 0)
# A lamp takes longer: that it is there is seen in the reports, and none may become stale.
_COMMAND_S = 10.0
_ALTERED = "f sets its flips, s its source; set keystone and freeze back on the projector"
_NOT_CONFIGURED = "name its backend under [projector], or calibrate the display without it"
_RESULTS = {
    CommandResult.ACCEPTED: "accepted, its state tells when it is so",
    CommandResult.FINISHED: "done, as far as it can be told",
    CommandResult.VERIFIED: "done",
}


@dataclass(frozen=True, slots=True)
class DeviceReport:
    """What is known of a device."""

    line: DeviceLine  # for the devices panel
    reason: Reason | None = None  # why guides must not be shown; None when they may


class DeviceHandler(Protocol):
    """Asks one device and restores it; used by one thread at a time, but for `stop`."""

    @property
    def reason(self) -> Reason:
        """Of a device that does not answer."""
        ...

    @property
    def restoring(self) -> str:
        """What is said while `restore` runs; empty when it takes no time."""
        ...

    @property
    def is_slow(self) -> bool:
        """Asking takes longer than a frame may wait; known after the first report."""
        ...

    def report(self) -> DeviceReport:
        """Ask; never fails."""
        ...

    def restore(self) -> None:
        """Bring the device to where the session needs it; never fails."""
        ...

    def reopen(self) -> None:
        """Close and open.

        Raises:
            DeviceError: it cannot be opened.
        """
        ...

    def stop(self) -> None:
        """End what `restore` does, for good; called by another thread; never fails."""
        ...


class ProjectorHandler:
    """The projector must show the picture as it comes: neither flipped, bent nor frozen.

    Keystone and source are compared with what they were first: the display was calibrated so.
    """

    reason = Reason.PROJECTOR_LOST
    restoring = ""

    def __init__(self, projector: ProjectorControl, calibrated: DisplayModel | None = None) -> None:
        self._projector = projector
        # A display in the mirror was calibrated as it is: without keystone, with these flips.
        self._keystone = None if calibrated is None else _NO_KEYSTONE
        self._flips = None if calibrated is None else calibrated.projector_flips
        self._source: str | None = None
        self.is_slow = True

    def report(self) -> DeviceReport:
        """One that does not answer is told, not raised."""
        name = self._projector.name
        try:
            status = self._projector.status()
        except DeviceError as error:
            line = DeviceLine("projector", name, DeviceHealth.LOST, str(error))
            return DeviceReport(line, self.reason)
        self.is_slow = status.power is not PowerState.ABSENT
        if status.power is PowerState.ABSENT and self._flips is not None:
            detail = "not configured, but the display was calibrated with it"
            line = DeviceLine("projector", name, DeviceHealth.TROUBLE, detail, _NOT_CONFIGURED)
            return DeviceReport(line, self.reason)
        if status.power is PowerState.ABSENT:
            return DeviceReport(DeviceLine("projector", name, DeviceHealth.ABSENT, "not used"))
        if changes := self._changes(status):
            detail = f"picture {changes}"
            line = DeviceLine("projector", name, DeviceHealth.TROUBLE, detail, _ALTERED)
            return DeviceReport(line, Reason.PROJECTOR_ALTERS)
        is_on = status.power is PowerState.ON
        dark = () if is_on else (status.power.value,)
        if told := (*dark, *(("muted",) if status.is_muted else ()), *status.faults):
            detail, remedy = ", ".join(told), _find_remedy(status)
            line = DeviceLine("projector", name, DeviceHealth.TROUBLE, detail, remedy)
            return DeviceReport(line, self.reason if status.power is PowerState.FAULT else None)
        return DeviceReport(DeviceLine("projector", name, DeviceHealth.OK, status.power.value))

    def set(self, name: str) -> str:
        """Tell it one of `PROJECTOR_SETTINGS`; what became of it, in words.

        Raises:
            DeviceError: it cannot, or does not answer.
        """
        if name in ("on", "off"):
            return _RESULTS[self._projector.set_power(name == "on", _COMMAND_S)]
        if name == "flips":
            flips = self._flips or (False, False)
            return _RESULTS[self._projector.set_flips(*flips, _COMMAND_S)]
        if self._source is None:
            raise UnsupportedControl(
                "it has not told its source in this session",
                subject="projector",
                remedy="switch it on, and choose the source on it",
            )
        return _RESULTS[self._projector.set_source(self._source, _COMMAND_S)]

    def restore(self) -> None:
        """Its picture is set on the projector, by a person who sees it."""

    def reopen(self) -> None:
        """Close and open; errors of its `open`."""
        self._projector.close()
        self._projector.open()

    def stop(self) -> None:
        """Nothing of it moves."""

    def _changes(self, status: ProjectorStatus) -> str:
        self._keystone = self._keystone or status.keystone
        self._source = self._source or status.source
        is_other = status.source is not None and status.source != self._source
        is_bent = status.keystone is not None and status.keystone != self._keystone
        found = {
            "flipped": self._is_flipped(status),
            "frozen": status.is_frozen,
            "with another keystone": is_bent,
            "of another source": is_other,
        }
        return ", ".join(name for name, is_found in found.items() if is_found)

    def _is_flipped(self, status: ProjectorStatus) -> bool:
        """Otherwise than calibrated, or at all where no flip was calibrated."""
        found = (bool(status.flips_horizontally), bool(status.flips_vertically))
        return found != (self._flips or (False, False))


def _find_remedy(status: ProjectorStatus) -> str:
    """What helps a projector that shows nothing."""
    if status.faults or status.power is PowerState.FAULT:
        return "see its own lamps and its manual"
    return {
        PowerState.STANDBY: "p switches it on",
        PowerState.WARMING: "wait until its lamp is warm",
        PowerState.COOLING: "wait until its lamp is cold, then p switches it on",
        PowerState.ON: "end its mute on the projector",
    }.get(status.power, "")


class MirrorHandler:
    """The mirror must stand where the display was calibrated."""

    reason = Reason.MIRROR_AWAY

    def __init__(self, mirror: MirrorMount, calibrated_deg: float) -> None:
        self._mirror = mirror
        self._calibrated_deg = calibrated_deg
        self._failure = ""
        self._is_over = False
        self.restoring = f"being moved to {calibrated_deg:.1f} deg"
        self.is_slow = mirror.info.is_movable

    def report(self) -> DeviceReport:
        """One that does not answer is told, not raised."""
        info = self._mirror.info
        try:
            angle_deg = self._mirror.position_deg()
        except DeviceError as error:
            return DeviceReport(
                DeviceLine("mirror", info.name, DeviceHealth.LOST, str(error)), self.reason
            )
        angle = "position unknown" if angle_deg is None else f"{angle_deg:.1f} deg"
        if not self._is_there(angle_deg):
            detail = self._failure or f"{angle}, calibrated at {self._calibrated_deg:.1f} deg"
            line = DeviceLine("mirror", info.name, DeviceHealth.TROUBLE, detail)
            return DeviceReport(line, self.reason)
        self._failure = ""
        if info.is_movable:
            return DeviceReport(DeviceLine("mirror", info.name, DeviceHealth.OK, angle))
        return DeviceReport(DeviceLine("mirror", info.name, DeviceHealth.ABSENT, f"fixed, {angle}"))

    def restore(self) -> None:
        """Home it unless it knows its place, then move it to its calibrated angle."""
        if not self._mirror.info.is_movable:
            return
        try:
            angle_deg = self._mirror.position_deg()
            if self._is_there(angle_deg):
                return
            if angle_deg is None and not self._is_over:
                self._mirror.home(_MOTION_S)
            if not self._is_over:
                self._mirror.move_to(self._calibrated_deg, _MOTION_S)
        except DeviceError as error:
            self._failure = str(error)

    def reopen(self) -> None:
        """Close and open; errors of its `open`."""
        self._mirror.close()
        self._mirror.open()

    def stop(self) -> None:
        """It stands still, wherever it is, and is not moved any more."""
        self._is_over = True
        try:
            self._mirror.stop()
        except DeviceError as error:
            self._failure = str(error)

    def _is_there(self, angle_deg: float | None) -> bool:
        return (
            angle_deg is not None and abs(angle_deg - self._calibrated_deg) <= MIRROR_TOLERANCE_DEG
        )
