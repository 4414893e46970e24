"""A snapshot in words, symbols and levels for the operator, without widgets."""

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from navapp.control.interlocks import describe_slowness
from navapp.control.states import (
    DeviceHealth,
    EventLevel,
    SessionState,
    Snapshot,
)
from navapp.ui.symbols import Symbols
from navapp.values import Reason

_NS_PER_S = 1_000_000_000


class Level(Enum):
    """How good a state is; the value is the style."""

    OK = "bold $success"
    ATTENTION = "bold $warning"
    BAD = "bold $error"
    QUIET = "$text-muted"

    @property
    def band(self) -> str:
        """Style of a filled line."""
        return _BANDS[self]

    def mark(self, symbols: Symbols) -> str:
        """Its symbol."""
        return {
            Level.OK: symbols.ok,
            Level.ATTENTION: symbols.attention,
            Level.BAD: symbols.bad,
            Level.QUIET: symbols.absent,
        }[self]


_BANDS = {
    Level.OK: "bold $background on $success",
    Level.ATTENTION: "bold $background on $warning",
    Level.BAD: "bold $text-on-error on $error",
    Level.QUIET: "$text-muted on $panel",
}

_STATE_LEVELS = {
    SessionState.OFFLINE: Level.QUIET,
    SessionState.NAVIGATING: Level.OK,
    SessionState.SUSPENDED: Level.BAD,
    SessionState.FAULT: Level.BAD,
}

_HEALTH_LEVELS = {
    DeviceHealth.OK: Level.OK,
    DeviceHealth.ABSENT: Level.QUIET,
    DeviceHealth.UNKNOWN: Level.ATTENTION,
    DeviceHealth.TROUBLE: Level.ATTENTION,
    DeviceHealth.LOST: Level.BAD,
}

_EVENT_LEVELS = {
    EventLevel.INFO: Level.QUIET,
    EventLevel.WARNING: Level.ATTENTION,
    EventLevel.ALARM: Level.BAD,
}


# Where a registration cannot be started or accepted yet, it is no remedy.
_WAITING = {
    SessionState.OFFLINE: "wait for the devices",
    SessionState.STARTING: "wait until the session is ready",
    SessionState.REGISTERING: "wait for the candidate",
}


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """A snapshot with what the client itself knows."""

    snapshot: Snapshot  # the newest
    symbols: Symbols  # that the terminal can draw
    start_ns: int  # the session's time that counts as 00:00
    # the session has given nothing new for too long; nothing in the snapshot is believed any more.
    is_silent: bool = False
    title: str = "navapp"  # of the application
    # the picture shows the region around the bone; None: as suits how it is drawn.
    is_near: bool | None = None
    has_colours: bool = True  # enough of them, so that an outline is seen in the picture

    @property
    def is_navigable(self) -> bool:
        """Guides may be shown, and the word is fresh."""
        return self.snapshot.is_navigable and not self.is_silent

    @property
    def is_picture_old(self) -> bool:
        """The picture is the last one before the camera fell silent."""
        is_fault = self.snapshot.state is SessionState.FAULT and not self.snapshot.rig_alarm
        # A rig that has moved goes on showing pictures, until its camera is lost as well.
        is_stopped = self.snapshot.is_camera_silent or is_fault or self._is_camera_lost
        return is_stopped and self.snapshot.picture is not None

    @property
    def _is_camera_lost(self) -> bool:
        return any(
            device.kind == "camera" and device.health is DeviceHealth.LOST
            for device in self.snapshot.devices
        )

    @property
    def level(self) -> Level:
        """Navigable is OK; not navigable is BAD where guides are expected, ATTENTION elsewhere."""
        if self.is_silent or self.snapshot.state in (SessionState.SUSPENDED, SessionState.FAULT):
            return Level.BAD
        if self.is_navigable:
            return Level.OK
        is_expected = (
            self.snapshot.state is SessionState.NAVIGATING and not self.snapshot.is_blanked
        )
        return Level.BAD if is_expected else Level.ATTENTION

    @property
    def state_level(self) -> Level:
        """Of the word for the session's state."""
        if self.is_silent:
            return Level.BAD
        return _STATE_LEVELS.get(self.snapshot.state, Level.ATTENTION)

    @property
    def state_word(self) -> str:
        """The session's state."""
        return "SILENT" if self.is_silent else self.snapshot.state.name

    @property
    def reason(self) -> tuple[str, str]:
        """The first reason's sentence and its remedy; empty texts when navigable."""
        if self.is_silent:
            return "the session gives no answer", "press q, then start it again"
        if not self.snapshot.reasons:
            return "", ""
        first = self.snapshot.reasons[0]
        if first is Reason.TOO_SLOW:
            return describe_slowness(self.snapshot), first.remedy
        is_waiting = first is Reason.NOT_NAVIGATING and self.snapshot.state in _WAITING
        return first.value, _WAITING[self.snapshot.state] if is_waiting else first.remedy

    @property
    def left_picture(self) -> NDArray[np.uint8] | None:
        """The newest of the left camera as it came; None while another picture is shown."""
        return None if self.snapshot.shows_eye else self.snapshot.left_picture

    @property
    def picture_title(self) -> str:
        """What the picture is, and what is wrong with it."""
        name = "SIMULATED EYE in the mirror" if self.snapshot.shows_eye else "left view"
        wrong = self._picture_trouble
        return f"{name} {self.symbols.dot} {wrong}" if wrong else name

    @property
    def _picture_trouble(self) -> str:
        """What is wrong with the picture; empty when guides are shown in it."""
        if self.is_silent:
            return "FROZEN, no answer"
        if self.is_picture_old:
            return "OLD PICTURE, no new one comes"
        if self.snapshot.rig_alarm:
            return "RIG MOVED, the display is dark"
        if self.snapshot.is_blanked:
            return "BLANKED, the display is dark"
        if self.snapshot.is_candidate:
            return "CANDIDATE, not accepted"
        return "" if self.is_navigable else "NO GUIDES"

    def clock(self, time_ns: int) -> str:
        """Minutes and seconds since the session's start, `mm:ss`."""
        seconds = max(time_ns - self.start_ns, 0) // _NS_PER_S
        return f"{seconds // 60:02d}:{seconds % 60:02d}"


def choose_health_level(health: DeviceHealth) -> Level:
    """Of a device."""
    return _HEALTH_LEVELS[health]


def choose_event_level(level: EventLevel) -> Level:
    """Of an event."""
    return _EVENT_LEVELS[level]
