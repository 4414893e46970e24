"""Reads the tags of one DICOM file that a volume needs. Only this module imports pydicom."""

import logging
import warnings
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from navapp.geometry.transform import FloatArray
from navapp.preop.volume.dicom_identity import NAMING_TAGS, find_naming_values
from navapp.values import Side

_SLICE_TAGS = (
    "SOPClassUID", "SeriesInstanceUID", "FrameOfReferenceUID", "Modality", "SeriesDescription",
    "ImageType", "ImagePositionPatient", "ImageOrientationPatient", "PixelSpacing", "Rows",
    "Columns", "SliceThickness", "GantryDetectorTilt", "RescaleSlope", "RescaleIntercept",
    "PixelRepresentation", "PixelPaddingValue", "PixelPaddingRangeLimit", "Laterality",
    "ImageLaterality", "SamplesPerPixel", "NumberOfFrames",
)  # fmt: skip
# Stands for the UID of a series that has none, as some anonymised ones.
NO_UID = "none"
_MAGIC_AT, _MAGIC = 128, b"DICM"
# Group 8, little endian: how the files begin that were stored without a preamble.
_BARE_BEGINNING = b"\x08\x00"


@dataclass(frozen=True, slots=True, eq=False)
class SliceHeader:
    """What one slice's header says; only `file` and `description` may name the patient."""

    file: Path
    series_uid: str
    frame_uid: str
    modality: str
    description: str
    image_type: tuple[str, ...]
    position_mm: FloatArray  # (3,) LPS, centre of the first pixel
    # row, column: (3,) directions in which the column index, and the row index, grow.
    row: FloatArray
    column: FloatArray
    # distances between rows (j), and between columns (i): DICOM's order.
    pixel_mm: tuple[float, float]
    # rows, columns: of pixels.
    rows: int
    columns: int
    # thickness_mm, tilt_deg: tags; None when absent.
    thickness_mm: float | None
    tilt_deg: float | None
    # smallest and largest value that stands for no measurement, or None.
    padding_hu: tuple[float, float] | None
    side: Side | None  # "left" or "right" when a laterality tag says so

    @property
    def normal(self) -> FloatArray:
        """(3,) direction of the stack: row x column."""
        normal: FloatArray = np.cross(self.row, self.column)
        return normal


@dataclass(frozen=True, slots=True)
class OtherFile:
    """A DICOM file that is no slice of a volume, and why."""

    file: Path  # where
    series_uid: str  # NO_UID when it is not even known
    why: str  # empty for an object that is no picture at all (a report, a directory)


def is_dicom(file: Path) -> bool:
    """Whether a file begins as DICOM files do.

    So may one that cannot be opened, or that was cut to nothing or to its first empty bytes.
    """
    try:
        with file.open("rb") as stream:
            start = stream.read(_MAGIC_AT + len(_MAGIC))
    except OSError:
        return True
    if len(start) < _MAGIC_AT + len(_MAGIC) and not start.strip(b"\0"):
        return True
    return start[_MAGIC_AT:] == _MAGIC or start.startswith(_BARE_BEGINNING)


def read_header(file: Path) -> tuple[SliceHeader | OtherFile, set[str]]:
    """A file's header, and the values in it that name the patient (to be kept out of all texts)."""
    import pydicom

    # Both would quote what they find odd, and that may be the name.
    logging.getLogger("pydicom").disabled = True
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            header = pydicom.dcmread(
                file,
                stop_before_pixels=True,
                force=True,
                specific_tags=[*_SLICE_TAGS, *NAMING_TAGS],
            )
            names = find_naming_values(header)
        except OSError as error:
            return OtherFile(file, NO_UID, f"it cannot be opened ({error.strerror})"), set()
        except Exception:  # noqa: BLE001 (as in _understood)
            return OtherFile(file, NO_UID, "its header is damaged"), set()
        return _parse_header(file, header), names


def _parse_header(file: Path, header: Any) -> SliceHeader | OtherFile:
    # Values are converted when they are asked for, and pydicom raises whatever wrong bytes lead to.
    with suppress(Exception):
        return _slice(file, header)
    with suppress(Exception):
        return _no_slice(file, header)
    return OtherFile(file, NO_UID, "its tags are damaged")


def _slice(file: Path, header: Any) -> SliceHeader:
    row, column = np.reshape(_floats(header.ImageOrientationPatient, 6), (2, 3))
    spacing = _floats(header.PixelSpacing, 2)
    if int(header.get("SamplesPerPixel", 1)) != 1 or int(header.get("NumberOfFrames") or 1) != 1:
        raise ValueError("several frames or colours")
    if min(header.Rows, header.Columns, *spacing) <= 0:
        raise ValueError("an empty picture")
    return SliceHeader(
        file=file,
        series_uid=_uid(header),
        frame_uid=str(header.get("FrameOfReferenceUID") or ""),
        modality=str(header.get("Modality") or ""),
        description=str(header.get("SeriesDescription") or "").strip(),
        image_type=tuple(str(word).upper() for word in _many(header.get("ImageType"))),
        position_mm=_floats(header.ImagePositionPatient, 3),
        row=row,
        column=column,
        pixel_mm=(float(spacing[0]), float(spacing[1])),
        rows=int(header.Rows),
        columns=int(header.Columns),
        thickness_mm=_number(header.get("SliceThickness")),
        tilt_deg=_number(header.get("GantryDetectorTilt")),
        padding_hu=_padding(header),
        side=_side(header),
    )


def _no_slice(file: Path, header: Any) -> OtherFile:
    """Say what a file is that has not all that a slice needs."""
    uid = _uid(header)
    meta = getattr(header, "file_meta", {})
    kind = header.get("SOPClassUID") or meta.get("MediaStorageSOPClassUID")
    if kind is None:
        return OtherFile(file, uid, "its header is damaged or cut short")
    if kind.name != str(kind) and "Image Storage" not in kind.name:
        return OtherFile(file, uid, "")
    if "Rows" not in header:
        return OtherFile(file, uid, "its header is damaged or cut short")
    if _number(header.get("NumberOfFrames")) not in (None, 1.0):
        return OtherFile(file, uid, "it holds many slices in one file")
    if header.get("SamplesPerPixel", 1) != 1:
        return OtherFile(file, uid, "it is a colour picture")
    return OtherFile(file, uid, "its tags do not say where it lies, or are damaged")


def _uid(header: Any) -> str:
    return str(header.get("SeriesInstanceUID") or NO_UID)


def _padding(header: Any) -> tuple[float, float] | None:
    """Padding is stored before the rescale; its value follows the same line."""
    value = _number(header.get("PixelPaddingValue"))
    if value is None:
        return None
    limit = _number(header.get("PixelPaddingRangeLimit"))
    slope = _number(header.get("RescaleSlope"))
    intercept = _number(header.get("RescaleIntercept")) or 0.0
    ends = [
        stored * (1.0 if slope is None else slope) + intercept
        for stored in (value, value if limit is None else limit)
    ]
    return min(ends), max(ends)


def _side(header: Any) -> Side | None:
    letter = header.get("ImageLaterality") or header.get("Laterality")
    sides: dict[str, Side] = {"L": "left", "R": "right"}
    return sides.get(str(letter).strip().upper())


def _floats(values: Any, count: int) -> FloatArray:
    numbers = np.array([float(value) for value in values], dtype=np.float64)
    if numbers.shape != (count,) or not np.isfinite(numbers).all():
        raise ValueError("not that many finite numbers")
    return numbers


def _number(value: Any) -> float | None:
    try:
        number = float(value)
    except (TypeError, ValueError):
        return None
    return number if np.isfinite(number) else None


def _many(value: Any) -> list[Any]:
    if value is None:
        return []
    return [value] if isinstance(value, str) else list(value)
