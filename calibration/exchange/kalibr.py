"""A Kalibr camchain: cam0 is the left camera, cam1 the right one, lengths in metres."""

from pathlib import Path
from typing import Any

import numpy as np

from calibration.exchange.lens_models import pad_coefficients
from calibration.exchange.yaml_files import find_entry, make_error, parse_numbers, read_mapping
from navapp.errors import RigError
from navapp.geometry.camera import Camera
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.geometry.whole_files import write_whole

FORM = "Kalibr"
_COEFFICIENTS = {"radtan": 4, "none": 0}
_MM_PER_M = 1000.0


def read_kalibr(path: Path) -> StereoRig:
    """Read a chain of two pinhole cameras.

    Raises:
        RigError: damaged, another number of cameras, a model that we do not know, cam0 at the
            right.
    """
    content = read_mapping(path, FORM)
    names = sorted(key for key in content if str(key).startswith("cam"))
    if names != ["cam0", "cam1"]:
        raise make_error(path, FORM, f"has {', '.join(names) or 'no camera'}, not cam0 and cam1")
    try:
        left, right = _camera(content, "cam0"), _camera(content, "cam1")
        matrix = parse_numbers(find_entry(content["cam1"], "T_cn_cnm1"), "T_cn_cnm1", 4, 4)
        matrix[:3, 3] *= _MM_PER_M
        pose = RigidTransform("right", "left", matrix)
        rig = StereoRig(left, right, pose, name=path.stem)
    except (ValueError, TypeError) as error:
        raise make_error(path, FORM, f"describes no possible rig ({error})") from error
    if pose.inverse().translation_mm[0] <= 0.0:
        raise RigError(
            f"Kalibr file {path} has cam1 at the left of cam0",
            subject=str(path),
            remedy="calibrate with the left camera as cam0",
        )
    return rig


def write_kalibr(path: Path, rig: StereoRig) -> None:
    """Write a chain, whole or not at all.

    Raises:
        RigError: distortion beyond the four coefficients of radtan.
    """
    import yaml

    matrix = np.array(rig.right_from_left.matrix)
    matrix[:3, 3] /= _MM_PER_M
    content = {
        "cam0": _content(0, rig.left, None),
        "cam1": _content(1, rig.right, matrix),
    }
    text = yaml.safe_dump(content, sort_keys=True, default_flow_style=None)
    write_whole(path, text.encode("utf-8"))


def _camera(content: dict[str, Any], name: str) -> Camera:
    given = content[name]
    if not isinstance(given, dict):
        raise ValueError(f"{name} holds no keys")
    if (camera_model := find_entry(given, "camera_model")) != "pinhole":
        raise ValueError(f"{name}: camera_model {camera_model!r} is not supported, only pinhole")
    model = find_entry(given, "distortion_model")
    if model not in _COEFFICIENTS:
        raise ValueError(
            f"{name}: distortion_model {model!r} is not supported, only "
            f"{' and '.join(_COEFFICIENTS)}"
        )
    found = parse_numbers(
        given.get("distortion_coeffs", []), f"{name}: distortion_coeffs", _COEFFICIENTS[model]
    )
    fx, fy, cx, cy = parse_numbers(find_entry(given, "intrinsics"), f"{name}: intrinsics", 4)
    width, height = parse_numbers(find_entry(given, "resolution"), f"{name}: resolution", 2)
    matrix = np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
    return Camera(matrix, found, int(width), int(height))


def _content(number: int, camera: Camera, from_left: FloatArray | None) -> dict[str, Any]:
    matrix = camera.matrix
    content: dict[str, Any] = {
        "cam_overlaps": [1 - number],
        "camera_model": "pinhole",
        "distortion_coeffs": pad_coefficients(camera, _COEFFICIENTS["radtan"], FORM).tolist(),
        "distortion_model": "radtan",
        "intrinsics": [float(matrix[place]) for place in ((0, 0), (1, 1), (0, 2), (1, 2))],
        "resolution": [camera.width, camera.height],
        "rostopic": f"/cam{number}/image_raw",
    }
    if from_left is not None:
        content["T_cn_cnm1"] = from_left.tolist()
    return content
