"""Pictures by kitty's graphics protocol: through shared memory, or compressed in the text.

Source: https://sw.kovidgoyal.net/kitty/graphics-protocol/
"""

import base64
import contextlib
import os
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

_MEMORY = Path("/dev/shm")
# The protocol's longest piece of text.
_PIECE = 4096
# Noise takes most of the room: what is compressed has 32 levels a channel.
_LEVEL, _KEPT_BITS = 1, np.uint8(0xF8)


def write_command(keys: str, payload: str = "") -> str:
    """One command of the protocol, nothing of it answered."""
    return f"\x1b_G{keys},q=2;{payload}\x1b\\"


@dataclass(frozen=True, slots=True)
class Question:
    """Whether a terminal draws pictures of one pixel."""

    text: str  # to be sent
    path: Path  # of the picture in the shared memory

    @property
    def was_read(self) -> bool:
        """The terminal has read that picture, and removed it as the protocol says."""
        return not self.path.exists()


@contextlib.contextmanager
def ask_whether_drawn(local: int, compressed: int) -> Iterator[Question]:
    """Numbers of the answers: of a picture in the shared memory, and of one in the text."""
    path = _MEMORY / f"navapp-{os.getpid()}-asked"
    keys = "a=q,s=1,v=1,f=24"
    text = f"\x1b_G{keys},i={compressed},t=d;{_to_text(bytes(3))}\x1b\\"
    with contextlib.suppress(OSError):
        _write_memory(path, bytes(3))
        name = _to_text(f"/{path.name}".encode())
        text += f"\x1b_G{keys},i={local},t=s,S=3;{name}\x1b\\"
    try:
        yield Question(text, path)
    finally:
        path.unlink(missing_ok=True)


class KittyEncoder:
    """Hands pictures over; the terminal scales them to their cells.

    Args:
        is_local: the terminal can read this computer's shared memory, and removes what it has read.
    """

    has_pixels = True
    is_scaled_by_terminal = True

    def __init__(self, *, is_local: bool) -> None:
        self._is_local = is_local
        self._names = tuple(f"navapp-{os.getpid()}-{k}" for k in range(2))
        self._k = 0

    @property
    def is_busy(self) -> bool:
        """The terminal has not read the last picture yet."""
        return self._is_local and (_MEMORY / self._names[self._k]).exists()

    def encode(self, number: int, picture: NDArray[np.uint8], columns: int, rows: int) -> str:
        """What draws (h, w, 3) BGR over so many cells from the cursor, in the place of its like.

        Raises:
            OSError: there is no room in the shared memory.
        """
        height, width = picture.shape[:2]
        keys = f"a=T,f=24,i={number},p=1,C=1,s={width},v={height},c={columns},r={rows}"
        pixels = np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2RGB), dtype=np.uint8)
        if self._is_local:
            self._k = 1 - self._k
            name = self._names[self._k]
            _write_memory(_MEMORY / name, pixels.data)
            return write_command(f"{keys},t=s,S={pixels.nbytes}", _to_text(f"/{name}".encode()))
        text = _to_text(zlib.compress((pixels & _KEPT_BITS).data, _LEVEL))
        pieces = [text[k : k + _PIECE] for k in range(0, len(text), _PIECE)]
        last = len(pieces) - 1
        first = f"{keys},t=d,o=z,m={int(last > 0)}"
        return "".join(
            write_command(first if k == 0 else f"m={int(k < last)}", piece)
            for k, piece in enumerate(pieces)
        )

    def erase(self, number: int) -> str:
        """What removes it."""
        return write_command(f"a=d,d=I,i={number}")

    def close(self) -> None:
        """Remove what no terminal has read."""
        for name in self._names:
            with contextlib.suppress(OSError):
                (_MEMORY / name).unlink()


def _to_text(data: bytes) -> str:
    return base64.standard_b64encode(data).decode("ascii")


def _write_memory(path: Path, data: bytes | memoryview) -> None:
    """Readable by this user alone: it may be a patient."""
    path.unlink(missing_ok=True)
    descriptor = os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600)
    with open(descriptor, "wb") as file:
        file.write(data)
