"""Legacy VTK files (.vtk) of polygonal surfaces, old and 5.1 cell layout, text and binary.

Format: "VTK File Formats", legacy part: a header of four lines, then sections that begin with a
keyword line. Binary numbers are big-endian.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.raw_surface import RawSurface, UnusableContentError
from navapp.geometry.transform import FloatArray

_TYPES = {
    "bit": "u1", "unsigned_char": "u1", "char": "i1", "signed_char": "i1",
    "unsigned_short": "u2", "short": "i2", "unsigned_int": "u4", "int": "i4",
    "unsigned_long": "u8", "long": "i8", "vtktypeint64": "i8", "vtktypeuint64": "u8",
    "vtkidtype": "i4",  # ids are stored as 32 bits, whatever their width in memory
    "float": "f4", "double": "f8",
}  # fmt: skip

# Attributes with one block of numbers: numbers per point or cell.
_ATTRIBUTE_WIDTHS = {
    "normals": 3, "vectors": 3, "tensors": 9, "tensors6": 6,
    "global_ids": 1, "pedigree_ids": 1, "edge_flags": 1,
}  # fmt: skip

_CELLS = ("vertices", "lines", "polygons", "triangle_strips")


def parse_vtk(content: bytes) -> RawSurface:
    """Points, triangles and point normals; polygons and strips are cut into triangles.

    Raises:
        ValueError, IndexError, OverflowError: cut short or damaged; an UnusableContentError says
            that it is no legacy VTK file or holds another data set than POLYDATA.
    """
    head = content.split(b"\n", 2)
    if not content.lower().startswith(b"# vtk datafile version") or len(head) < 3:
        raise UnusableContentError("it does not begin with a legacy VTK header")
    return _Reader(content, len(content) - len(head[2])).surface()


class _Reader:
    """Walks through the sections and keeps what makes a surface."""

    def __init__(self, content: bytes, start: int) -> None:
        self._content = content
        self._at = start
        kind = self._words()
        if kind not in (["ascii"], ["binary"]):
            raise UnusableContentError("it says neither ASCII nor BINARY")
        self._binary = kind == ["binary"]
        # Without its last line break a text may have lost digits of its last number.
        if not self._binary and not content.endswith((b"\n", b"\r")):
            raise ValueError("cut short")
        dataset = self._words()
        if dataset[0] != "dataset":
            raise ValueError("no data set")
        if dataset[1] != "polydata":
            raise UnusableContentError(f"it holds {dataset[1].upper()[:40]} and no POLYDATA")
        self._points: FloatArray = np.empty((0, 3))
        self._normals: FloatArray | None = None
        self._faces = [np.empty((0, 3), dtype=np.int64)]
        self._n_items = 0
        self._of_points = False

    def surface(self) -> RawSurface:
        """Read all sections to the end of the file."""
        while words := self._words():
            keyword = words[0]
            if keyword == "points":
                self._points = self._numbers(3 * _count(words[1]), words[2]).reshape(-1, 3)
            elif keyword in _CELLS:
                self._read_cells(keyword, _count(words[1]), _count(words[2]))
            elif keyword in ("point_data", "cell_data"):
                self._n_items, self._of_points = _count(words[1]), keyword == "point_data"
                if self._of_points and self._n_items != len(self._points):
                    raise ValueError("another number of points")
            else:
                self._read_attribute(words)
        return RawSurface(self._points, np.concatenate(self._faces), self._normals)

    def _read_cells(self, keyword: str, n_first: int, n_second: int) -> None:
        before = self._at
        words = self._words()
        if words[:1] == ["offsets"]:
            offsets = self._whole(n_first, words[1])
            words = self._words()
            if words[0] != "connectivity":
                raise ValueError("no connectivity")
            corners = self._whole(n_second, words[1])
        else:
            self._at = before
            offsets, corners = _split_cells(self._whole(n_second, "int"), n_first)
        if len(offsets) and (
            offsets[0] != 0 or offsets[-1] != len(corners) or (np.diff(offsets) < 0).any()
        ):
            raise ValueError("cells that do not fit their counts")
        if keyword in ("polygons", "triangle_strips"):
            self._faces.append(triangles_of(offsets, corners, strips=keyword != "polygons"))

    def _read_attribute(self, words: list[str]) -> None:
        keyword, n = words[0], self._n_items
        if keyword in _ATTRIBUTE_WIDTHS:
            values = self._numbers(n * _ATTRIBUTE_WIDTHS[keyword], words[2])
            if keyword == "normals" and self._of_points:
                self._normals = values.reshape(-1, 3)
        elif keyword == "scalars":
            width = _count(words[3]) if len(words) > 3 else 1
            if self._words()[0] != "lookup_table":
                raise ValueError("scalars without a table")
            self._numbers(n * width, words[2])
        elif keyword == "color_scalars":
            self._numbers(n * _count(words[2]), "unsigned_char")
        elif keyword == "texture_coordinates":
            self._numbers(n * _count(words[2]), words[3])
        elif keyword == "lookup_table":
            self._numbers(4 * _count(words[2]), "unsigned_char")
        elif keyword == "field":
            for _ in range(_count(words[2])):
                self._skip_array(self._words())
        else:
            raise UnusableContentError(
                f"it is cut short or '{keyword[:40]}' is no section of a surface"
            )

    def _skip_array(self, words: list[str]) -> None:
        if words[0] == "null_array":
            return
        n = _count(words[1]) * _count(words[2])
        if words[3] != "string":
            self._numbers(n, words[3])
            return
        for _ in range(n):
            if self._binary:
                # The two high bits of the first byte say how many bytes the length takes.
                size = 8 >> (self._content[self._at] >> 6)
                packed = int.from_bytes(self._content[self._at : self._at + size], "big")
                self._at += size + (packed & ((1 << (8 * size - 2)) - 1))
                if self._at > len(self._content):
                    raise ValueError("cut short")
            else:
                self._line()

    def _line(self) -> bytes:
        end = self._content.find(b"\n", self._at)
        end = len(self._content) if end < 0 else end
        line = self._content[self._at : end]
        self._at = end + 1
        return line.strip()

    def _words(self) -> list[str]:
        """The next keyword line in lower case; empty at the end of the file."""
        while self._at < len(self._content):
            words = self._line().decode("ascii", errors="replace").lower().split()
            if words and words[0] == "metadata":
                while self._line():  # ends at an empty line
                    pass
            elif words:
                return words
        return []

    def _whole(self, count: int, kind: str) -> NDArray[np.int64]:
        values = self._numbers(count, kind)
        whole = values.astype(np.int64)
        if not np.array_equal(whole, values):
            raise ValueError("a whole number was expected")
        return whole

    def _numbers(self, count: int, kind: str) -> FloatArray:
        code = np.dtype(">" + _TYPES[kind]) if kind in _TYPES else None
        if code is None:
            raise UnusableContentError(f"its numbers are of the unknown type '{kind[:40]}'")
        if count == 0:
            return np.empty(0)
        if not self._binary:
            words = self._content[self._at :].split(None, count)
            rest = words.pop() if len(words) > count else b""
            if len(words) != count:
                raise ValueError("cut short")
            self._at = len(self._content) - len(rest)
            return np.array([float(word) for word in words], dtype=np.float64)
        stored = (count + 7) // 8 if kind == "bit" else count
        values = np.frombuffer(self._content, code, stored, self._at)
        self._at += code.itemsize * stored
        return values.astype(np.float64)


def triangles_of(
    offsets: NDArray[np.int64], corners: NDArray[np.int64], *, strips: bool = False
) -> NDArray[np.int64]:
    """(F, 3) triangles of convex polygons, or of triangle strips, in their order.

    Args:
        offsets: (C + 1,) where each cell begins in the corners, and the end of the last.
        corners: point indices, cell after cell.
        strips: every second triangle of a strip is turned, so that all show the same side.
    """
    sizes = np.diff(offsets)
    n_triangles = np.maximum(sizes - 2, 0)
    first = np.repeat(offsets[:-1], n_triangles)
    before = np.repeat(np.cumsum(n_triangles) - n_triangles, n_triangles)
    step = np.arange(len(first)) - before
    if not strips:
        return np.column_stack(
            [corners[first], corners[first + step + 1], corners[first + step + 2]]
        )
    odd = step % 2
    return np.column_stack(
        [corners[first + step + odd], corners[first + step + 1 - odd], corners[first + step + 2]]
    )


def _split_cells(
    numbers: NDArray[np.int64], n_cells: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Offsets and corners from the old layout, `n i j k` for each cell."""
    if len(numbers) == 4 * n_cells and (numbers[::4] == 3).all():
        return 3 * np.arange(n_cells + 1), numbers.reshape(-1, 4)[:, 1:].ravel()
    sizes = np.fromiter(_cell_sizes(numbers), dtype=np.int64)
    if len(sizes) != n_cells or n_cells + sizes.sum() != len(numbers):
        raise ValueError("cells that do not fit their counts")
    offsets = np.concatenate([[0], np.cumsum(sizes)])
    is_corner = np.ones(len(numbers), dtype=bool)
    is_corner[offsets[:-1] + np.arange(n_cells)] = False
    return offsets, numbers[is_corner]


def _cell_sizes(numbers: NDArray[np.int64]) -> Iterator[int]:
    at = 0
    while at < len(numbers):
        size = int(numbers[at])
        if size < 0:
            raise ValueError("a cell of a negative size")
        yield size
        at += size + 1


def _count(word: str) -> int:
    if not word.isdigit():
        raise ValueError("a count was expected")
    return int(word)
