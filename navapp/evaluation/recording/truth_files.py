"""Reads what is known of where the bones of a recording really were: one of three kinds of file.

- poses of bones per picture (JSON, or CSV of `index, body` and 16 numbers),
- time-stamped poses of another tracker (JSON, or CSV of `time_ns` and 16 numbers),
- points of a bone that were touched in some pictures (JSON).
"""

import json
import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from navapp.errors import InputError
from navapp.geometry.pose_tables import parse_pose_table
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.values import FOLLOWED_BONES

_POSE_KEYS = ("camera_from_model", "T_leftcam_from_ct")


@dataclass(frozen=True, slots=True)
class OwnError:
    """How uncertain a truth is itself, as who made it states; None: it is not stated."""

    sd_mm: float | None = None  # standard deviation of a place on the bone
    sd_deg: float | None = None  # standard deviation of the bone's turn


@dataclass(frozen=True, slots=True, eq=False)
class PoseTruth:
    """Poses of bones per picture."""

    poses: Mapping[str, Mapping[int, RigidTransform]]  # bone -> picture -> left camera from bone
    own_error: OwnError = OwnError()

    @property
    def numbers(self) -> set[int]:
        """Of the pictures that it speaks of."""
        return {number for of_bone in self.poses.values() for number in of_bone}


@dataclass(frozen=True, slots=True, eq=False)
class TrackerTruth:
    """Poses of a marker that is fixed to the bone, seen by a tracker that is fixed to the rig."""

    times_ns: NDArray[np.int64]  # (N,) on the tracker's clock, increasing
    matrices: FloatArray  # (N, 4, 4) tracker from marker, mm
    own_error: OwnError = OwnError()


@dataclass(frozen=True, slots=True, eq=False)
class Touch:
    """A point of the bone that was touched."""

    number: int  # of the picture
    name: str  # of the point
    left_mm: FloatArray  # (3,) where the tip was, in the left camera


@dataclass(frozen=True, slots=True, eq=False)
class DivotTruth:
    """Points of a bone, and where they were found in some pictures."""

    divots_mm: Mapping[str, FloatArray]  # name -> (3,) in plan coordinates
    touched: tuple[Touch, ...]
    own_error: OwnError = OwnError()

    @property
    def numbers(self) -> set[int]:
        """Of the pictures that it speaks of."""
        return {touch.number for touch in self.touched}


Truth = PoseTruth | TrackerTruth | DivotTruth


def read_truth(path: str | Path) -> Truth:
    """Read a truth file of any kind.

    Raises:
        InputError: missing, not understood, or a pose that is none.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8-sig")
        return _from_csv(text) if path.suffix.lower() == ".csv" else _from_json(json.loads(text))
    except OSError as error:
        raise InputError(
            f"truth {path} cannot be read ({error.strerror})",
            subject=str(path),
            remedy="give an existing JSON or CSV file (docs/phantom-study.md)",
        ) from error
    except (ValueError, TypeError, KeyError) as error:
        raise InputError(
            f"truth {path} cannot be understood ({_describe(error)})",
            subject=str(path),
            remedy="docs/phantom-study.md shows the three kinds of file",
        ) from error


def check_truth(truth: Truth, path: str | Path, numbers: Collection[int], bone: str) -> None:
    """Refuse a truth that speaks of pictures that there are not, or not of the bone.

    Args:
        truth: of the file.
        path: of it, for messages.
        numbers: of the recording's pictures.
        bone: that is followed.

    Raises:
        InputError: it does.
    """
    if isinstance(truth, TrackerTruth):
        return
    unknown = sorted(truth.numbers - set(numbers))
    if unknown:
        raise InputError(
            f"truth {path} speaks of picture {unknown[0]}, and the recording has none of that "
            "number",
            subject=str(path),
            remedy=f"its pictures are {min(numbers)} to {max(numbers)}; correct the index",
        )
    if isinstance(truth, PoseTruth) and bone not in truth.poses:
        raise InputError(
            f"truth {path} knows nothing of the {bone}",
            subject=str(path),
            remedy=f"it has {', '.join(truth.poses)}; choose one with --bone, or add the {bone}",
        )


def _describe(error: Exception) -> str:
    if isinstance(error, KeyError):
        return f"{error.args[0]} is missing"
    return str(error).splitlines()[0].rstrip(".")


def _from_json(content: Any) -> Truth:
    if not isinstance(content, dict):
        raise ValueError("it is no object with names")
    own_error = OwnError(_read_sd(content, "sd_mm"), _read_sd(content, "sd_deg"))
    kinds: dict[str, Callable[[Mapping[str, Any], OwnError], Truth]] = {
        "frames": _read_poses, "poses": _read_tracker, "touched": _read_divots
    }  # fmt: skip
    found = [name for name in kinds if name in content]
    if len(found) != 1:
        raise ValueError(f"it must have one of {', '.join(kinds)}, and has {len(found)} of them")
    if not isinstance(content[found[0]], list) or not content[found[0]]:
        raise ValueError(f"{found[0]} is no list, or empty")
    return kinds[found[0]](content, own_error)


def _read_sd(content: Mapping[str, Any], key: str) -> float | None:
    value = content.get(key)
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 <= value < math.inf:
        raise ValueError(f"{key} is no number from 0 on")
    return float(value)


def _read_poses(content: Mapping[str, Any], own_error: OwnError) -> PoseTruth:
    poses: dict[str, dict[int, RigidTransform]] = {}
    for entry in content["frames"]:
        number = _read_whole(entry["index"], "index")
        key = next((key for key in _POSE_KEYS if key in entry), None)
        if key is None:
            raise ValueError(f"frame {number} has no camera_from_model")
        for body, matrix in entry[key].items():
            _add_pose(poses, body, number, np.array(matrix, dtype=np.float64))
    if not poses:
        raise ValueError("no frame has a pose")
    return PoseTruth(poses, own_error)


def _add_pose(
    poses: dict[str, dict[int, RigidTransform]], body: str, number: int, matrix: FloatArray
) -> None:
    if body not in FOLLOWED_BONES:
        known = ", ".join(FOLLOWED_BONES)
        raise ValueError(f"frame {number} names the body '{body}', known are {known}")
    of_body = poses.setdefault(body, {})
    if number in of_body:
        raise ValueError(f"frame {number} has the {body} twice")
    try:
        of_body[number] = RigidTransform("left", body, matrix)
    except ValueError as error:
        raise ValueError(f"frame {number}, {error}") from error


def _read_tracker(content: Mapping[str, Any], own_error: OwnError) -> TrackerTruth:
    times_ns = [_read_whole(entry["time_ns"], "time_ns") for entry in content["poses"]]
    matrices = [np.array(entry["matrix"], dtype=np.float64) for entry in content["poses"]]
    return _make_tracker(times_ns, matrices, own_error)


def _make_tracker(
    times_ns: list[int], matrices: list[FloatArray], own_error: OwnError
) -> TrackerTruth:
    rigid = []
    for place, matrix in enumerate(matrices):
        try:
            rigid.append(RigidTransform("tracker", "marker", matrix).matrix)
        except ValueError as error:
            raise ValueError(f"pose {place}, {error}") from error
    steps = np.diff(times_ns)
    if (steps <= 0).any():
        late = int(np.argmax(steps <= 0)) + 1
        raise ValueError(f"time_ns of pose {late} is not after the one before")
    return TrackerTruth(np.array(times_ns, dtype=np.int64), np.array(rigid), own_error)


def _read_divots(content: Mapping[str, Any], own_error: OwnError) -> DivotTruth:
    divots_mm = {str(name): _read_point(at, name) for name, at in content["divots"].items()}
    touched = []
    for entry in content["touched"]:
        name, number = str(entry["name"]), _read_whole(entry["index"], "index")
        if name not in divots_mm:
            raise ValueError(f"'{name}' is touched in picture {number}, and is none of the divots")
        touched.append(Touch(number, name, _read_point(entry["left_mm"], name)))
    return DivotTruth(divots_mm, tuple(touched), own_error)


def _read_point(value: Any, name: str) -> FloatArray:
    point = np.array(value, dtype=np.float64)
    if point.shape != (3,) or not np.isfinite(point).all():
        raise ValueError(f"the place of '{name}' is not three finite numbers")
    return point


def _read_whole(value: Any, name: str) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or value < 0:
        raise ValueError(f"{name} {value!r} is no whole number from 0 on")
    return value


def _from_csv(text: str) -> Truth:
    rows = parse_pose_table(text)
    keys = [_read_whole(int(words[0]), "the first column") for words, _ in rows]
    n_before = len(rows[0][0])
    if n_before == 1:
        return _make_tracker(keys, [matrix for _, matrix in rows], OwnError())
    if n_before > 2:
        raise ValueError(
            f"its first line has {n_before} columns before the matrix: index and body are "
            "expected, or time_ns"
        )
    poses: dict[str, dict[int, RigidTransform]] = {}
    for ((_, body), matrix), number in zip(rows, keys, strict=True):
        _add_pose(poses, body, number, matrix)
    return PoseTruth(poses)
