"""How far a bone is drawn beside itself, in mm at the bone: not a target registration error.

Source: Maharjan et al. 2020, section 4, names a difference between targeted and genuine overlay
pixels in the box and gives no formula. Read here as the displacement, in the rectified left
picture, of the same points of the model.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.box import Box
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.rectification import RectifiedGeometry
from navapp.geometry.transform import RigidTransform
from navapp.geometry.zbuffer import RenderedView, bounds_of, render_rectified

# So many pixels of a model are compared; more change the mean by nothing that is shown.
_MOST_PIXELS = 20_000


@dataclass(frozen=True, slots=True)
class OverlayError:
    """Of one drawn pose."""

    # mean over the pixels of the model at the true pose: how far the same point of the model is
    # drawn beside its place, times its depth over the focal length.
    displacement_mm: float
    # mean distance of the two outlines from each other, both ways, at the bone's mean depth; None
    # where an outline is nowhere in the picture.
    outline_mm: float | None


def measure_overlay_error(
    estimated: RigidTransform,
    true: RigidTransform,
    surface: TriangleMesh,
    geometry: RectifiedGeometry,
) -> OverlayError | None:
    """Compare what is drawn at two poses.

    None where the bone is out of the picture at one, or in part behind the camera.

    Args:
        estimated: left camera from bone.
        true: the same.
        surface: of the bone as it is drawn.
        geometry: of the rectified pair.
    """
    poses = [geometry.rectified_from_left @ pose for pose in (true, estimated)]
    boxes = [bounds_of(surface.vertices_mm, pose, geometry)[0] for pose in poses]
    if boxes[0] is None or boxes[1] is None:
        return None
    box = _join(boxes[0], boxes[1]).clip(geometry.width, geometry.height)
    views = [render_rectified(surface, pose, geometry, box) for pose in poses]
    if not all(view.mask.any() for view in views):
        return None
    seen = views[0]
    depth_mm = float(seen.depth_mm[seen.mask].mean())
    displacement_mm = _measure_displacement_mm(seen, true, estimated, geometry)
    if not math.isfinite(displacement_mm):
        return None
    outline_px = _measure_outlines_px(*(view.mask for view in views))
    outline_mm = None if outline_px is None else outline_px * depth_mm / geometry.focal_px
    return OverlayError(displacement_mm, outline_mm)


def _join(one: Box, other: Box) -> Box:
    """The box around both, with a pixel beside them: a rim needs an outside."""
    x, y = min(one.x, other.x), min(one.y, other.y)
    right = max(one.x + one.width, other.x + other.width)
    bottom = max(one.y + one.height, other.y + other.height)
    return Box(x, y, right - x, bottom - y).grow(1)


def _measure_displacement_mm(
    seen: RenderedView, true: RigidTransform, estimated: RigidTransform, geometry: RectifiedGeometry
) -> float:
    rows, columns = np.nonzero(seen.mask)
    some = slice(None, None, max(1, len(rows) // _MOST_PIXELS))
    rows, columns = rows[some], columns[some]
    depth_mm = seen.depth_mm[rows, columns].astype(np.float64)
    pixels = np.column_stack([columns + seen.box.x, rows + seen.box.y]).astype(np.float64)
    centre = np.array([geometry.centre_x_px, geometry.centre_y_px])
    across_mm = (pixels - centre) * depth_mm[:, None] / geometry.focal_px
    in_rectified = np.column_stack([across_mm, depth_mm])
    rectified_from_left = geometry.rectified_from_left
    bone_from_rectified = (rectified_from_left @ true).inverse()
    moved = (rectified_from_left @ estimated).apply(bone_from_rectified.apply(in_rectified))
    off_px = np.linalg.norm(geometry.project(moved) - pixels, axis=1)
    return float(np.mean(off_px * depth_mm / geometry.focal_px))


def _measure_outlines_px(true: NDArray[np.bool_], drawn: NDArray[np.bool_]) -> float | None:
    """Mean distance of two masks' rims from each other, both ways (h, w); None without a rim."""
    import cv2

    rims = [_find_rim(mask) for mask in (true, drawn)]
    if not all(rim.any() for rim in rims):
        return None
    far = [
        cv2.distanceTransform((~rim).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
        for rim in rims
    ]
    return float(0.5 * (far[1][rims[0]].mean() + far[0][rims[1]].mean()))


def _find_rim(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Pixels of a mask with one of four neighbours outside; the picture's own edge is none.

    With eight neighbours a rim has steps of two pixels, and rims that are less than a pixel apart
    seem a quarter nearer than they are.
    """
    import cv2

    cross = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
    inside = cv2.erode(mask.astype(np.uint8), cross, borderType=cv2.BORDER_REPLICATE)
    rim: NDArray[np.bool_] = mask & (inside == 0)
    return rim
