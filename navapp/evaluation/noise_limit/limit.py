"""The least error that a pair of pictures allows a pose: the Cramer-Rao bound.

The model: both pictures show the same unknown texture of the bone's surface, each with its own
noise, and a pose says which pixels of the two belong together. A pixel of the left picture less its
partner in the right one tells of the pose by as much as the picture changes along the row, over the
noise of both. Brightness around each pixel, and one contrast between the eyes, are free. The
outline tells of the pose as well, and is not counted.

Source: Rao 1945, Cramer 1946; for a shift between two noisy pictures Robinson and Milanfar 2004.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.box import Box
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.rectification import RectifiedGeometry, RectifiedPair
from navapp.geometry.transform import FloatArray, RigidTransform, twist_slopes
from navapp.geometry.zbuffer import RenderedView

Floats = NDArray[np.float32]

# As wide as a matching window: brightness is free over it.
_WINDOW = (11, 11)
# Derivative of the polynomial through seven pixels.
_SLOPE = np.array([[-1.0, 9.0, -45.0, 0.0, 45.0, -9.0, 1.0]], dtype=np.float32) / np.float32(60.0)
# Where a surface is seen at a sharper angle, a small move changes its disparity out of proportion.
_LEAST_COSINE = 0.15
_LEAST_SQUEEZE = 0.2


@dataclass(frozen=True, slots=True, eq=False)
class PixelModel:
    """What a pose says of N pixels in which a surface is seen."""

    rows: NDArray[np.intp]  # (N,) in the box
    columns: NDArray[np.intp]  # (N,) in the box
    squeeze: FloatArray  # (N,) columns of the right picture to one of the left
    slopes: FloatArray  # (N, 6) px of disparity per mm and rad of the twist about the bone's centre

    def select(self, mask: NDArray[np.bool_]) -> "PixelModel":
        """Only some of them (N,)."""
        return PixelModel(
            self.rows[mask], self.columns[mask], self.squeeze[mask], self.slopes[mask]
        )


@dataclass(frozen=True, slots=True, eq=False)
class PixelInformation:
    """What each of N pixels tells of its own disparity."""

    information: FloatArray  # (N,) 1 / px^2, mean-free: noise may make some of them negative
    score: FloatArray  # (N,) 1 / px; over the information, by how much its disparity seems larger
    deviation: FloatArray  # (N,) left less right picture, over the noise of both

    def select(self, mask: NDArray[np.bool_]) -> "PixelInformation":
        """Only some of them (N,)."""
        return PixelInformation(self.information[mask], self.score[mask], self.deviation[mask])


def model_pixels(
    view: RenderedView,
    surface: TriangleMesh,
    pose: RigidTransform,
    geometry: RectifiedGeometry,
    centre_mm: FloatArray,
) -> PixelModel:
    """The pixels of a view, and how their disparities change with the pose.

    Args:
        view: of the surface at the pose.
        surface: that was rendered.
        pose: rectified left camera from bone.
        geometry: of the rectified pair.
        centre_mm: (3,) of the bone, about which a twist turns it.

    When a point p with normal n moves by m, the surface moves along its pixel's ray by the fraction
    (n m) / (n p) of p, and the disparity d by -d (n m) / (n p).
    """
    disparity = geometry.disparity_map_px(view.depth_mm)
    squeeze = np.full(disparity.shape, np.nan)
    squeeze[:, 1:-1] = 1.0 - 0.5 * (disparity[:, 2:] - disparity[:, :-2])
    rows, columns = np.nonzero(view.mask)
    depth_mm = view.depth_mm[rows, columns].astype(np.float64)
    x = (columns + view.box.x - geometry.centre_x_px) / geometry.focal_px
    y = (rows + view.box.y - geometry.centre_y_px) / geometry.focal_px
    points_mm = np.column_stack([x, y, np.ones(len(x))]) * depth_mm[:, None]
    normals = _face_normals(surface, pose)[view.face_index[rows, columns]]
    facing = np.einsum("ni,ni->n", normals, points_mm)
    cosine = np.abs(facing) / np.linalg.norm(points_mm, axis=1)
    is_flat = (cosine > _LEAST_COSINE) & (squeeze[rows, columns] > _LEAST_SQUEEZE)
    arms = twist_slopes(points_mm[is_flat] - pose.apply(centre_mm))
    along = np.einsum("ni,nij->nj", normals[is_flat], arms) / facing[is_flat, None]
    rows, columns = rows[is_flat], columns[is_flat]
    slopes = -disparity[rows, columns, None] * along
    return PixelModel(rows, columns, squeeze[rows, columns], slopes)


def _face_normals(surface: TriangleMesh, pose: RigidTransform) -> FloatArray:
    """(F, 3) unit normals of the triangles at the pose."""
    corners = pose.apply(surface.vertices_mm)[surface.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return np.asarray(normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12))


def weigh_pixels(
    pair: RectifiedPair,
    support_px: Floats,
    pixels: PixelModel,
    variances: tuple[Floats, Floats],
) -> PixelInformation:
    """What the pictures tell of the pixels' disparities.

    Args:
        pair: grey.
        support_px: (h, w) disparity of the surface over the pair's box, NaN beside it.
        pixels: of that box.
        variances: (H, W) of the noise of both rectified pictures, grey levels squared.

    The information is the product of both pictures' slopes: their noises are independent, so that
    noise is not taken for texture, as it would be in the square of one.
    """
    import cv2

    box, at = pair.box, (pixels.rows, pixels.columns)
    is_seen, face = np.isfinite(support_px), partial(_face, box=box, support_px=support_px)
    left, right = (picture.astype(np.float32) for picture in (pair.left, pair.right))
    slope_left = np.asarray(cv2.filter2D(left, -1, _SLOPE), dtype=np.float32)
    slope_right = np.asarray(cv2.filter2D(right, -1, _SLOPE), dtype=np.float32)
    greys = [_without_mean(one, is_seen)[at] for one in (left[box.slices], face(right))]
    gain = np.sqrt(np.sum(greys[0] ** 2) / max(np.sum(greys[1] ** 2), 1e-9))
    squeezed = np.full(support_px.shape, np.nan)
    squeezed[at] = pixels.squeeze
    own = _without_mean(slope_left[box.slices] / np.nan_to_num(squeezed, nan=1.0), is_seen)[at]
    other = gain * _without_mean(face(slope_right), is_seen)[at]
    noise_right = face(variances[1], is_smooth=True)[at] / pixels.squeeze
    noise = variances[0][box.slices][at] + gain**2 * noise_right
    difference = greys[0] - gain * greys[1]
    score = -0.5 * (own + other) * difference / noise
    return PixelInformation(own * other / noise, score, difference / np.sqrt(noise))


def _face(picture: Floats, box: Box, support_px: Floats, *, is_smooth: bool = False) -> Floats:
    """(h, w) of the right picture (H, W): what the support says faces the pixels of the box."""
    import cv2

    columns, rows = np.meshgrid(np.arange(box.width) + box.x, np.arange(box.height) + box.y)
    asked = (columns - np.nan_to_num(support_px)).astype(np.float32), rows.astype(np.float32)
    method = cv2.INTER_LINEAR if is_smooth else cv2.INTER_LANCZOS4
    return np.asarray(cv2.remap(picture, *asked, method), dtype=np.float32)


def _without_mean(values: NDArray[np.floating], is_seen: NDArray[np.bool_]) -> FloatArray:
    """(h, w) less their mean over a window, of which only what is seen counts."""
    import cv2

    shown = is_seen.astype(np.float64)
    share = np.maximum(cv2.blur(shown, _WINDOW), 1e-6)
    return np.asarray(values - cv2.blur(values * shown, _WINDOW) / share)


def join_information(pixels: PixelModel, told: PixelInformation) -> FloatArray:
    """(6, 6) Fisher information of the twist, all pixels together."""
    return np.asarray((pixels.slopes * told.information[:, None]).T @ pixels.slopes)


def estimate_ideally(pixels: PixelModel, told: PixelInformation) -> FloatArray:
    """(6,) twist from the assumed pose to the one that the pixels tell, one Gauss-Newton step.

    From the true pose it is the error of an estimator that uses every pixel as the model says.
    """
    information = join_information(pixels, told)
    return np.asarray(np.linalg.solve(information, pixels.slopes.T @ told.score))


def weigh_directions(
    pose: RigidTransform, centre_mm: FloatArray, targets_mm: FloatArray
) -> FloatArray:
    """(6, 6) mean over the targets (N, 3) of J^T J, J = how a target moves with the twist."""
    slopes = twist_slopes(pose.rotate(targets_mm - centre_mm))
    return np.asarray(np.einsum("nki,nkj->ij", slopes, slopes) / len(slopes))


def find_least_error_mm(information: FloatArray, mean_square: FloatArray) -> float:
    """Cramer-Rao bound of the root mean square error over the targets.

    Args:
        information: (6, 6) of the twist.
        mean_square: (6, 6) of `weigh_directions`.

    Raises:
        LinAlgError: the pixels leave a direction free, or noise alone speaks for it.
    """
    root = np.linalg.solve(np.linalg.cholesky(information), np.eye(6))
    return float(np.sqrt(np.trace(root @ mean_square @ root.T)))
