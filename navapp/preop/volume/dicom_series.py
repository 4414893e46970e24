"""One DICOM series as a volume: order and place from the headers, voxels from SimpleITK."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from navapp.preop.volume.ct_volume import CtVolume, compute_steps_mm
from navapp.preop.volume.dicom_headers import SliceHeader
from navapp.preop.volume.dicom_listing import (
    Folder,
    SeriesInfo,
    check_others,
    choose_series,
    scan_folder,
)
from navapp.preop.volume.dicom_stack import (
    compute_stack_matrix,
    is_same_place,
    make_thickness_warnings,
    make_tilt_warnings,
    sort_slices,
)
from navapp.preop.volume.hounsfield import PADDING_HU, HuArray, convert_compactly, replace_padding
from navapp.preop.volume.itk_package import listen_to_codecs, read_image, voxels_of
from navapp.values import Side

_HasComplained = Callable[[], bool]


@dataclass(frozen=True, slots=True, eq=False)
class DicomVolume:
    """A series that was read, before its content is judged."""

    shown: str  # the folder's path, fit to be shown
    volume: CtVolume  # what it shows
    info: SeriesInfo  # the series
    thickness_tag_mm: float | None  # as the tag says; the positions decide
    side: Side | None  # by the laterality tag of all slices
    warnings: tuple[str, ...]  # what was mended or is odd


def read_series(path: Path, series_uid: str | None) -> DicomVolume:
    """Read a series of a folder.

    Raises:
        InputError: no such series, or one that is incomplete, mixed or damaged.
    """
    folder = scan_folder(path)
    info, warnings = choose_series(folder, series_uid)
    warnings += check_others(folder, info.uid)
    ordered = sort_slices(folder, folder.series[info.uid])
    with listen_to_codecs() as has_complained:
        ordered, dropped = _without_duplicates(folder, ordered, has_complained)
        matrix = compute_stack_matrix(folder, ordered)
        warnings += make_tilt_warnings(folder, ordered, matrix) + dropped
        slices = [_slice_hu(folder, header, has_complained) for header in ordered]
    warnings += make_thickness_warnings(ordered, matrix)
    if info.modality != "CT":
        warnings.append(f"the series is {info.modality or 'of no kind'}, not CT: no HU in it")
    sides = {header.side for header in ordered}
    if len(sides) > 1:
        warnings.append("the laterality tags of the slices differ: none is taken")
    volume = CtVolume(convert_compactly(np.stack(slices)), matrix, compute_steps_mm(matrix))
    side = next(iter(sides)) if len(sides) == 1 else None
    thickness_mm = ordered[0].thickness_mm
    return DicomVolume(folder.shown, volume, info, thickness_mm, side, tuple(warnings))


def _without_duplicates(
    folder: Folder, ordered: Sequence[SliceHeader], has_complained: _HasComplained
) -> tuple[list[SliceHeader], list[str]]:
    """One slice a place; copies are dropped.

    Raises:
        InputError: two different pictures lie at one place.
    """
    kept = [ordered[0]]
    for header in ordered[1:]:
        if not is_same_place(kept[-1], header):
            kept.append(header)
            continue
        one, other = (_slice_hu(folder, each, has_complained) for each in (kept[-1], header))
        is_shifted = np.abs(header.position_mm - kept[-1].position_mm).max() >= 0.01
        if is_shifted or not np.array_equal(one, other):
            place = "({:.2f}, {:.2f}, {:.2f})".format(*header.position_mm)
            raise folder.make_error(
                f"holds two different slices at {place}: two recordings are mixed under one UID",
                "separate them into folders of their own, or export the series again",
            )
    n_dropped = len(ordered) - len(kept)
    if not n_dropped:
        return kept, []
    what = "1 slice that is" if n_dropped == 1 else f"{n_dropped} slices that are"
    return kept, [f"{what} there twice, pixel by pixel, was dropped"]


def _slice_hu(folder: Folder, header: SliceHeader, has_complained: _HasComplained) -> HuArray:
    """(H, W) of one slice, its rescale applied; padding reads as air.

    Raises:
        InputError: the pixels are damaged or missing.
    """
    hu: NDArray[np.generic] | None = None
    try:
        hu = voxels_of(read_image(header.file, "GDCMImageIO"))
    except RuntimeError:
        # Its text may quote anything from the file.
        hu = None
    if hu is None or hu.shape != (1, header.rows, header.columns) or has_complained():
        raise folder.make_error(
            f"holds the file {folder.name_of(header.file)}, whose picture is damaged, cut short "
            "or in an encoding that is not known",
            "export the series again, uncompressed if it still fails",
        )
    picture = replace_padding(hu[0])
    if header.padding_hu is not None:
        lowest, highest = header.padding_hu
        picture[(picture >= lowest) & (picture <= highest)] = PADDING_HU
    return convert_compactly(picture)
