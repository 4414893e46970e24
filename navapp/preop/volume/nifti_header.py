"""Reads from a NIfTI header what SimpleITK does not tell: completeness, and leaning axes.

Fields by nifti1.h and nifti2.h of the NIfTI Data Format Working Group.
"""

import gzip
import io
import math
import struct
import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from navapp.geometry.transform import FloatArray

_CHUNK, _LONGEST_HEADER = 1 << 20, 544
# By the header's own size: where the fields stand, and their types.
_LAYOUTS = {
    348: {"dim": (40, "8h"), "bits": (72, "h"), "start": (108, "f"), "code": (254, "h"),
          "sform": (280, "12f"), "unit": (123, "b")},
    540: {"dim": (16, "8q"), "bits": (14, "h"), "start": (168, "q"), "code": (348, "i"),
          "sform": (400, "12d"), "unit": (500, "i")},
}  # fmt: skip
# Lowest three bits of the unit: metres, millimetres, micrometres.
_MM = {1: 1000.0, 2: 1.0, 3: 0.001}


@dataclass(frozen=True, slots=True, eq=False)
class NiftiHeader:
    """A NIfTI file's header."""

    is_whole: bool  # every voxel that is promised is there
    # (4, 4) the file's affine map (`sform`), or None when it has none.
    lps_from_index: FloatArray | None


def read_nifti_header(path: Path) -> NiftiHeader | None:
    """Read a file through, which for a compressed one checks its check sum as well.

    None when it is damaged, or no NIfTI file.
    """
    try:
        with _open(path) as stream:
            start = stream.read(_LONGEST_HEADER)
            n_bytes = len(start)
            while chunk := stream.read(_CHUNK):
                n_bytes += len(chunk)
        return _parse_header(start, n_bytes)
    except (OSError, EOFError, zlib.error, struct.error, ValueError, OverflowError):
        return None


def _open(path: Path) -> io.BufferedReader:
    """The file's content: some that are named .nii.gz are not compressed, and the reverse."""
    with path.open("rb") as stream:
        is_compressed = stream.read(2) == b"\x1f\x8b"
    return io.BufferedReader(gzip.GzipFile(path)) if is_compressed else path.open("rb")


def _parse_header(start: bytes, n_bytes: int) -> NiftiHeader:
    for order in "<>":
        (size,) = struct.unpack_from(f"{order}i", start)
        if size not in _LAYOUTS:
            continue
        field = {
            name: struct.unpack_from(order + kind, start, at)
            for name, (at, kind) in _LAYOUTS[size].items()
        }
        n_axes, *extents = field["dim"]
        n_voxels = math.prod(max(int(extent), 1) for extent in extents[:n_axes])
        promised = int(field["start"][0]) + n_voxels * int(field["bits"][0]) // 8
        sform = None
        if field["code"][0] > 0:
            sform = np.vstack([np.reshape(field["sform"], (3, 4)), [0.0, 0.0, 0.0, 1.0]])
            sform[:3] *= _MM.get(field["unit"][0] & 7, 1.0)
            # NIfTI says RAS.
            sform[:2] *= -1.0
        return NiftiHeader(n_bytes >= promised, sform)
    raise ValueError("no NIfTI header")
