"""Paints pictures over the cells of the screen, where the terminal draws pictures."""

import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from textual.geometry import Region

from navapp.overlay.fitting import put_on_canvas
from navapp.ui.pictures.graphics import Encoder, Graphics

# Processor time of a picture: more makes it smaller, much less makes it larger again.
_MOST_S, _LITTLE_S = 0.010, 0.006
# Sending takes no longer, so that keys and numbers are not kept waiting.
_LONGEST_SENDING_S = 0.1
_SMALLER, _LARGER, _LEAST_SCALE = 0.85, 1.1, 0.25
_N_BEFORE_CHANGE = 3
_N_BEFORE_LARGER = 30
_PATIENCE_S = 1.0
_BEGIN, _END = "\x1b[?2026h\x1b7", "\x1b8\x1b[?2026l"


class PictureText(str):
    """Text that draws a picture; the terminal notes when all of it was sent.

    Attributes:
        sent_s: when, by `time.monotonic`; None while it waits.
    """

    __slots__ = ("sent_s",)
    sent_s: float | None

    def __new__(cls, text: str) -> "PictureText":
        """Not sent yet."""
        made = super().__new__(cls, text)
        made.sent_s = None
        return made


class Scale:
    """How much smaller pictures are drawn than there is room, so that they cost little enough."""

    def __init__(self) -> None:
        self.value = 1.0
        self._n_dear = self._n_cheap = 0

    def note(self, cost_s: float, sending_s: float) -> None:
        """What a picture has cost."""
        is_dear = cost_s > _MOST_S or sending_s > _LONGEST_SENDING_S
        is_cheap = cost_s < _LITTLE_S and sending_s < _LITTLE_S / _MOST_S * _LONGEST_SENDING_S
        self._n_dear = self._n_dear + 1 if is_dear else 0
        self._n_cheap = self._n_cheap + 1 if is_cheap else 0
        if self._n_dear >= _N_BEFORE_CHANGE:
            self.value = max(_SMALLER * self.value, _LEAST_SCALE)
            self._n_dear = 0
        elif self._n_cheap >= _N_BEFORE_LARGER and self.value < 1.0:
            self.value = min(_LARGER * self.value, 1.0)
            self._n_cheap = 0


class Painter:
    """Draws pictures through a terminal's own means, one after the other.

    Args:
        graphics: of the terminal, with an encoder.
        write: hands text to the terminal, behind what was handed before.

    Attributes:
        cell_px: width and height of a character.
        cost_s: processor time of the newest picture.
    """

    def __init__(self, graphics: Graphics, write: Callable[[str], None]) -> None:
        if graphics.encoder is None:
            raise ValueError("the terminal draws no pictures")
        self._encoder: Encoder = graphics.encoder
        self.cell_px = graphics.cell_px
        self._write = write
        self._scale = Scale()
        self._waiting: list[int] = []  # numbers of pictures, who waits longest first
        self._sent, self._begun_s, self.cost_s = PictureText(""), 0.0, 0.0
        self._sent.sent_s = 0.0

    @property
    def has_pixels(self) -> bool:
        """It draws pixels, not half blocks."""
        return self._encoder.has_pixels

    @property
    def scale(self) -> float:
        """Of pictures, as against the room there is."""
        return self._scale.value

    def find_place(self, region: Region) -> Region:
        """The cells that a picture takes of those there are: fewer where pixels are dear."""
        is_kept = self._encoder.is_scaled_by_terminal or not self.has_pixels
        scale = 1.0 if is_kept else self._scale.value
        width, height = max(1, int(scale * region.width)), max(1, int(scale * region.height))
        x = region.x + (region.width - width) // 2
        return Region(x, region.y + (region.height - height) // 2, width, height)

    def paint(self, number: int, picture: NDArray[np.uint8], place: Region) -> bool:
        """Draw a picture over these cells; False when the last one is not through yet.

        Several pictures take turns: who was refused first is next.

        Args:
            number: of the picture; the one before of that number is replaced.
            picture: (h, w[, 3]) uint8 BGR or grey; its aspect ratio is kept.
            place: what `find_place` has said.

        Raises:
            OSError: it cannot be handed over.
        """
        if self._is_busy or self._waiting[:1] not in ([], [number]):
            if number not in self._waiting:
                self._waiting.append(number)
            return False
        self._waiting = self._waiting[1:]
        if self._begun_s:
            self._scale.note(self.cost_s, (self._sent.sent_s or 0.0) - self._begun_s)
        begun_s = time.thread_time()
        width, height = place.width * self.cell_px[0], place.height * self.cell_px[1]
        if self._encoder.is_scaled_by_terminal:
            # It enlarges as well as we do.
            share = max(picture.shape[1] / width, picture.shape[0] / height)
            share = min(1.0, share) * self._scale.value
            width, height = max(1, round(share * width)), max(1, round(share * height))
        canvas = put_on_canvas(picture, width, height)
        if canvas is picture:  # encoders are compiled for arrays that may be written
            canvas = picture.copy()
        text = self._encoder.encode(number, canvas, place.width, place.height)
        at = f"\x1b[{place.y + 1};{place.x + 1}H"
        self._sent = PictureText(f"{_BEGIN}{at}{text}{_END}")
        self._begun_s = time.monotonic()
        self._write(self._sent)
        self.cost_s = time.thread_time() - begun_s
        return True

    @property
    def _is_busy(self) -> bool:
        """The terminal has not taken the last picture; one that never says so is not waited for."""
        if self._sent.sent_s is None:
            return True
        is_late = time.monotonic() > self._begun_s + _PATIENCE_S
        return self._encoder.is_busy and not is_late

    def erase(self, number: int) -> None:
        """Remove a picture; its cells are to be written anew."""
        self._waiting = [other for other in self._waiting if other != number]
        if text := self._encoder.erase(number):
            self._write(text)

    def close(self) -> None:
        """Remove what is left outside of the terminal."""
        self._encoder.close()
