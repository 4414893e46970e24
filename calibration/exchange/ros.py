"""A ROS camera_info pair: a folder with left.yaml and right.yaml, lengths in metres.

The pair does not hold the cameras' placement but its rectification: both cameras turned by
`rectification_matrix`, the right one moved by what the last column of its `projection_matrix` says
(-fx times the baseline).
"""

import os
import shutil
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from calibration.exchange.lens_models import count_used, pad_coefficients
from calibration.exchange.yaml_files import find_entry, make_error, parse_numbers, read_mapping
from navapp.errors import RigError
from navapp.geometry.camera import Camera
from navapp.geometry.rectification import Rectifier
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.geometry.whole_files import write_whole

FORM = "ROS camera_info"
_SIDES = ("left", "right")
_COEFFICIENTS = {"plumb_bob": 5, "rational_polynomial": 8}
_MM_PER_M = 1000.0


def read_ros(folder: Path) -> StereoRig:
    """Read a pair.

    Raises:
        RigError: a file that is missing, damaged or says what we do not know; swapped files.
    """
    cameras, turns, shifts = [], [], []
    for side in _SIDES:
        path = _path(folder, side)
        content = read_mapping(path, FORM)
        try:
            cameras.append(_camera(content))
            turns.append(_numbers(content, "rectification_matrix", 3, 3))
            projection = _numbers(content, "projection_matrix", 3, 4)
            shifts.append(np.linalg.solve(projection[:, :3], projection[:, 3]) * _MM_PER_M)
        except (ValueError, TypeError, np.linalg.LinAlgError) as error:
            raise make_error(path, FORM, f"describes no camera ({error})") from error
    shift_mm = shifts[1] - shifts[0]
    if shift_mm[0] >= 0.0:
        what = "holds no baseline" if shift_mm[0] == 0.0 else "has the right camera at the left"
        raise RigError(
            f"ROS pair {folder} {what} (the last column of right's projection_matrix)",
            subject=str(folder),
            remedy="swap the files, or calibrate both cameras together",
        )
    try:
        pose = RigidTransform.from_parts(
            "right", "left", turns[1].T @ turns[0], turns[1].T @ shift_mm
        )
        return StereoRig(cameras[0], cameras[1], pose, name=folder.resolve().name)
    except ValueError as error:
        raise make_error(folder, FORM, f"describes no possible rig ({error})") from error


def write_ros(folder: Path, rig: StereoRig) -> None:
    """Write both files into a new folder, both or none.

    Raises:
        RigError: distortion that ROS cannot say, or a folder with something in it.
    """
    import yaml

    r1, r2, p1, p2 = Rectifier(rig).matrices
    p2 = np.array(p2)
    p2[:, 3] /= _MM_PER_M
    contents = (_content("left", rig.left, r1, p1), _content("right", rig.right, r2, p2))
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise RigError(
            f"{folder} exists already", subject=str(folder), remedy="name a new folder for the pair"
        )
    texts = {
        f"{side}.yaml": yaml.safe_dump(content, sort_keys=False, default_flow_style=None)
        for side, content in zip(_SIDES, contents, strict=True)
    }
    try:
        _write_folder(folder, texts)
    except OSError as error:
        raise RigError(
            f"folder {folder} cannot be written ({error.strerror})",
            subject=str(folder),
            remedy="name a new folder in one that exists and that you may write to",
        ) from error


def _write_folder(folder: Path, texts: dict[str, str]) -> None:
    """All files of a new folder, or nothing."""
    made = Path(tempfile.mkdtemp(dir=folder.resolve().parent, prefix=f".{folder.name}."))
    try:
        for name, text in texts.items():
            write_whole(made / name, text.encode("utf-8"))
        made.chmod(0o755)
        os.replace(made, folder)
    except BaseException:
        shutil.rmtree(made, ignore_errors=True)
        raise


def _path(folder: Path, side: str) -> Path:
    for ending in ("yaml", "yml"):
        if (folder / f"{side}.{ending}").is_file():
            return folder / f"{side}.{ending}"
    raise RigError(
        f"folder {folder} has no {side}.yaml",
        subject=str(folder),
        remedy="a ROS pair is a folder with left.yaml and right.yaml",
    )


def _camera(content: dict[str, Any]) -> Camera:
    model = content.get("distortion_model", "plumb_bob")
    if model not in _COEFFICIENTS:
        raise ValueError(
            f"distortion_model {model!r} is not supported, only {' and '.join(_COEFFICIENTS)}"
        )
    found = _numbers(content, "distortion_coefficients")
    if found.size > _COEFFICIENTS[model]:
        raise ValueError(f"{model} has {_COEFFICIENTS[model]} coefficients, not {found.size}")
    size = [int(find_entry(content, key)) for key in ("image_width", "image_height")]
    return Camera(_numbers(content, "camera_matrix", 3, 3), found, size[0], size[1])


def _numbers(content: dict[str, Any], key: str, *shape: int) -> FloatArray:
    """Of a table of rows, cols and data, or of a plain list, which some drivers write."""
    given = find_entry(content, key)
    return parse_numbers(
        find_entry(given, "data") if isinstance(given, dict) else given, key, *shape
    )


def _content(side: str, camera: Camera, turn: Any, projection: Any) -> dict[str, Any]:
    model = (
        "plumb_bob" if count_used(camera) <= _COEFFICIENTS["plumb_bob"] else "rational_polynomial"
    )
    found = pad_coefficients(camera, _COEFFICIENTS[model], FORM)
    return {
        "image_width": camera.width,
        "image_height": camera.height,
        "camera_name": side,
        "camera_matrix": _matrix_to_yaml(camera.matrix),
        "distortion_model": model,
        "distortion_coefficients": _matrix_to_yaml(found.reshape(1, -1)),
        "rectification_matrix": _matrix_to_yaml(turn),
        "projection_matrix": _matrix_to_yaml(projection),
    }


def _matrix_to_yaml(matrix: Any) -> dict[str, Any]:
    rows, columns = np.shape(matrix)
    return {"rows": rows, "cols": columns, "data": np.ravel(matrix).astype(float).tolist()}
