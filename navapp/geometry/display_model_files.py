"""The file of a display in a mirror: OpenCV's YAML (or XML), sealed by a hash."""

import math
from pathlib import Path
from typing import Any

import numpy as np

from navapp.errors import InputError
from navapp.geometry.display_model import VIEWING_EYES, DisplayModel, DisplayQuality
from navapp.geometry.display_model_optics import Glass, VirtualScreen
from navapp.geometry.sealed_storage import (
    ChangedFileError,
    day,
    is_sealed,
    read_matrix,
    read_numbers,
    read_record,
    read_texts,
    write_days,
    write_figures,
    write_sealed,
    write_texts,
)

_TEXTS = ("display_name", "viewing_eye", "made_on", "expires_on")
_NUMBERS = (
    "accepted", "error_mm", "error_arcmin", "width_px", "height_px", "pitch_mm", "bulge_mm",
    "flips_columns", "flips_rows", "glass_mm", "refractive_index", "mirror_deg",
)  # fmt: skip
_ARRAYS = (
    "origin", "across", "down", "eye", "other_eye", "glass_normal", "backend_flips",
    "projector_flips", "keystone", "covariance",
)  # fmt: skip
_NEEDED = (
    "origin", "across", "down", "eye", "pitch_mm", "width_px", "height_px", "flips_columns",
    "flips_rows", "viewing_eye",
)  # fmt: skip


def read_display_model(path: str | Path) -> DisplayModel:
    """Read the display that a calibration wrote.

    Raises:
        InputError: missing, changed after it was written, incomplete or impossible.
    """
    path = Path(path)
    if not path.is_file():
        raise _refusal(path, "does not exist", "give the file that the calibration wrote")
    values = _read_values(path)
    try:
        has_seal = is_sealed(path)
    except ChangedFileError:
        has_seal = False
    if missing := [name for name in _NEEDED if name not in values]:
        raise _refusal(path, f"lacks {', '.join(missing)}")
    if not has_seal:
        raise _refusal(path, "was changed after it was written")
    try:
        return _model_of(values)
    except (ValueError, TypeError, OverflowError) as error:
        raise _refusal(path, f"describes no possible display ({error})") from error


def write_display_model(path: str | Path, model: DisplayModel) -> None:
    """Write OpenCV YAML 1.0, or XML for a name that ends so; whole or not at all.

    The quality record comes first, a hash of all lines before last, as in a rig's file.
    """
    write_sealed(path, lambda storage: _write_entries(storage, model))


def _write_entries(storage: Any, model: DisplayModel) -> None:
    storage.write("display_name", model.display_name)
    if model.quality is not None:
        _write_quality(storage, model.quality)
    screen = model.screen
    for name, flag in (("flips_columns", model.flips_columns), ("flips_rows", model.flips_rows)):
        storage.write(name, int(flag))
    storage.write("width_px", screen.width_px)
    storage.write("height_px", screen.height_px)
    storage.write("pitch_mm", screen.pitch_mm)
    storage.write("bulge_mm", screen.bulge_mm)
    rows = [("origin", screen.origin_mm), ("across", screen.across), ("down", screen.down)]
    storage.write("viewing_eye", model.viewing_eye)
    rows.append(("eye", model.eye_mm))
    if model.other_eye_mm is not None:
        rows.append(("other_eye", model.other_eye_mm))
    if model.glass is not None:
        storage.write("glass_mm", model.glass.thickness_mm)
        storage.write("refractive_index", model.glass.refractive_index)
        rows.append(("glass_normal", model.glass.normal))
    if model.mirror_deg is not None:
        storage.write("mirror_deg", model.mirror_deg)
    rows.append(("backend_flips", np.array(model.backend_flips, dtype=np.float64)))
    for name, pair in (("projector_flips", model.projector_flips), ("keystone", model.keystone)):
        if pair is not None:
            rows.append((name, np.array(pair, dtype=np.float64)))
    for name, row in rows:
        # One-dimensional arrays would come back in another form: write a row.
        storage.write(name, np.array(row).reshape(1, -1))


def _write_quality(storage: Any, quality: DisplayQuality) -> None:
    storage.write("accepted", int(quality.is_accepted))
    write_texts(storage, "reasons", quality.reasons)
    for name in ("error_mm", "error_arcmin"):
        value = getattr(quality, name)
        storage.write(name, -1.0 if value is None else float(value))
    write_days(storage, quality.made_on, quality.expires_on)
    write_figures(storage, quality.figures)
    if quality.covariance is not None:
        storage.write("covariance", np.array(quality.covariance))


def _read_values(path: Path) -> dict[str, Any]:
    import cv2

    try:
        storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
        if not storage.isOpened():
            raise ValueError("not an OpenCV storage file")
        values: dict[str, Any] = dict(read_numbers(storage, _NUMBERS))
        values |= read_texts(storage, _TEXTS) | read_record(storage)
        for name in _ARRAYS:
            matrix = read_matrix(storage, name)
            if matrix is not None:
                values[name] = matrix
        storage.release()
    except (cv2.error, SystemError, ValueError) as error:
        raise _refusal(path, "is damaged or not an OpenCV storage file") from error
    return values


def _model_of(values: dict[str, Any]) -> DisplayModel:
    screen = VirtualScreen(
        values["origin"], values["across"], values["down"], values["pitch_mm"],
        int(values["width_px"]), int(values["height_px"]), values.get("bulge_mm", 0.0),
    )  # fmt: skip
    glass = None
    if "glass_mm" in values:
        index = values.get("refractive_index", 1.52)
        glass = Glass(values["glass_mm"], values["glass_normal"], index)
    return DisplayModel(
        screen,
        glass,
        values["eye"],
        values["flips_columns"] == 1,
        values["flips_rows"] == 1,
        next((name for name in VIEWING_EYES if name == values["viewing_eye"]), "camera"),
        values.get("other_eye"),
        values.get("display_name", ""),
        _flags(values.get("backend_flips", np.zeros(2))),
        values.get("mirror_deg"),
        _flags(values["projector_flips"]) if "projector_flips" in values else None,
        _steps(values["keystone"]) if "keystone" in values else None,
        _quality(values),
    )


def _flags(row: Any) -> tuple[bool, bool]:
    first, second = np.ravel(row) != 0.0
    return bool(first), bool(second)


def _steps(row: Any) -> tuple[int, int]:
    first, second = np.ravel(row)
    return round(float(first)), round(float(second))


def _quality(values: dict[str, Any]) -> DisplayQuality | None:
    if "accepted" not in values:
        return None
    error_mm, error_arcmin = (_known(values.get(name)) for name in ("error_mm", "error_arcmin"))
    return DisplayQuality(
        int(values["accepted"]) == 1,
        tuple(values.get("reasons", ())),
        error_mm,
        error_arcmin,
        day(values.get("made_on", "")),
        day(values.get("expires_on", "")),
        values.get("figures", {}),
        values.get("covariance"),
    )


def _known(value: float | None) -> float | None:
    return value if value is not None and value >= 0.0 and math.isfinite(value) else None


def _refusal(
    path: Path, problem: str, remedy: str = "restore it or calibrate the display again"
) -> InputError:
    return InputError(f"display file {path} {problem}", subject=str(path), remedy=remedy)
