"""The file of a stereo rig: OpenCV's YAML (or XML, or JSON) with a quality record of ours."""

import math
from pathlib import Path
from typing import Any

import numpy as np

from navapp.errors import RigError
from navapp.geometry.camera import Camera
from navapp.geometry.rig import RigQuality, StereoRig
from navapp.geometry.sealed_storage import (
    ChangedFileError,
    day,
    is_sealed,
    number,
    read_matrix,
    read_numbers,
    read_record,
    read_texts,
    write_days,
    write_figures,
    write_sealed,
    write_texts,
)
from navapp.geometry.transform import RigidTransform

# What other programs call the same thing; the first name is ours.
_SYNONYMS = {
    "K1": ("K1", "M1", "cameraMatrix1", "camera_matrix_1"),
    "D1": ("D1", "distCoeffs1", "distortion_coefficients_1"),
    "K2": ("K2", "M2", "cameraMatrix2", "camera_matrix_2"),
    "D2": ("D2", "distCoeffs2", "distortion_coefficients_2"),
    "R": ("R",),
    "T": ("T",),
}
_TEXTS = (
    "serial_left", "serial_right", "rig_name", "rig_id", "made_on", "expires_on", "length_unit",
)  # fmt: skip


def read_rig(path: str | Path) -> StereoRig:
    """Read a rig from OpenCV YAML, XML or JSON storage; lengths are taken as mm.

    Raises:
        RigError: missing, damaged, incomplete or impossible.
    """
    path = Path(path)
    if not path.is_file():
        raise RigError(
            f"rig file {path} does not exist",
            subject=str(path),
            remedy="give the OpenCV YAML file that the calibration wrote",
        )
    has_seal = _has_seal(path)
    values = _read_storage(path)
    width, height = values.get("image_width"), values.get("image_height")
    missing = [key for key in _SYNONYMS if key not in values]
    if width is None or height is None:
        missing.insert(0, "image_width and image_height")
    if missing or width is None or height is None:
        raise RigError(
            f"rig file {path} lacks {', '.join(missing)}",
            subject=str(path),
            remedy="it needs K1 D1 K2 D2 R T, image_width and image_height (OpenCV's names)",
        )
    try:
        rig = StereoRig(
            Camera(values["K1"], values["D1"], int(width), int(height)),
            Camera(values["K2"], values["D2"], int(width), int(height)),
            RigidTransform.from_parts("right", "left", values["R"], values["T"]),
            (str(values.get("serial_left", "")), str(values.get("serial_right", ""))),
            _quality(values),
            str(values.get("rig_name", path.stem)),
            _row_delay_ns(values),
        )
    except (ValueError, TypeError, OverflowError) as error:
        raise RigError(
            f"rig file {path} describes no possible rig ({error})",
            subject=str(path),
            remedy="calibrate again or restore the file",
        ) from error
    # Only our own files name their rig, and they all end with a hash.
    if "rig_id" in values and not (has_seal and values["rig_id"] == rig.rig_id):
        raise _changed(path)
    return rig


def write_rig(path: str | Path, rig: StereoRig) -> None:
    """Write OpenCV YAML 1.0, or XML for a name that ends so; whole or not at all.

    The quality record comes first: a file that is cut short later on loses numbers that it cannot
    be read without, never just the verdict. The last line is a hash of all lines before.
    """
    write_sealed(path, lambda storage: _write_entries(storage, rig))


def _write_entries(storage: Any, rig: StereoRig) -> None:
    storage.write("rig_name", rig.name)
    storage.write("rig_id", rig.rig_id)
    storage.write("serial_left", rig.serials[0])
    storage.write("serial_right", rig.serials[1])
    if rig.quality is not None:
        _write_quality(storage, rig.quality)
    if rig.row_delay_ns:
        storage.write("row_delay_ns", rig.row_delay_ns)
    storage.write("image_width", rig.width)
    storage.write("image_height", rig.height)
    for index, camera in ((1, rig.left), (2, rig.right)):
        storage.write(f"K{index}", np.array(camera.matrix))
        # One-dimensional arrays would come back in another form: write a row.
        storage.write(
            f"D{index}",
            np.array(camera.distortion if camera.distortion.size else np.zeros(5)).reshape(1, -1),
        )
    storage.write("R", np.array(rig.right_from_left.rotation))
    storage.write("T", np.array(rig.right_from_left.translation_mm).reshape(3, 1))


def _has_seal(path: Path) -> bool:
    """Whether the last line is a hash; refused when it does not fit the lines before."""
    try:
        return is_sealed(path)
    except ChangedFileError:
        raise _changed(path) from None


def _changed(path: Path) -> RigError:
    return RigError(
        f"rig file {path} was changed after it was written",
        subject=str(path),
        remedy="restore it or calibrate again",
    )


def _write_quality(storage: Any, quality: RigQuality) -> None:
    storage.write("accepted", int(quality.is_accepted))
    write_texts(storage, "reasons", quality.reasons)
    storage.write(
        "uncertainty_mm", -1.0 if quality.uncertainty_mm is None else quality.uncertainty_mm
    )
    write_days(storage, quality.made_on, quality.expires_on)
    write_figures(storage, quality.figures)
    if quality.length_unit != "mm":
        storage.write("length_unit", quality.length_unit)
    if quality.covariance is not None:
        storage.write("covariance", np.array(quality.covariance))


def _quality(values: dict[str, Any]) -> RigQuality | None:
    if "accepted" not in values:
        return None
    uncertainty_mm = float(values.get("uncertainty_mm", -1.0))
    known = uncertainty_mm >= 0.0 and math.isfinite(uncertainty_mm)
    return RigQuality(
        int(values["accepted"]) == 1,
        tuple(values.get("reasons", ())),
        uncertainty_mm if known else None,
        day(values.get("made_on", "")),
        day(values.get("expires_on", "")),
        values.get("figures", {}),
        values.get("covariance"),
        str(values.get("length_unit", "mm")),
    )


def _row_delay_ns(values: dict[str, Any]) -> int:
    """Of a rig whose file says nothing, 0: all rows at once.

    Raises:
        ValueError: no whole number.
    """
    delay_ns = float(values.get("row_delay_ns", 0.0))
    if not delay_ns.is_integer():
        raise ValueError(f"row_delay_ns is {delay_ns:g}, not a whole number")
    return int(delay_ns)


def _read_storage(path: Path) -> dict[str, Any]:
    """Every known entry of an OpenCV storage file, under our names."""
    import cv2

    try:
        storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
        if not storage.isOpened():
            raise ValueError("not an OpenCV storage file")
        values = {**_read_matrices(storage), **_read_scalars(storage)}
        storage.release()
    except (cv2.error, SystemError, ValueError) as error:
        raise RigError(
            f"rig file {path} is damaged or not an OpenCV storage file",
            subject=str(path),
            remedy="restore it or calibrate again",
        ) from error
    return values


def _read_matrices(storage: Any) -> dict[str, Any]:
    values: dict[str, Any] = {}
    for name, synonyms in {**_SYNONYMS, "covariance": ("covariance",)}.items():
        found = [matrix for key in synonyms if (matrix := read_matrix(storage, key)) is not None]
        if found:
            values[name] = found[0]
    return values


def _read_scalars(storage: Any) -> dict[str, Any]:
    values: dict[str, Any] = {}
    # A node must stay in a variable: the storage frees the ones that nobody holds.
    for name in ("size", "image_size"):
        node = storage.getNode(name)
        if node.empty():
            continue
        size = [number(node.at(i)) for i in range(node.size())] if node.isSeq() else node.mat()
        size = np.asarray(size, dtype=np.float64).reshape(-1)
        if size.size != 2:
            raise ValueError(f"{name} is not a width and a height")
        values["image_width"], values["image_height"] = size
    names = ("image_width", "image_height", "accepted", "uncertainty_mm", "row_delay_ns")
    values |= read_numbers(storage, names)
    return values | read_texts(storage, _TEXTS) | read_record(storage)
