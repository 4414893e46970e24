"""A simulated display with a delay, and the view of cameras that look at it."""

import math
import threading

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock
from drivers.frames import Image
from drivers.interfaces import DisplayInfo
from navapp.geometry.rig import StereoRig
from sim_devices.display import SimulatedDisplay
from sim_devices.rigs import NO_TURN, Turn, make_default_rig
from sim_devices.sensor import Eye, Rows

# Radiance of the wall behind, and of a white display.
_WALL, _WHITE = 0.06, 0.5
# Rows and columns of the display in the left picture, and how much farther left the right eye
# sees it: shares of the picture.
_ROWS, _COLUMNS, _DISPARITY = (0.35, 0.7), (0.35, 0.75), 0.1


class LitDisplay:
    """A simulated display that remembers what it was told, and so when it is how bright.

    At every refresh it begins to show what it was told until some delay before.
    """

    def __init__(
        self, clock: Clock, width: int, height: int, *, delay_ns: int, refresh_hz: float
    ) -> None:
        """Set up.

        Args:
            clock: of the calls.
            width: px.
            height: px.
            delay_ns: from a call to the first refresh that can show it.
            refresh_hz: refreshes in a second.
        """
        self.delay_ns = delay_ns
        self._display = SimulatedDisplay(clock, width, height)
        self._clock = clock
        self._refresh_ns = 1e9 / refresh_hz
        self._lock = threading.Lock()
        # When it was told what mean brightness, and until when that holds.
        self._told: list[tuple[int, float, int]] = []

    @property
    def info(self) -> DisplayInfo:
        """Identity and size."""
        return self._display.info

    def open(self) -> None:
        """Start black."""
        self._display.open()

    def show(self, image: Image, valid_until_ns: int) -> None:
        """Show a picture until that moment."""
        n_before = self._display.n_shown
        self._display.show(image, valid_until_ns)
        if self._display.n_shown > n_before:
            self._tell(float(image.mean()) / 255.0, valid_until_ns)

    def blank(self) -> None:
        """Black, now; the light goes out as late as it comes."""
        self._display.blank()
        self._tell(0.0, 0)

    def close(self) -> None:
        """Black and closed."""
        self._display.close()
        self._tell(0.0, 0)

    def mean_light(self, from_ns: int, until_ns: int) -> float:
        """Mean brightness in front of it, 0 to 1, between two times of the clock."""
        first, last = (math.floor(time / self._refresh_ns) for time in (from_ns, until_ns))
        ticks_ns = self._refresh_ns * np.arange(first, last + 2)
        lasts_ns = np.diff(np.clip(ticks_ns, from_ns, until_ns))
        levels = [self._level(round(tick) - self.delay_ns) for tick in ticks_ns[:-1]]
        return float(np.dot(levels, lasts_ns)) / (until_ns - from_ns)

    def _tell(self, level: float, valid_until_ns: int) -> None:
        with self._lock:
            self._told.append((self._clock.now_ns(), level, valid_until_ns))

    def _level(self, time_ns: int) -> float:
        """What it had been told by then."""
        with self._lock:
            for told_ns, level, valid_until_ns in reversed(self._told):
                if told_ns <= time_ns:
                    return level if time_ns < valid_until_ns else 0.0
        return 0.0


class DisplayInView:
    """What two cameras see of a display on a wall: its mean brightness over their exposure."""

    def __init__(
        self, display: LitDisplay, clock: Clock, exposure_ns: int, rig: StereoRig | None = None
    ) -> None:
        """Set up; nothing is rendered before `begin`.

        Args:
            display: that is seen.
            clock: of the display's calls.
            exposure_ns: during which light is gathered, around the time of a picture.
            rig: of the two cameras; the simulated room's when absent.
        """
        self.rig = rig or make_default_rig()
        self._display = display
        self._clock = clock
        self._exposure_ns = exposure_ns
        self._origin_ns = 0

    def begin(self, origin_ns: int) -> None:
        """Say at which time of the clock world time was 0."""
        self._origin_ns = origin_ns

    def render(
        self,
        eye: Eye,
        time_ns: int,
        scale: float = 1.0,
        turn_rad: Turn = NO_TURN,
        rows: Rows | None = None,
    ) -> NDArray[np.float32]:
        """(H, W, 3) BGR linear radiance; 1.0 is a full well at nominal exposure."""
        from_ns = self._origin_ns + time_ns - self._exposure_ns // 2
        until_ns = from_ns + self._exposure_ns
        # Before this moment the display may still be told something that this picture shows.
        self._clock.wait_until_ns(until_ns - self._display.delay_ns)
        light = self._display.mean_light(from_ns, until_ns)
        rig = self.rig if scale == 1.0 else self.rig.scale(scale)
        picture = np.full((rig.height, rig.width, 3), _WALL, np.float32)
        shift = _DISPARITY if eye == "right" else 0.0
        top, bottom = (round(share * rig.height) for share in _ROWS)
        left, right = (round((share - shift) * rig.width) for share in _COLUMNS)
        picture[top:bottom, left:right] = _WALL + _WHITE * light
        return picture

    def path_px(self, from_ns: int, until_ns: int) -> float:
        """Nothing moves; a picture's light is gathered in `render` already."""
        return 0.0
