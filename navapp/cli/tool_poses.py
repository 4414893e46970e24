"""Reads poses of a tracked tool: JSON, or CSV with a time and 16 numbers per line."""

import json
from pathlib import Path

import numpy as np

from navapp.errors import InputError
from navapp.geometry.pose_tables import parse_pose_table
from navapp.geometry.transform import FloatArray, RigidTransform


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
    rows = parse_pose_table(text)
    if len(rows[0][0]) != 1:
        raise ValueError(f"pose 0 has {len(rows[0][0])} columns before its matrix, 1 is expected")
    return [matrix for _, matrix in rows]


def _rigid(number: int, matrix: FloatArray) -> FloatArray:
    try:
        return RigidTransform("tracker", "tool", matrix).matrix
    except ValueError as error:
        raise ValueError(f"pose {number}, {error}") from error
