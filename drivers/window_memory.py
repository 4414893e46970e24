"""Shared memory of the window's two processes: two pictures, and until when each may be shown.

The application writes one picture while the window's process may still copy the other. Every field
is one aligned 64-bit word that only one side writes; a woken reader looks at all of them again.
"""

import mmap
from enum import IntEnum

# A side that was silent for longer hangs: pictures are forfeited, or the window's process killed.
HANG_LIMIT_NS = 1_000_000_000
BEAT_S = 0.05
_HEADER_BYTES = 4096


class Field(IntEnum):
    """Words of the header. Pictures count from 1; 0 is black; picture k lies in place k % 2."""

    WRITING = 0
    """Picture that the application began to write last."""
    PUBLISHED = 1
    """Picture that it finished last."""
    VALID_UNTIL_NS = 2
    """Of the picture in place 0, `CLOCK_MONOTONIC`; the next word is that of place 1."""
    WITHDRAWN = 4
    """This picture and those before must not be seen."""
    QUIT = 5
    """The window is to close."""
    APPLICATION_BEAT_NS = 6
    """When the application was alive last."""
    WINDOW_BEAT_NS = 7
    """When the window's process was alive last."""
    SEEN = 8
    """Picture that is visible."""


class WindowMemory:
    """The shared memory, mapped.

    Attributes:
        fields: the header's words, by `Field`.
        pictures: the two places, (height * width * 4) bytes B, G, R, unused, row by row.
    """

    def __init__(self, descriptor: int, width: int, height: int) -> None:
        n_bytes = 4 * width * height
        self._map = mmap.mmap(descriptor, count_memory_bytes(width, height))
        self._view = memoryview(self._map)
        self.fields = self._view[:_HEADER_BYTES].cast("q")
        self.pictures = tuple(
            self._view[start : start + n_bytes]
            for start in (_HEADER_BYTES, _HEADER_BYTES + n_bytes)
        )

    def valid_until_ns(self, picture: int) -> int:
        """When that picture, one of the two last ones, must be gone."""
        return self.fields[Field.VALID_UNTIL_NS + picture % 2]

    def close(self) -> None:
        """Release it; the fields raise ValueError from now on."""
        for view in (self.fields, *self.pictures, self._view):
            view.release()
        self._map.close()


def count_memory_bytes(width: int, height: int) -> int:
    """Size of the memory for pictures of that size."""
    return _HEADER_BYTES + 2 * 4 * width * height
