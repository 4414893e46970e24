"""Reads poses of a tracked tool: JSON, or CSV with a time and 16 numbers per line."""

import csv
import json
from pathlib import Path

import numpy as np

from navapp.errors import InputError
from navapp.geometry.transform import FloatArray, RigidTransform

_N_COLUMNS = 17


def read_tool_poses(path: str | Path) -> FloatArray:
    """(N, 4, 4) `tracker_from_tool`, mm, as they stand in the file.

    Raises:
        InputError: missing, not understood, or a pose that is none.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8-sig")
        matrices = _from_json(text) if path.suffix.lower() == ".json" else _from_csv(text)
        if not matrices:
            raise ValueError("it holds no poses")
        return np.array([_rigid(n, matrix) for n, matrix in enumerate(matrices)])
    except OSError as error:
        raise InputError(
            f"poses {path} cannot be read ({error.strerror})",
            subject=str(path),
            remedy="give an existing file with poses of the tool",
        ) from error
    except (ValueError, TypeError, KeyError) as error:
        raise InputError(
            f"poses {path} cannot be understood ({str(error).splitlines()[0]})",
            subject=str(path),
            remedy='give CSV lines of time_ns and 16 numbers, or {"poses": [{"matrix": [[4x4]]}]}',
        ) from error


def _from_json(text: str) -> list[FloatArray]:
    content = json.loads(text)
    if not isinstance(content, dict) or not isinstance(content.get("poses"), list):
        raise ValueError("it has no list of poses")
    return [np.array(pose["matrix"], dtype=np.float64) for pose in content["poses"]]


def _from_csv(text: str) -> list[FloatArray]:
    lines = [line for line in csv.reader(text.splitlines()) if "".join(line).strip()]
    if lines and not _is_number(lines[0][0]):
        lines = lines[1:]
    matrices = []
    for number, line in enumerate(lines):
        if len(line) != _N_COLUMNS:
            raise ValueError(f"pose {number} has {len(line)} numbers, {_N_COLUMNS} are expected")
        matrices.append(np.array([float(word) for word in line[1:]]).reshape(4, 4))
    return matrices


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _rigid(number: int, matrix: FloatArray) -> FloatArray:
    try:
        return RigidTransform("tracker", "tool", matrix).matrix
    except ValueError as error:
        raise ValueError(f"pose {number}, {error}") from error
