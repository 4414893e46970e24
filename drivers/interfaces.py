"""Protocols of all devices, the same for real and simulated backends.

Every protocol has its contract in `drivers.contracts`. Closing always works: twice, from any state,
and afterwards no thread, descriptor or light remains. A backend is used from one thread at a time.
"""

from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field
from enum import Enum
from typing import Protocol

from drivers.clock import Clock
from drivers.frames import Image, StereoFrame
from navapp.geometry.rig import StereoRig


@dataclass(frozen=True, slots=True)
class CameraInfo:
    """Properties of a stereo camera."""

    name: str  # for people; a simulated camera's name begins with `sim:`
    backend: str  # as in the configuration
    is_simulated: bool  # the pictures are not of this world
    # `read` computes or loads the next frame at once and drops none; otherwise the camera runs by
    # itself and must be read by a `ReaderThread`.
    is_stepped: bool
    # width, height: of one picture, px.
    width: int
    height: int
    serials: tuple[str, str] = ("", "")  # left, right; empty texts when unknown
    # measured_rate_hz, measured_skew_ms: of the frames handed out so far, None before.
    measured_rate_hz: float | None = None
    measured_skew_ms: float | None = None
    factory_rig: StereoRig | None = None  # a calibration that the device itself carries
    n_frames: int | None = None  # length of a finite source, None for a live one
    n_unpaired: int = 0  # pictures that found no partner of their instant, since it was opened
    n_stale: int = 0  # pictures that came too old or damaged, since it was opened
    # as the device told them last, by the names of `set`.
    controls: Mapping[str, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()  # what else it told when it was opened: link, source of its times


class StereoCamera(Protocol):
    """A source of stereo frames."""

    @property
    def info(self) -> CameraInfo:
        """Identity and measured behaviour; complete after `open`."""
        ...

    def open(self) -> None:
        """Start; nothing happens when open.

        Raises:
            DeviceNotFound, WrongDevice, DeviceError; InputError for recorded sources.
        """
        ...

    def read(self, timeout_s: float) -> StereoFrame:
        """The next frame, newer than the last one.

        Raises:
            DeviceTimeout: none within the time; the camera may recover.
            DeviceLost: it is gone or was never opened; close, then open again.
            EndOfSequence: a finite source is exhausted.
        """
        ...

    def set(self, control: str, value: float) -> float:
        """Ask for a control (`exposure_ms`, `gain_db`, ...) and return what the camera says it has.

        Raises:
            UnsupportedControl: it has none of that name, or the value is out of its range.
        """
        ...

    def close(self) -> None:
        """Stop and release; never fails."""
        ...


@dataclass(frozen=True, slots=True)
class DisplayInfo:
    """Properties of a display; flips are those that the backend applies by itself."""

    name: str
    backend: str
    is_simulated: bool
    width: int
    height: int
    flips_horizontally: bool = False
    flips_vertically: bool = False


class Display(Protocol):
    """A screen or projector that shows pictures with an expiry."""

    @property
    def info(self) -> DisplayInfo:
        """Identity and size."""
        ...

    def open(self) -> None:
        """Start black; nothing happens when open."""
        ...

    def show(self, image: Image, valid_until_ns: int) -> None:
        """Show a picture (H, W, 3) uint8 BGR of the display's size until that moment, then black.

        A picture that is already expired is not shown.

        Raises:
            DeviceLost: not open, or the display is gone.
            ValueError: another size or type.
        """
        ...

    def blank(self) -> None:
        """Black, now. Never fails and never waits."""
        ...

    def close(self) -> None:
        """Black, then release; never fails."""
        ...


class CommandResult(Enum):
    """How far a command to a slow device is known to have come."""

    ACCEPTED = "accepted"
    FINISHED = "finished"
    VERIFIED = "verified"


class PowerState(Enum):
    """Of a projector's lamp."""

    ABSENT = "absent"
    STANDBY = "standby"
    WARMING = "warming"
    ON = "on"
    COOLING = "cooling"
    FAULT = "fault"
    UNKNOWN = "unknown"


@dataclass(frozen=True, slots=True)
class ProjectorStatus:
    """What was read back; None means that this projector cannot say.

    `keystone` is its horizontal and vertical correction in the projector's own steps: they tell
    that it was changed, not by how much.
    """

    power: PowerState
    source: str | None = None
    is_muted: bool | None = None
    flips_horizontally: bool | None = None
    flips_vertically: bool | None = None
    lamp_hours: tuple[int, ...] = ()
    faults: tuple[str, ...] = ()
    serial: str = ""
    keystone: tuple[int, int] | None = None
    is_frozen: bool | None = None


class ProjectorControl(Protocol):
    """Control line of a projector (not its picture).

    Every command and `status` may raise DeviceLost (not open, or gone), DeviceTimeout or
    DeviceProtocolError; a command also UnsupportedControl. A projector that is ABSENT has no
    command, and says so in any state.
    """

    @property
    def name(self) -> str:
        """For people; a simulated one begins with `sim:`."""
        ...

    def open(self) -> None:
        """Connect; nothing happens when open."""
        ...

    def set_power(self, is_on: bool, timeout_s: float) -> CommandResult:
        """Lamp on or off; the result says whether it was accepted, finished or verified."""
        ...

    def set_source(self, source: str, timeout_s: float) -> CommandResult:
        """Choose the picture source."""
        ...

    def set_mute(self, is_muted: bool, timeout_s: float) -> CommandResult:
        """Hide the picture."""
        ...

    def set_flips(self, horizontally: bool, vertically: bool, timeout_s: float) -> CommandResult:
        """Mirror the picture in the projector."""
        ...

    def status(self) -> ProjectorStatus:
        """Read everything back."""
        ...

    def close(self) -> None:
        """Disconnect; never fails."""
        ...


@dataclass(frozen=True, slots=True)
class MirrorInfo:
    """Properties of a mirror mount."""

    name: str
    backend: str
    is_simulated: bool
    is_movable: bool
    serial: str = ""


class MirrorMount(Protocol):
    """The mount of the half-silvered mirror.

    A movable one raises DeviceLost when it is not open or gone, DeviceTimeout or
    DeviceProtocolError when it does not answer as it should. A fixed one always knows its angle.
    """

    @property
    def info(self) -> MirrorInfo:
        """Identity."""
        ...

    def open(self) -> None:
        """Connect; nothing happens when open."""
        ...

    def home(self, timeout_s: float) -> None:
        """Find the reference position; must come before `move_to`. Nothing happens when fixed."""
        ...

    def move_to(self, angle_deg: float, timeout_s: float) -> None:
        """Move and wait until it stands.

        Raises:
            UnsupportedControl: not movable, not homed, out of range.
        """
        ...

    def position_deg(self) -> float | None:
        """Where it stands; None when that is not known."""
        ...

    def stop(self) -> None:
        """Stop moving, now; any thread may call it, and the motion that it ends then raises."""
        ...

    def close(self) -> None:
        """Stop and disconnect; never fails."""
        ...


@dataclass(frozen=True, slots=True)
class DeviceSet:
    """The opened devices of a session, and its clock."""

    camera: StereoCamera
    display: Display
    projector: ProjectorControl
    mirror: MirrorMount
    clock: Clock

    def close(self) -> None:
        """Close all, the display first so that it is dark; one that fails stops no other."""
        with ExitStack() as stack:
            for device in (self.mirror, self.projector, self.camera, self.display):
                stack.callback(device.close)
