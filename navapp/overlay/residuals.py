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
from navapp.values import Foreground

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
    cloud = foreground.measured.reproject(geometry)
    columns, rows = (cloud.pixels - (box.x, box.y)).T
    is_inside = (columns >= 0) & (columns < box.width) & (rows >= 0) & (rows < box.height)
    points_mm, rows, columns = cloud.points_mm[is_inside], rows[is_inside], columns[is_inside]
    is_on_bone = view.mask[rows, columns] & ~foreground.is_in_front[rows, columns]
    points_mm, rows, columns = points_mm[is_on_bone], rows[is_on_bone], columns[is_on_bone]
    normals = surface.normals[surface.faces[view.face_index[rows, columns]]].mean(axis=1)
    normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-9)[:, None]
    # The model's point on the ray through a measured one lies at another depth.
    off_mm = points_mm * (1.0 - view.depth_mm[rows, columns] / points_mm[:, 2])[:, None]
    found = np.full((box.height, box.width), np.nan, np.float32)
    found[rows, columns] = (rectified_from_bone.rotate(normals) * off_mm).sum(axis=1)
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
