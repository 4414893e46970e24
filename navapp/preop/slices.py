"""Draws slices of a volume with a surface's contour, to check a segmentation by eye."""

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import FloatArray
from navapp.preop.volume import CtVolume, LabelVolume

Picture = NDArray[np.uint8]

_HEIGHT_PX = 360
# From fat to dense cortex.
_BLACK_HU, _WHITE_HU = -200.0, 1400.0
_CONTOUR = (60, 170, 255)
_MARGIN_MM = 12.0
# Subpixels of OpenCV's drawing, as a shift.
_SHIFT = 4


def draw_slices(volume: CtVolume | LabelVolume, mesh: TriangleMesh) -> Picture:
    """(h, w, 3) BGR: the three slices through a surface's middle, its contour drawn in.

    Args:
        volume: CT in HU, or labels.
        mesh: LPS mm.
    """
    indices = volume.indices_of(mesh.vertices_mm)
    return np.hstack([_slice(volume, mesh, indices, axis) for axis in (2, 1, 0)])


def _slice(
    volume: CtVolume | LabelVolume, mesh: TriangleMesh, indices: FloatArray, axis: int
) -> Picture:
    """One slice across an index axis (0 for i), at the height of most of the surface."""
    import cv2

    position = float(np.median(indices[:, axis]))
    across, down = (other for other in (0, 1, 2) if other != axis)
    voxels = volume.hu if isinstance(volume, CtVolume) else volume.labels
    plane = np.take(voxels, int(np.clip(round(position), 0, volume.size[axis] - 1)), axis=2 - axis)
    grey = _grey(volume, plane)
    margin = np.ceil(_MARGIN_MM / volume.spacing_mm[[across, down]])
    lower = np.maximum(indices[:, [across, down]].min(axis=0) - margin, 0.0).astype(int)
    size = np.array([volume.size[across], volume.size[down]])
    upper = np.minimum(indices[:, [across, down]].max(axis=0) + margin, size - 1.0).astype(int) + 1
    grey = grey[lower[1] : upper[1], lower[0] : upper[0]]
    scale = _HEIGHT_PX / ((upper - lower) * volume.spacing_mm[[across, down]])[1]
    steps = scale * volume.spacing_mm[[across, down]]
    width = max(2, round((upper - lower)[0] * steps[0]))
    picture = cv2.cvtColor(
        cv2.resize(grey, (width, _HEIGHT_PX), interpolation=cv2.INTER_LINEAR), cv2.COLOR_GRAY2BGR
    )
    ends = cut_contour(indices, mesh.faces, axis, position)[..., [across, down]]
    # A voxel's middle lies half a voxel inside its enlarged square.
    pixels = np.rint(((ends - lower + 0.5) * steps - 0.5) * 2**_SHIFT).astype(np.int32)
    cv2.polylines(picture, list(pixels), False, _CONTOUR, 1, cv2.LINE_AA, _SHIFT)
    # Up is the head, or the front.
    is_upright = volume.lps_from_index[2 if down == 2 else 1, down] * (-1 if down == 2 else 1) > 0
    return np.ascontiguousarray(picture if is_upright else picture[::-1])


def _grey(volume: CtVolume | LabelVolume, plane: NDArray[np.generic]) -> NDArray[np.uint8]:
    values = plane.astype(np.float32)
    if isinstance(volume, CtVolume):
        share = (values - _BLACK_HU) / (_WHITE_HU - _BLACK_HU)
    else:
        share = values / max(float(volume.labels.max()), 1.0)
    grey: NDArray[np.uint8] = (255.0 * np.clip(share, 0.0, 1.0)).astype(np.uint8)
    return grey


def cut_contour(
    points: FloatArray, faces: NDArray[np.int32], axis: int, position: float
) -> FloatArray:
    """(S, 2, 3) segments in which triangles cross the plane `points[:, axis] == position`."""
    height = points[:, axis] - position
    # A vertex in the plane counts as above it: every triangle then crosses in two edges or none.
    is_above = height >= 0.0
    crossing = faces[is_above[faces].any(axis=1) & ~is_above[faces].all(axis=1)]
    ends = np.empty((len(crossing), 2, 3))
    found = np.zeros(len(crossing), dtype=int)
    for start, end in ((0, 1), (1, 2), (2, 0)):
        a, b = crossing[:, start], crossing[:, end]
        rows = np.flatnonzero(is_above[a] != is_above[b])
        share = height[a[rows]] / (height[a[rows]] - height[b[rows]])
        ends[rows, found[rows]] = points[a[rows]] + share[:, None] * (
            points[b[rows]] - points[a[rows]]
        )
        found[rows] += 1
    return ends
