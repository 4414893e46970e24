"""A widget that shows a picture: painted by the terminal where it can, else as half blocks."""

import time
from itertools import count

import numpy as np
from numpy.typing import NDArray
from rich.segment import Segment
from textual import events
from textual.geometry import Region
from textual.strip import Strip
from textual.widget import Widget

from navapp.geometry.box import Box
from navapp.overlay.fitting import fit_size, resize
from navapp.ui.pictures.fitting import find_point
from navapp.ui.pictures.halfblocks import compute_cell_codes, make_row_strip
from navapp.ui.pictures.painter import Painter

_WAITING = "waiting for the first picture"
_NUMBERS = count(1)
# Pixels of a drawing for each half block across and down: lines of one pixel stay visible.
_DRAWN_FINER = 2
_RETRY_S = 0.02


class Picture(Widget):
    """Shows the newest picture; half blocks repaint the rows that changed."""

    def __init__(self, widget_id: str) -> None:
        super().__init__(id=widget_id)
        self._number = next(_NUMBERS)
        self._picture: NDArray[np.uint8] | None = None
        self._part: Box | None = None
        self._codes: NDArray[np.int32] = np.empty((0, 0), dtype=np.int32)
        self._strips: list[Strip] = []
        self._ramp = ""
        self._place: Region | None = None  # where the terminal paints it; None: half blocks
        # The newest picture is not on the terminal yet; a look whether it can be brought is due.
        self._is_due = self._is_waiting = False
        self._blocks_at_s = 0.0  # when half blocks were written last

    def show_picture(
        self, picture: NDArray[np.uint8] | None, ramp: str, part: Box | None = None
    ) -> None:
        """Take over a picture.

        Args:
            picture: (h, w, 3) BGR or (h, w) grey.
            ramp: draws it where there are no half blocks.
            part: that is shown; None: all.
        """
        self._ramp = ramp
        self._is_due |= picture is not self._picture or part != self._part
        self._picture, self._part = picture, part
        if self._is_due or self._is_covered == (self._place is not None):
            self._redraw()

    @property
    def has_pixels(self) -> bool:
        """It is seen pixel by pixel, not as half blocks."""
        return self._painter is not None and self._painter.has_pixels

    def as_seen(self, picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """A picture at the size at which it will be seen, so that lines can be drawn into it."""
        width, height = self.room
        if width < 1 or height < 1:
            return picture
        finer = 1 if self.has_pixels else _DRAWN_FINER
        width, height = fit_size(picture.shape, finer * width, finer * height)
        return picture if width > picture.shape[1] else resize(picture, width, height)

    def find_point(self, x: int, y: int) -> tuple[float, float]:
        """Which point of the picture lies in the middle of a cell: parts of its width, height."""
        shape = (1, 1) if self._shown is None else self._shown.shape
        across, down = self._cell_size
        content, place = self.content_region, self._place or self.content_region
        column, row = x + content.x - place.x, y + content.y - place.y
        room = place.width * across, place.height * down
        return find_point(shape, room, ((column + 0.5) * across, (row + 0.5) * down))

    @property
    def room(self) -> tuple[int, int]:
        """Width and height of what it has room for: pixels, or half blocks."""
        across, down = self._cell_size
        place = self.content_region if self._place is None else self._place
        return place.width * across, place.height * down

    @property
    def _cell_size(self) -> tuple[int, int]:
        return (1, 2) if self._painter is None else self._painter.cell_px

    def on_resize(self, _event: events.Resize) -> None:
        """Fit the picture into the new box."""
        self.leave_place()
        self._redraw()

    def on_unmount(self) -> None:
        """Nothing of it stays."""
        self.leave_place()

    @property
    def _painter(self) -> Painter | None:
        painter: Painter | None = getattr(self.app, "painter", None)
        return painter

    @property
    def _is_covered(self) -> bool:
        """Something lies over it that text alone would not come through."""
        if self._painter is None or self.app.screen is not self.screen:
            return True
        region = self.content_region
        return any(toast.region.overlaps(region) for toast in self.screen.query("Toast"))

    @property
    def _is_on_screen(self) -> bool:
        """All of it; what is painted beyond an edge would move other text."""
        return self.screen.region.contains_region(self.content_region)

    @property
    def _shown(self) -> NDArray[np.uint8] | None:
        """The part of the picture that is shown."""
        picture = self._picture
        if picture is None or picture.size == 0:
            return None
        return picture if self._part is None else picture[self._part.slices]

    def _redraw(self) -> None:
        columns, rows = self.content_size
        if columns < 1 or rows < 1 or self._shown is None:
            self.leave_place()
            self._strips, self._codes = [], np.empty((0, 0), dtype=np.int32)
            self.refresh()
        elif self._painter is not None and not self._is_covered and self._is_on_screen:
            self._find_place(self._painter)
        else:
            self.leave_place()
            self._show_blocks(self._shown, columns, rows)

    def _find_place(self, painter: Painter) -> None:
        place = painter.find_place(self.content_region)
        if place == self._place:
            self._paint()
            return
        self.leave_place()
        # Blank cells first, the picture over them.
        self._place = place
        self.refresh()
        self.call_after_refresh(self._paint)

    def _paint(self) -> None:
        painter, shown = self._painter, self._shown
        if painter is None or self._place is None or shown is None or self._is_covered:
            return
        try:
            self._is_due = not painter.paint(self._number, shown, self._place)
        except OSError:
            self.app.stop_painting()  # type: ignore[attr-defined]
            self._redraw()
            return
        if self._is_due:
            self._paint_soon()

    def _paint_soon(self) -> None:
        """As soon as the terminal has taken what it was given before."""
        if not self._is_waiting:
            self._is_waiting = True
            self.set_timer(_RETRY_S, self._paint_again)

    def _paint_again(self) -> None:
        self._is_waiting = False
        self._paint()

    def leave_place(self) -> None:
        """Have the terminal remove it; half blocks may follow."""
        if self._place is None:
            return
        self._place = None
        self._strips = []
        if self._painter is not None:
            self._painter.erase(self._number)
        self.refresh()

    def _show_blocks(self, picture: NDArray[np.uint8], columns: int, rows: int) -> None:
        now_s = time.monotonic()
        # Below a page or a message; dear, so a picture a second has to do.
        if self._painter is not None and self._strips and now_s < self._blocks_at_s + 1.0:
            return
        self._is_due, self._blocks_at_s = False, now_s
        codes = compute_cell_codes(picture, columns, rows)
        if codes.shape != self._codes.shape or not self._strips:
            self._strips = [make_row_strip(row, self._ramp) for row in codes]
            self._codes = codes
            self.refresh()
            return
        changed = np.flatnonzero((codes != self._codes).any(axis=1)).tolist()
        for y in changed:
            self._strips[y] = make_row_strip(codes[y], self._ramp)
        self._codes = codes
        if changed:
            self.refresh(*(Region(0, y, columns, 1) for y in changed))

    def render_lines(self, crop: Region) -> list[Strip]:
        """As the base class; a painted picture has to come again over cells that are written."""
        if self._place is not None:
            self._is_due = True
            self._paint_soon()
        return super().render_lines(crop)

    def render_line(self, y: int) -> Strip:
        """The prepared row; blank below a painted picture."""
        if self._place is None and y < len(self._strips):
            return self._strips[y]
        width, height = self.content_size
        if self._shown is None and y == height // 2:
            return Strip([Segment(_WAITING[:width].center(width), self.rich_style)], width)
        return Strip.blank(width, self.rich_style)
