"""How far the measured surface lies from the model at a pose, as a picture to judge a candidate by.

Signed along the model's normal: outside of the bone above 0, inside below.
"""

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.rectification import RectifiedGeometry
from navapp.geometry.transform import RigidTransform
from navapp.geometry.zbuffer import render_rectified
from navapp.overlay.labels import put_text
from navapp.values import Foreground, Origin

Image = NDArray[np.uint8]

# What has the full colour, and more.
FULL_MM = 1.0
# BGR: inside the bone, on it, outside; told apart by eyes that do not tell red from green.
_INSIDE, _ON, _OUTSIDE = (
    np.array(c, np.float32) for c in ((200, 90, 30), (240, 240, 240), (0, 110, 240))
)
_BAR_SHARE, _LEAST_WIDTH, _TEXT_SIZE = 0.14, 400, 0.5


def measure_residuals_mm(
    foreground: Foreground,
    rectified_from_bone: RigidTransform,
    surface: TriangleMesh,
    geometry: RectifiedGeometry,
) -> NDArray[np.float32]:
    """(h, w) over the foreground's box, mm; NaN where nothing was matched or no bone is seen."""
    box = foreground.box
    view = render_rectified(surface, rectified_from_bone, geometry, box)
    disparity_px = np.full((box.height, box.width), np.nan, np.float32)
    here, there = box.shared_slices(foreground.measured.box)
    is_matched = foreground.measured.origin[there] == Origin.MATCHED
    np.copyto(disparity_px[here], foreground.measured.disparity_px[there], where=is_matched)
    rows, columns = np.nonzero(view.mask & np.isfinite(disparity_px) & ~foreground.is_in_front)
    rays = np.column_stack(
        [
            (columns + box.x - geometry.centre_x_px) / geometry.focal_px,
            (rows + box.y - geometry.centre_y_px) / geometry.focal_px,
            np.ones(len(rows)),
        ]
    )
    corners_mm = surface.vertices_mm[surface.faces[view.face_index[rows, columns]]]
    normals = np.cross(corners_mm[:, 1] - corners_mm[:, 0], corners_mm[:, 2] - corners_mm[:, 0])
    normals = rectified_from_bone.rotate(normals / np.linalg.norm(normals, axis=1)[:, None])
    depth_mm = geometry.focal_px * geometry.baseline_mm / disparity_px[rows, columns]
    off_mm = depth_mm - view.depth_mm[rows, columns]
    found = np.full(disparity_px.shape, np.nan, np.float32)
    found[rows, columns] = (normals * rays).sum(axis=1) * off_mm
    return found


def draw_residuals(residual_mm: NDArray[np.float32], picture: Image) -> Image:
    """The residuals over a grey picture (h, w), with a colour bar at the right; (H, W, 3) BGR."""
    import cv2

    height, width = residual_mm.shape
    grey = cv2.resize(picture, (width, height), interpolation=cv2.INTER_LINEAR)
    drawn = np.repeat(np.asarray(grey, dtype=np.uint8)[:, :, None], 3, axis=2) // 2
    is_known = np.isfinite(residual_mm)
    drawn[is_known] = _colour(residual_mm[is_known])
    factor = max(1, round(_LEAST_WIDTH / width))
    drawn = drawn.repeat(factor, axis=0).repeat(factor, axis=1)
    return np.concatenate([drawn, _draw_bar(drawn.shape[0], drawn.shape[1])], axis=1)


def _colour(residual_mm: NDArray[np.float32]) -> Image:
    """(N, 3) BGR."""
    share = np.clip(residual_mm / FULL_MM, -1.0, 1.0)[:, None]
    end = np.where(share < 0.0, _INSIDE, _OUTSIDE)
    colours: Image = np.round(_ON + np.abs(share) * (end - _ON)).astype(np.uint8)
    return colours


def _draw_bar(height: int, picture_width: int) -> Image:
    """The scale: its greatest value above; nothing where there is no room for it."""
    width = max(56, round(_BAR_SHARE * picture_width))
    bar = np.zeros((height, width, 3), np.uint8)
    first, last = 24, height - 24
    if last <= first:
        return bar
    values = np.linspace(FULL_MM, -FULL_MM, last - first, dtype=np.float32)
    bar[first:last, 6:18] = _colour(values)[:, None]
    for text, y in (
        (f"+{FULL_MM:.0f}", first + 6),
        ("0", height // 2 + 5),
        (f"-{FULL_MM:.0f}", last),
    ):
        put_text(bar, text, (22, y), _TEXT_SIZE, (235, 235, 235))
    put_text(bar, "mm", (6, height - 6), _TEXT_SIZE, (235, 235, 235))
    return bar
