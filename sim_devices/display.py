"""A simulated display that stores its picture."""

import threading

import numpy as np

from drivers.clock import Clock
from drivers.frames import Image
from drivers.interfaces import DisplayInfo
from navapp.errors import DeviceLost


class SimulatedDisplay:
    """A display whose picture `visible_image` returns, under the rules of every display."""

    def __init__(
        self,
        clock: Clock,
        width: int = 1280,
        height: int = 720,
        *,
        flips_horizontally: bool = False,
        flips_vertically: bool = False,
    ) -> None:
        self._clock = clock
        self._info = DisplayInfo(
            "sim:display", "simulated", True, width, height, flips_horizontally, flips_vertically
        )
        self._lock = threading.Lock()
        self._is_open = False
        self._picture: Image | None = None
        self._valid_until_ns = 0
        self._n_shown = 0

    @property
    def info(self) -> DisplayInfo:
        """Identity, size and the flips it was given."""
        return self._info

    @property
    def n_shown(self) -> int:
        """Pictures that became visible so far."""
        with self._lock:
            return self._n_shown

    def open(self) -> None:
        """Start black; nothing happens when open."""
        with self._lock:
            self._is_open = True

    def show(self, image: Image, valid_until_ns: int) -> None:
        """Show a picture until that moment; one that is expired already changes nothing."""
        shape = (self._info.height, self._info.width, 3)
        if image.shape != shape or image.dtype != np.uint8:
            raise ValueError(f"the display takes uint8 pictures of shape {shape}")
        picture = image.copy()
        with self._lock:
            if not self._is_open:
                raise DeviceLost(
                    "the simulated display is not open",
                    subject=self._info.name,
                    remedy="open it before showing pictures",
                )
            if valid_until_ns <= self._clock.now_ns():
                return
            self._picture, self._valid_until_ns = picture, valid_until_ns
            self._n_shown += 1

    def blank(self) -> None:
        """Black, now."""
        with self._lock:
            self._picture = None

    def close(self) -> None:
        """Black and closed."""
        with self._lock:
            self._is_open, self._picture = False, None

    def visible_image(self) -> Image:
        """(height, width, 3) uint8 BGR that a person in front of it sees now, flips applied."""
        with self._lock:
            picture = self._picture
            if picture is None or self._clock.now_ns() >= self._valid_until_ns:
                return np.zeros((self._info.height, self._info.width, 3), np.uint8)
        if self._info.flips_horizontally:
            picture = picture[:, ::-1]
        if self._info.flips_vertically:
            picture = picture[::-1]
        return picture.copy()
