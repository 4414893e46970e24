"""3D Slicer's markups files (`.mrk.json`) as plain points in LPS, mm.

Source: 3D Slicer's developer guide, Markups json file format.
"""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from navapp.errors import PlanError
from navapp.geometry.transform import FloatArray

_SUFFIX = ".mrk.json"
# What older versions wrote as a number.
_SPACES = {"LPS": "LPS", "RAS": "RAS", "1": "LPS", "0": "RAS"}


@dataclass(frozen=True, slots=True, eq=False)
class Markup:
    """One markup of a file."""

    # Slicer's type in small letters: `fiducial`, `line`, `curve`, `closedcurve`, `plane`.
    kind: str
    name: str  # its own, or that of the file
    labels: tuple[str, ...]  # of the points
    points_mm: FloatArray  # (N, 3) defined points
    # centre_mm, normal: (3,) of a plane, when the file holds them.
    centre_mm: FloatArray | None = None
    normal: FloatArray | None = None
    size_mm: tuple[float, float] | None = None  # of a plane along its axes, when the file holds it


def read_markup_file(path: str | Path, warnings: list[str]) -> list[Markup]:
    """All markups of a file; points that Slicer had not placed are left out with a warning.

    Raises:
        PlanError: no markups file, another unit or space than mm in LPS or RAS, damaged points.
    """
    path = Path(path)
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        entries = content["markups"]
        return [_markup(entry, path, warnings) for entry in entries]
    except (OSError, UnicodeDecodeError) as error:
        raise _make_error(path, "cannot be read", str(error)) from error
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise _make_error(
            path, f"is no markups file ({error})", "save it anew in 3D Slicer"
        ) from error


def _markup(entry: dict[str, Any], path: Path, warnings: list[str]) -> Markup:
    kind = str(entry["type"]).lower()
    stem = path.name[: -len(_SUFFIX)] if path.name.endswith(_SUFFIX) else path.stem
    name = str(entry.get("name") or stem)
    unit = entry.get("coordinateUnits", "mm")
    if unit != "mm":
        raise _make_error(path, f"measures '{name}' in {unit}", "export it in mm")
    space = _SPACES.get(str(entry.get("coordinateSystem", "LPS")).upper())
    if space is None:
        raise _make_error(
            path,
            f"holds '{name}' in the space {entry['coordinateSystem']}",
            "export it in LPS or RAS",
        )
    signs = np.array([-1.0, -1.0, 1.0]) if space == "RAS" else np.ones(3)
    points, labels = [], []
    for number, point in enumerate(entry.get("controlPoints", ()), 1):
        label = str(point.get("label", number))
        if point.get("positionStatus", "defined") != "defined" or point.get("position") is None:
            warnings.append(f"{path.name}: point '{label}' of '{name}' was never placed: left out")
            continue
        points.append(_vector(point["position"]) * signs)
        labels.append(label)
    is_plane = kind == "plane"
    size = entry.get("size") if is_plane else None
    return Markup(
        kind,
        name,
        tuple(labels),
        np.array(points).reshape(-1, 3),
        _vector(entry["center"]) * signs if is_plane and entry.get("center") else None,
        _vector(entry["normal"]) * signs if is_plane and entry.get("normal") else None,
        (float(size[0]), float(size[1])) if size and min(size[:2]) > 0.0 else None,
    )


def _vector(values: Any) -> FloatArray:
    vector = np.array(values, dtype=np.float64)
    if vector.shape != (3,) or not np.isfinite(vector).all():
        raise ValueError("a point is not three finite numbers")
    return vector


def _make_error(path: Path, what: str, remedy: str) -> PlanError:
    return PlanError(f"markups {path} {what}", subject=str(path), remedy=remedy)
