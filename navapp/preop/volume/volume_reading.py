"""Reads a CT or a segmentation, from DICOM or from one file."""

from dataclasses import dataclass
from pathlib import Path

from navapp.errors import InputError, UsageError
from navapp.preop.volume.ct_volume import CtVolume, LabelVolume, compute_steps_mm
from navapp.preop.volume.dicom_series import read_series
from navapp.preop.volume.hounsfield import convert_compactly, replace_padding
from navapp.preop.volume.volume_checks import make_content_warnings, refusal_of
from navapp.preop.volume.volume_files import convert_to_whole, read_file
from navapp.values import Side


@dataclass(frozen=True, slots=True)
class CtSource:
    """What to show of where a CT came from; nothing that names the patient."""

    kind: str  # "DICOM", or the file's suffix
    description: str  # the series' own words, or an empty text
    n_slices: int  # read into the volume
    # SliceThickness, which need not be the distance of the slices; or None.
    thickness_tag_mm: float | None = None
    side: Side | None = None  # "left" or "right" by the laterality tag, or None


@dataclass(frozen=True, slots=True, eq=False)
class ReadCt:
    """A CT with its source and warnings."""

    volume: CtVolume
    warnings: tuple[str, ...]
    source: CtSource


def read_ct(path: str | Path, series_uid: str | None = None) -> ReadCt:
    """Read a CT from a DICOM folder (any file names, also below it), or a NIfTI, NRRD or MHA file.

    Padding and values that are no number read as air. Names and numbers of the patient appear in
    no warning, no error and not in the result.

    Raises:
        InputError: missing, damaged, incomplete, mixed, ambiguous without `series_uid`, or without
            anything but air.
        UsageError: a series is named for something that is no folder.
    """
    path = Path(path)
    if path.is_dir():
        series = read_series(path, series_uid)
        source = CtSource(
            "DICOM",
            series.info.description,
            series.volume.size[2],
            series.thickness_tag_mm,
            series.side,
        )
        return _check_volume(series.shown, series.volume, series.warnings, source)
    if series_uid is not None:
        raise UsageError("--series is for a DICOM folder", remedy="leave it out, or name a folder")
    found = read_file(path)
    volume = CtVolume(
        convert_compactly(replace_padding(found.values)),
        found.lps_from_index,
        compute_steps_mm(found.lps_from_index),
    )
    source = CtSource(found.suffix, "", volume.size[2])
    return _check_volume(str(path), volume, found.warnings, source)


def read_labels(path: str | Path) -> LabelVolume:
    """Read a ready segmentation: a NIfTI, NRRD or MHA file of whole numbers.

    Raises:
        InputError: missing, damaged, or something else than labels.
    """
    found = read_file(Path(path))
    labels = convert_to_whole(found.values)
    if labels is None or not labels.any():
        what = "its values are not whole" if labels is None else "every voxel is 0"
        raise InputError(
            f"{path} is no label image: {what}",
            subject=str(path),
            remedy="export the segmentation as one label map",
        )
    return LabelVolume(labels, found.lps_from_index, compute_steps_mm(found.lps_from_index))


def _check_volume(
    shown: str, volume: CtVolume, warnings: tuple[str, ...], source: CtSource
) -> ReadCt:
    """The result, with what its content says; a refusal does not lose the warnings so far."""
    refusal = refusal_of(volume)
    if refusal is not None:
        problem, remedy = refusal
        also = f" ({'; '.join(warnings)})" if warnings else ""
        raise InputError(f"{shown} {problem}{also}", subject=shown, remedy=remedy)
    return ReadCt(volume, (*warnings, *make_content_warnings(volume)), source)
