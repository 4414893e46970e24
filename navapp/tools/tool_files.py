"""A calibrated tool in a JSON file: keys in docs/tools.md."""

import json
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np

from navapp.errors import InputError
from navapp.geometry.transform import FloatArray
from navapp.geometry.whole_files import write_whole
from navapp.tools.paper import Paper, count_parameters
from navapp.tools.plate_files import parse_plate, plate_keys
from navapp.tools.tool import Tool


def write_tool(path: str | Path, tool: Tool) -> None:
    """Write a tool, whole or not at all."""
    content: dict[str, Any] = {
        "plate": plate_keys(tool.plate),
        "tip_mm": tool.tip_mm.tolist(),
        "tip_covariance_mm2": tool.tip_covariance_mm2.tolist(),
        "axis": None if tool.axis is None else tool.axis.tolist(),
        "axis_sigma_rad": tool.axis_sigma_rad,
        "paper": {"mean": tool.paper.mean.tolist(), "covariance": tool.paper.covariance.tolist()},
        "made_on": None if tool.made_on is None else tool.made_on.isoformat(),
        "rig_id": tool.rig_id,
    }
    write_whole(path, (json.dumps(content, indent=1) + "\n").encode())


def read_tool(path: str | Path) -> Tool:
    """Read a tool that `navapp calibrate pivot` has written.

    Raises:
        InputError: missing, damaged, or no possible tool.
    """
    path = Path(path)
    try:
        return _parse(json.loads(path.read_text(encoding="utf-8")))
    except FileNotFoundError:
        problem = "does not exist"
    except KeyError as error:
        problem = f"lacks {error}"
    except (OSError, ValueError, TypeError) as error:
        problem = f"cannot be understood ({str(error).splitlines()[0]})"
    raise InputError(
        f"tool file {path} {problem}",
        subject=str(path),
        remedy="write it with `navapp calibrate pivot --board PLATE.json --out TOOL.json`",
    )


def _parse(content: dict[str, Any]) -> Tool:
    plate = parse_plate(content["plate"])
    n = count_parameters(plate)
    axis, made_on = content["axis"], content["made_on"]
    tool = Tool(
        plate,
        Paper(
            _array(content["paper"]["mean"], (n,)),
            _covariance(content["paper"]["covariance"], n),
        ),
        _array(content["tip_mm"], (3,)),
        _covariance(content["tip_covariance_mm2"], 3),
        None if axis is None else _array(axis, (3,)),
        float(content["axis_sigma_rad"]),
        None if made_on is None else date.fromisoformat(made_on),
        str(content["rig_id"]),
    )
    if tool.axis is not None and abs(float(np.linalg.norm(tool.axis)) - 1.0) > 1e-6:
        raise ValueError("the axis is not a unit vector")
    if not 0.0 <= tool.axis_sigma_rad < 1.0:
        raise ValueError("axis_sigma_rad is not an angle")
    return tool


def _array(value: Any, shape: tuple[int, ...]) -> FloatArray:
    array = np.array(value, dtype=np.float64)
    if array.shape != shape or not np.isfinite(array).all():
        raise ValueError(f"{shape} finite numbers are expected")
    return array


def _covariance(value: Any, n: int) -> FloatArray:
    matrix = _array(value, (n, n))
    if np.abs(matrix - matrix.T).max() > 1e-9 or np.linalg.eigvalsh(matrix)[0] <= 0.0:
        raise ValueError("a covariance is not one")
    return matrix
