"""Reads a pose from a JSON file: a `matrix`, or the result of another command."""

import json
from pathlib import Path

import numpy as np

from navapp.errors import PriorError
from navapp.geometry.transform import FloatArray, RigidTransform

_KEYS = ("matrix", "scene_from_model", "camera_from_model")


def read_pose(path: str | Path, target: str, source: str, factor: float) -> RigidTransform:
    """Read `target_from_source` from JSON of one of three keys, or from a text of 4x4 numbers.

    Args:
        path: of the file; the suffix `.txt` says that it holds numbers alone.
        target: name of its frame.
        source: name of its frame.
        factor: mm per unit of the file's lengths.

    Raises:
        PriorError: missing, not understood, or no rigid transform.
    """
    path = Path(path)
    try:
        matrix = _matrix(path)
        matrix[:3, 3] *= factor
        return RigidTransform(target, source, matrix)
    except OSError as error:
        raise PriorError(
            f"pose {path} cannot be read ({error.strerror})",
            subject=str(path),
            remedy="give the file with the start pose",
        ) from error
    except (ValueError, TypeError) as error:
        raise PriorError(
            f"pose {path} cannot be understood ({_one_line(error)})",
            subject=str(path),
            remedy='it holds {"matrix": [[4x4]]}, or as .txt four lines of four numbers',
        ) from error


def _matrix(path: Path) -> FloatArray:
    text = path.read_text(encoding="utf-8")
    if path.suffix.lower() == ".txt":
        rows = [line.partition("#")[0].replace(",", " ").split() for line in text.splitlines()]
        content = [row for row in rows if row]
    else:
        named = json.loads(text)
        known = named if isinstance(named, dict) else {}
        found = [known[key] for key in _KEYS if known.get(key) is not None]
        if not found:
            raise ValueError(f"it has none of {', '.join(_KEYS)}")
        content = found[0]
    matrix = np.array(content, dtype=np.float64)
    if matrix.shape != (4, 4):
        raise ValueError("it is not 4x4")
    return matrix


def _one_line(error: Exception) -> str:
    return str(error).splitlines()[0].rstrip(".")
