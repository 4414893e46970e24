"""Point Cloud Data (PCD) files."""

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.number_tables import number_table, whole_text
from navapp.geometry.raw_surface import RawSurface, UnusableContentError

_NO_FACES = np.empty((0, 3), dtype=np.int64)


@dataclass(frozen=True, slots=True)
class _PcdField:
    """Where a field's numbers are: its first byte in a record, its first column in a text."""

    offset: int
    column: int
    dtype: np.dtype[np.generic]


def parse_pcd(content: bytes) -> RawSurface:
    """Point Cloud Data up to 0.7: header lines, then text, records or packed columns."""
    end = re.search(rb"^DATA[ \t]+(\w+)[ \t]*\r?\n", content, re.MULTILINE)
    if end is None:
        raise UnusableContentError("it does not begin with a PCD header")
    lines = content[: end.start()].decode("ascii", errors="replace").splitlines()
    header = {words[0]: words[1:] for line in lines if (words := line.split())}
    try:
        fields = _pcd_fields(header)
        n = int(header["WIDTH"][0]) * int(header.get("HEIGHT", ["1"])[0])
        if n < 0 or n != int(header.get("POINTS", [str(n)])[0]):
            raise ValueError(n)
    except (KeyError, ValueError, TypeError, IndexError) as error:
        raise UnusableContentError("its PCD header is damaged") from error
    if n == 0:
        return RawSurface(np.empty((0, 3)), _NO_FACES)
    columns = _pcd_columns(content[end.end() :], end[1].lower(), fields, n)
    points, normals = (
        np.column_stack([columns[name].astype(np.float64) for name in names])
        if all(name in columns for name in names)
        else None
        for names in ("xyz", [f"normal_{axis}" for axis in "xyz"])
    )
    if points is None:
        raise UnusableContentError("it has no fields x, y and z")
    return RawSurface(points, _NO_FACES, normals)


def _pcd_columns(
    body: bytes, data: bytes, fields: dict[str, _PcdField], n: int
) -> dict[str, NDArray[np.generic]]:
    """(n,) numbers of each field."""
    end = fields.pop("")
    if data == b"ascii":
        table = number_table(whole_text(body))
        if table.shape != (n, end.column):
            raise UnusableContentError("it is cut short, or its header counts other numbers")
        return {name: table[:, field.column] for name, field in fields.items()}
    if data == b"binary_compressed":
        body = _pcd_unpacked(body, n * end.offset)
        return {
            name: np.frombuffer(body, field.dtype, n, n * field.offset)
            for name, field in fields.items()
        }
    if data != b"binary":
        raise UnusableContentError("its DATA is not ascii, binary or binary_compressed")
    if n * end.offset > len(body):
        raise UnusableContentError("it is cut short")
    record = np.dtype(
        {
            "names": list(fields),
            "formats": [field.dtype for field in fields.values()],
            "offsets": [field.offset for field in fields.values()],
            "itemsize": end.offset,
        }
    )
    records = np.frombuffer(body, record, n)
    return {name: records[name] for name in fields}


def _pcd_fields(header: dict[str, list[str]]) -> dict[str, _PcdField]:
    """The fields of one number by name; "" stands for the end of a record."""
    names = header.get("FIELDS") or header["COLUMNS"]
    counts = [int(count) for count in header.get("COUNT", ["1"] * len(names))]
    fields: dict[str, _PcdField] = {}
    offset = column = 0
    for name, kind, size, n in zip(names, header["TYPE"], header["SIZE"], counts, strict=True):
        dtype = np.dtype("<" + kind.lower() + str(int(size)))
        if n < 1 or kind not in "FIU" or (n == 1 and name in fields):
            raise ValueError(name)
        if n == 1 and name != "_":
            fields[name] = _PcdField(offset, column, dtype)
        offset, column = offset + n * dtype.itemsize, column + n
    return {**fields, "": _PcdField(offset, column, np.dtype("u1"))}


def _pcd_unpacked(body: bytes, size: int) -> bytes:
    """Undo the LZF packing: runs of bytes, and references to bytes that came before."""
    n_packed, n_unpacked = (int.from_bytes(body[at : at + 4], "little") for at in (0, 4))
    packed = body[8 : 8 + n_packed]
    if len(packed) != n_packed or n_unpacked != size:
        raise UnusableContentError("it is cut short")
    unpacked = bytearray()
    at = 0
    while at < len(packed) and len(unpacked) <= size:
        length, high = packed[at] >> 5, packed[at] & 31
        at += 1
        if length == 0:
            unpacked += packed[at : at + high + 1]
            at += high + 1
            continue
        if length == 7:
            length += packed[at]
            at += 1
        start = len(unpacked) - 256 * high - packed[at] - 1
        if start < 0:
            raise UnusableContentError("its packed numbers are damaged")
        # A reference may run into what it writes: the piece then repeats.
        piece = bytes(unpacked[start : start + length + 2])
        unpacked += (piece * (1 + (length + 2) // len(piece)))[: length + 2]
        at += 1
    if len(unpacked) != size:
        raise UnusableContentError("its packed numbers are damaged")
    return bytes(unpacked)
