"""Whether a NIfTI file holds all the voxels that its header promises."""

import gzip
import io
import math
import struct
import zlib
from pathlib import Path

_CHUNK = 1 << 20
# Header size, then where dimensions, bits per voxel and the start of the voxels stand:
# nifti1.h and nifti2.h of the NIfTI Data Format Working Group.
_LAYOUTS = {348: (40, "8h", 72, 108, "f"), 540: (16, "8q", 14, 168, "q")}


def nifti_is_whole(path: Path) -> bool:
    """Read the file through, which for a compressed one checks its check sum as well."""
    try:
        with _opened(path) as stream:
            header = stream.read(544)
            length = len(header)
            while chunk := stream.read(_CHUNK):
                length += len(chunk)
        return length >= _promised_bytes(header)
    except (OSError, EOFError, zlib.error, struct.error, ValueError, OverflowError):
        return False


def _opened(path: Path) -> io.BufferedReader:
    """The file's content: some that are named .nii.gz are not compressed, and the reverse."""
    with path.open("rb") as stream:
        is_compressed = stream.read(2) == b"\x1f\x8b"
    return io.BufferedReader(gzip.GzipFile(path)) if is_compressed else path.open("rb")


def _promised_bytes(header: bytes) -> int:
    for order in "<>":
        (size,) = struct.unpack_from(f"{order}i", header)
        if size in _LAYOUTS:
            dim_at, dim_type, bits_at, start_at, start_type = _LAYOUTS[size]
            n_axes, *extents = struct.unpack_from(order + dim_type, header, dim_at)
            (bits,) = struct.unpack_from(f"{order}h", header, bits_at)
            (start,) = struct.unpack_from(order + start_type, header, start_at)
            n_voxels = math.prod(max(int(extent), 1) for extent in extents[:n_axes])
            return int(start + n_voxels * bits // 8)
    raise ValueError("no NIfTI header")
