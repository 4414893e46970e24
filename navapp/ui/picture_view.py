"""The picture with the overlay, as half blocks in a frame that says what it is."""

import numpy as np
from numpy.typing import NDArray
from rich.segment import Segment
from textual import events
from textual.geometry import Region
from textual.strip import Strip
from textual.widget import Widget

from navapp.ui.halfblocks import compute_cell_codes, make_row_strip
from navapp.ui.view import Level, View
from navapp.values import DEPTH_COLOURS, Origin

_WAITING = "waiting for the first picture"
NOTICE = "research, not for clinical use"
_EYE_HINT = "y: video, or what the eye sees in the mirror"
_DEPTH_WORDS = {
    Origin.MATCHED: "matched",
    Origin.FILLED_BORDER: "border",
    Origin.FILLED_INTERIOR: "interior",
    Origin.MISMATCH_FILLED: "mismatch",
    Origin.UNKNOWN: "unknown",
}


class HalfBlocks(Widget):
    """A picture as half blocks; repaints the rows that changed."""

    def __init__(self, widget_id: str) -> None:
        super().__init__(id=widget_id)
        self._preview: NDArray[np.uint8] | None = None
        self._codes: NDArray[np.int32] = np.empty((0, 0), dtype=np.int32)
        self._strips: list[Strip] = []
        self._ramp = ""

    def show_picture(self, picture: NDArray[np.uint8] | None, ramp: str) -> None:
        """Take over a picture (h, w, 3) BGR; a ramp draws it where there are no half blocks."""
        self._ramp = ramp
        if picture is not self._preview:
            self._preview = picture
            self._redraw()

    def on_resize(self, _event: events.Resize) -> None:
        """Fit the picture into the new box."""
        self._redraw()

    def _redraw(self) -> None:
        columns, rows = self.content_size
        preview = self._preview
        if columns < 1 or rows < 1 or preview is None or preview.size == 0:
            self._strips, self._codes = [], np.empty((0, 0), dtype=np.int32)
            self.refresh()
            return
        codes = compute_cell_codes(preview, columns, rows)
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

    def render_line(self, y: int) -> Strip:
        """The prepared row."""
        if y < len(self._strips):
            return self._strips[y]
        width, height = self.content_size
        if not self._strips and y == height // 2:
            return Strip([Segment(_WAITING[:width].center(width), self.rich_style)], width)
        return Strip.blank(width, self.rich_style)


def _tell_depth_key() -> str:
    """What the colours of the depth mean, as markup."""
    words = []
    for origin, word in _DEPTH_WORDS.items():
        blue, green, red = DEPTH_COLOURS[origin]
        words.append(f"[#{red:02x}{green:02x}{blue:02x}]{word}[/]")
    return " · " + " ".join(words)


_DEPTH_KEY = _tell_depth_key()


class PictureView(HalfBlocks):
    """The newest preview of a session, in a frame that says how it stands."""

    def __init__(self) -> None:
        super().__init__("picture")
        self.border_subtitle = NOTICE
        self._title, self._has_eye = "", False

    def show(self, view: View) -> None:
        """Take over the newest picture and say how it stands."""
        key = _DEPTH_KEY if view.snapshot.shows_depth else ""
        if self._title != view.picture_title + key:
            self._title = view.picture_title + key
            self.border_title = self._title
        if self._has_eye != view.snapshot.has_eye:
            self._has_eye = view.snapshot.has_eye
            hint = f"{_EYE_HINT} {view.symbols.dot} " if self._has_eye else ""
            self.border_subtitle = hint + NOTICE
        for level in Level:
            self.set_class(level is view.level, f"-{level.name.lower()}")
        self.show_picture(view.snapshot.preview, view.symbols.ramp)
