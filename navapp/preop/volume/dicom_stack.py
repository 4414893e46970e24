"""Sorts the slices of a series and computes the place of every voxel, or refuses the series.

Positions decide (ImagePositionPatient along the normal), never file names, numbers or the
thickness tag: readers that go by those make a straight, evenly spaced stack of anything.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from navapp.errors import InputError
from navapp.geometry.transform import FloatArray
from navapp.preop.volume.dicom_headers import SliceHeader
from navapp.preop.volume.dicom_listing import Folder

# Steps may differ by this share of a step, or by this much: rounding of the position tags.
_STEP_FRACTION, _STEP_MM = 0.01, 0.01
# Directions: written with six digits, and 1e-4 moves a corner of a large picture by 0.03 mm.
_SAME_DIRECTION = 1e-4
# Directions of no unit length or not at right angles by more than this are damaged, not rounded.
_UNIT = 1e-3
# A gantry is tilted by whole degrees; a table and rounded tags lean by less than this.
_TILT_DEG = 0.5
_SAME_TILT_DEG = 1.0

_AGAIN = "export the whole series again, or get the CT from its archive"


def sort_slices(folder: Folder, slices: Sequence[SliceHeader]) -> list[SliceHeader]:
    """The slices sorted along their common normal, lowest first.

    Raises:
        InputError: they are not of one recording: other sizes, pixels, directions or frames.
    """
    first = slices[0]
    for name, of in (("modalities", _modality), ("frames of reference", _frame)):
        if len({of(header) for header in slices}) > 1:
            raise _make_mixed_error(folder, name)
    if len({(header.rows, header.columns) for header in slices}) > 1:
        raise _make_mixed_error(folder, "picture sizes")
    if any(not np.allclose(header.pixel_mm, first.pixel_mm, rtol=1e-4) for header in slices):
        raise _make_mixed_error(folder, "pixel spacings")
    for name in ("row", "column"):
        directions = np.array([getattr(header, name) for header in slices])
        if np.abs(directions - directions[0]).max() > _SAME_DIRECTION:
            raise _make_mixed_error(folder, "directions")
    lengths = np.linalg.norm([first.row, first.column], axis=1)
    if np.abs(lengths - 1.0).max() > _UNIT or abs(float(first.row @ first.column)) > _UNIT:
        raise folder.make_error("has a damaged direction tag (ImageOrientationPatient)", _AGAIN)
    return sorted(slices, key=lambda header: float(header.position_mm @ first.normal))


def is_same_place(a: SliceHeader, b: SliceHeader) -> bool:
    """Whether two slices lie at one place along the stack."""
    return abs(float((b.position_mm - a.position_mm) @ a.normal)) < _STEP_MM


def compute_stack_matrix(folder: Folder, ordered: Sequence[SliceHeader]) -> FloatArray:
    """(4, 4) `lps_from_index` of slices at different places, a lean of the stack kept in it.

    Raises:
        InputError: one slice only, slices missing, or steps that are not equal.
    """
    if len(ordered) < 2:
        raise folder.make_error("holds a single slice, which is no volume", _AGAIN)
    first = ordered[0]
    positions = np.array([header.position_mm for header in ordered])
    steps = np.diff(positions, axis=0)
    heights = steps @ first.normal
    typical = float(np.median(heights))
    tolerance = max(_STEP_FRACTION * typical, _STEP_MM)
    odd = np.flatnonzero(np.abs(heights - typical) > tolerance)
    if len(odd):
        raise _uneven(folder, positions, heights, typical, odd)
    step = (positions[-1] - positions[0]) / (len(ordered) - 1)
    line = positions[0] + np.arange(len(ordered))[:, None] * step
    off = np.maximum(np.abs(steps - step).max(axis=1), np.abs(positions - line).max(axis=1)[1:])
    if off.max() > tolerance:
        at = int(off.argmax())
        raise folder.make_error(
            f"has slices that are shifted against each other, by up to {off[at]:.2f} mm "
            f"between {_at(positions[at])} and {_at(positions[at + 1])}",
            _AGAIN,
        )
    row = first.row / np.linalg.norm(first.row)
    column = first.column - (first.column @ row) * row
    column /= np.linalg.norm(column)
    matrix = np.eye(4)
    matrix[:3, 0] = row * first.pixel_mm[1]
    matrix[:3, 1] = column * first.pixel_mm[0]
    matrix[:3, 2] = step
    matrix[:3, 3] = positions[0]
    return matrix


def make_thickness_warnings(ordered: Sequence[SliceHeader], matrix: FloatArray) -> list[str]:
    """What the thickness tag says otherwise than the positions, which are taken."""
    height = float(matrix[:3, 2] @ ordered[0].normal)
    tag = ordered[0].thickness_mm
    if tag is None or abs(tag - height) <= max(_STEP_FRACTION * height, _STEP_MM):
        return []
    what = "they overlap" if tag > height else "tissue between them was not recorded"
    return [
        f"slices lie {height:.4g} mm apart, the thickness tag says {tag:.4g} mm: positions are "
        f"taken ({what})"
    ]


def make_tilt_warnings(
    folder: Folder, ordered: Sequence[SliceHeader], matrix: FloatArray
) -> list[str]:
    """What positions and the tag say of a tilted gantry.

    The positions' lean is in the matrix, exactly. A tag without a lean is right for pictures that
    were computed from the recorded ones; in recorded ones one of the two is wrong.

    Raises:
        InputError: recorded slices whose tag tells of a tilt and whose positions tell of another.
    """
    step = matrix[:3, 2] / np.linalg.norm(matrix[:3, 2])
    sideways = float(np.linalg.norm(np.cross(ordered[0].normal, step)))
    lean_deg = float(np.degrees(np.arctan2(sideways, step @ ordered[0].normal)))
    tag_deg = abs(ordered[0].tilt_deg or 0.0)
    warnings = []
    if lean_deg > _TILT_DEG:
        warnings.append(
            f"the gantry was tilted: slices are shifted sideways, {lean_deg:.1f} degrees from "
            "their normal; every voxel is taken where it was recorded, nothing is resampled"
        )
    if tag_deg > _TILT_DEG and abs(tag_deg - lean_deg) > _SAME_TILT_DEG:
        said = f"a gantry tilt of {tag_deg:.1f} degrees in its tag and {lean_deg:.1f} by positions"
        if "DERIVED" not in ordered[0].image_type:
            raise folder.make_error(
                f"has {said}", "get the series as it was recorded, or resampled"
            )
        warnings.append(f"{said}: these pictures are derived, positions are taken")
    return warnings


def _modality(header: SliceHeader) -> str:
    return header.modality


def _frame(header: SliceHeader) -> str:
    return header.frame_uid


def _make_mixed_error(folder: Folder, what: str) -> InputError:
    return folder.make_error(
        f"holds two series mixed under one UID: their {what} differ",
        "separate them into folders of their own, or export the series again",
    )


def _uneven(
    folder: Folder,
    positions: FloatArray,
    heights: FloatArray,
    typical: float,
    odd: NDArray[np.intp],
) -> InputError:
    """Name the first gap; a whole number of steps is slices that are missing."""
    at = int(odd[0])
    where = f"between {_at(positions[at])} and {_at(positions[at + 1])}"
    more = f" and at {len(odd) - 1} further places" if len(odd) > 1 else ""
    n_missing = round(float(heights[at]) / typical) - 1
    is_whole = abs(heights[at] - (n_missing + 1) * typical) <= max(
        _STEP_FRACTION * heights[at], _STEP_MM
    )
    if n_missing >= 1 and is_whole:
        what = "1 slice is" if n_missing == 1 else f"{n_missing} slices are"
        return folder.make_error(
            f"is not complete: {what} missing {where}{more} "
            f"(a step of {heights[at]:.4g} mm, {typical:.4g} mm elsewhere)",
            _AGAIN,
        )
    return folder.make_error(
        f"has uneven slices: a step of {heights[at]:.4g} mm {where}{more}, "
        f"{typical:.4g} mm elsewhere",
        _AGAIN,
    )


def _at(position: FloatArray) -> str:
    return "({:.2f}, {:.2f}, {:.2f})".format(*position)
