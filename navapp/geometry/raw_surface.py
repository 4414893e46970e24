"""What a surface file holds before anything of it is checked, and what may be wrong with it."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from navapp.errors import InputError
from navapp.geometry.transform import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class RawSurface:
    """What a surface file holds, as stored and unchecked: NaN points, faces out of range."""

    points: FloatArray  # (V, 3) coordinates in the file's unit
    faces: NDArray[np.integer]  # (F, 3) indices into the points; (0, 3) for a cloud
    normals: FloatArray | None = None  # (V, 3) of any length, or None when the file has none
    unit: str | None = None  # what the file says of its unit, lower case, or None


class UnusableContentError(ValueError):
    """What is wrong with a file's content, in words for the user."""


def surface_content(path: Path, kind: str) -> bytes:
    """The bytes of a surface file.

    Raises:
        InputError: missing, a folder, not readable.
    """
    try:
        return path.read_bytes()
    except OSError as error:
        raise InputError(
            f"surface {path} cannot be read ({error.strerror})",
            subject=str(path),
            remedy=f"give the path of an existing {kind} file",
        ) from error


def damaged(path: Path, why: str, kind: str = "PLY") -> InputError:
    """The error for a surface file that cannot be understood."""
    again = "binary or ASCII PLY with triangles" if kind == "PLY" else f"{kind} or as binary PLY"
    return InputError(
        f"surface {path} is not a usable {kind} file, {why}",
        subject=str(path),
        remedy=f"export it again as {again}",
    )
