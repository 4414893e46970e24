"""The cross on the display: where it lies, and that its light does not go out."""

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock
from drivers.interfaces import Display
from navapp.control.display_link import DisplayLink
from navapp.control.mirror_alignment.cross_picture import draw_cross


class ShownCross:
    """Lights one cross, or none.

    Args:
        display: opened.
        clock: of its expiries.
        valid_ms: it turns black after this, if nobody renews it.
    """

    def __init__(self, display: Display, clock: Clock, valid_ms: float) -> None:
        self._link, self._clock, self._valid_ns = DisplayLink(display), clock, round(valid_ms * 1e6)
        self.pixel: tuple[int, int] | None = None
        self._drawn: tuple[tuple[int, int], NDArray[np.uint8]] | None = None

    @property
    def trouble(self) -> str:
        """What is wrong with the display; empty when nothing is."""
        return self._link.trouble

    def put(self, pixel: tuple[int, int] | None) -> None:
        """Light it there (px of the display's picture), or not at all."""
        self.pixel = pixel
        if pixel is None:
            self._link.darken()

    def nudge(self, right_px: int, down_px: int, flips: tuple[bool, bool]) -> None:
        """Move it as the eye sees it; it stays on the display.

        Args:
            right_px: as the eye sees it.
            down_px: likewise.
            flips: columns and rows are shown the other way than the eye reads them.
        """
        if self.pixel is None:
            return
        info = self._link.display.info
        u = self.pixel[0] + (-right_px if flips[0] else right_px)
        v = self.pixel[1] + (-down_px if flips[1] else down_px)
        self.pixel = min(max(u, 0), info.width - 1), min(max(v, 0), info.height - 1)

    def renew(self) -> None:
        """Show it on."""
        if self.pixel is None:
            return
        info = self._link.display.info
        if self._drawn is None or self._drawn[0] != self.pixel:
            self._drawn = self.pixel, draw_cross(info.width, info.height, self.pixel)
        until_ns = self._clock.now_ns() + self._valid_ns
        self._link.show(self._drawn[1], until_ns, has_guides=False, is_scaled=False)

    def close(self) -> None:
        """Dark."""
        self._link.close()
