"""Volumes in one file: NIfTI, NRRD, MHA, read by SimpleITK, which holds all of them in LPS."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from navapp.errors import InputError
from navapp.geometry.transform import FloatArray
from navapp.preop.volume.ct_volume import is_invertible
from navapp.preop.volume.dicom_headers import is_dicom
from navapp.preop.volume.itk_package import (
    listen_to_codecs,
    lps_from_index_of,
    read_image,
    voxels_of,
)
from navapp.preop.volume.nifti_header import NiftiHeader, read_nifti_header

_NIFTI, _NRRD = (".nii", ".nii.gz"), (".nrrd", ".nhdr")
# Rounding of quaternions moves a far corner by less.
_SAME_PLACE_MM = 0.1
SUFFIXES = (*_NIFTI, *_NRRD, ".mha", ".mhd")


@dataclass(frozen=True, slots=True, eq=False)
class FileVolume:
    """A volume from a file, its values as stored."""

    suffix: str  # by which the file was read
    values: NDArray[Any]  # (D, H, W), axes k, j, i
    lps_from_index: FloatArray  # (4, 4)
    warnings: tuple[str, ...]  # what had to be assumed


def read_file(path: Path) -> FileVolume:
    """Read a volume of one file.

    Raises:
        InputError: missing, of another kind, damaged or cut short, or no three-dimensional volume.
    """
    suffix = _suffix(path)
    header = read_nifti_header(path) if suffix in _NIFTI else None
    if suffix in _NIFTI and (header is None or not header.is_whole):
        # SimpleITK fills what is missing with zeros, without a word.
        raise _make_damage_error(path)
    with listen_to_codecs() as has_complained:
        try:
            image = read_image(path)
            values = voxels_of(image)
        except RuntimeError:
            raise _make_damage_error(path) from None
        if has_complained():
            raise _make_damage_error(path)
    if image.GetDimension() != 3 or image.GetNumberOfComponentsPerPixel() != 1 or len(values) < 2:
        raise InputError(
            f"{path} is no volume of one value a voxel, but {' x '.join(map(str, image.GetSize()))}"
            f" with {image.GetNumberOfComponentsPerPixel()} values",
            subject=str(path),
            remedy="export one three-dimensional volume",
        )
    matrix, warnings = _place(image, header)
    warnings += _space_warnings(path, suffix, image)
    if not is_invertible(matrix):
        raise InputError(
            f"{path} has axes that do not span a volume",
            subject=str(path),
            remedy="export it again with its directions",
        )
    return FileVolume(suffix, values, matrix, tuple(warnings))


def _suffix(path: Path) -> str:
    """The suffix by which the file is read.

    Raises:
        InputError: missing, or of another kind.
    """
    if not path.is_file():
        raise InputError(
            f"{path} does not exist",
            subject=str(path),
            remedy="name a DICOM folder, or a NIfTI, NRRD or MHA file",
        )
    for suffix in SUFFIXES:
        if path.name.lower().endswith(suffix):
            return suffix
    if is_dicom(path):
        raise InputError(
            f"{path} is one DICOM file", subject=str(path), remedy="name the folder of the series"
        )
    raise InputError(
        f"{path} is of no kind that is read",
        subject=str(path),
        remedy=f"name a DICOM folder, or a file with one of {' '.join(SUFFIXES)}",
    )


def _place(image: Any, header: NiftiHeader | None) -> tuple[FloatArray, list[str]]:
    """(4, 4) where an image lies. SimpleITK turns a NIfTI file's leaning axes upright."""
    matrix = lps_from_index_of(image)
    if header is None or header.lps_from_index is None:
        return matrix, []
    if image.GetMetaData("ITK_sform_corrected") == "YES":
        return header.lps_from_index, [
            "the axes are not at right angles, as with a tilted gantry: every voxel is taken where "
            "the file says, nothing is resampled"
        ]
    corner = [*(extent - 1 for extent in image.GetSize()), 1]
    off = (matrix - header.lps_from_index) @ np.array([[0, 0, 0, 1], corner]).T
    if np.abs(off).max() > _SAME_PLACE_MM:
        return matrix, [
            f"the file says in two ways where it lies, {np.abs(off).max():.3g} mm apart (qform, "
            "sform): the first is taken"
        ]
    return matrix, []


def _space_warnings(path: Path, suffix: str, image: Any) -> list[str]:
    """A file that does not say which way is left may show the other knee."""
    keys = set(image.GetMetaDataKeys())
    if suffix in _NIFTI:
        codes = [image.GetMetaData(key) for key in ("qform_code", "sform_code") if key in keys]
        is_said = any(code.strip() != "0" for code in codes)
        assumed = "its axes are taken as left, front, head reversed by NIfTI's old default"
    elif suffix in _NRRD:
        is_said = "NRRD_space" in keys
        assumed = "LPS is assumed"
    else:
        return []
    return [] if is_said else [f"{path.name} names no coordinate space: {assumed}, check the side"]


def _make_damage_error(path: Path) -> InputError:
    return InputError(
        f"{path} is damaged or cut short", subject=str(path), remedy="export or copy it again"
    )


def convert_to_whole(values: NDArray[Any]) -> NDArray[np.integer[Any]] | None:
    """The values as an integer type; None when they are no whole numbers."""
    if np.issubdtype(values.dtype, np.integer):
        return values
    if not np.isfinite(values).all() or (values != np.round(values)).any():
        return None
    return values.astype(np.int32)
