"""The model's outline in both pictures, as a residual block.

Source: the paper's state of the art, equation (4): contour points of the model, searched along
their normals in the left and the right picture, point to line.
"""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.bands import run_both
from navapp.geometry.box import Box
from navapp.geometry.mesh_edges import ridge_edges
from navapp.geometry.rectification import Image, RectifiedGeometry, RectifiedPair
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.geometry.zbuffer import RenderedView
from navapp.geometry.zbuffer_kernels import find_known_range
from navapp.registration.information import ResidualBlock, join
from navapp.registration.model import RegistrationModel
from navapp.tracking.edge_kernels import find_steps
from navapp.tracking.frame import MODEL_FIT, Fit
from navapp.tracking.outline_kernels import (
    Eye,
    Ridges,
    Rim,
    find_rim,
    is_outline,
    thin_rim,
    warp_depth,
)
from navapp.tracking.surface_meter import MODEL_CORRELATION_PX
from navapp.values import DisparityMap, Origin

# Where behind the outline it is less dark than this, the edge is as often that of tissue on the
# bone (from simulated knees: docs/registration.md).
_DARKER = 0.7
# Inside the outline the bone itself has to be measured, at these distances and so often.
_INSIDE_PX, _LEAST_INSIDE = np.arange(4, 13), 0.4
# Beside it nothing may be nearer by this much.
_BESIDE_PX, _NEARER_PX = 9, 1.0
# Of an edge's place: sampling, texture up to the rim.
_EDGE_SIGMA_PX = 0.15
# The tone curve of video cameras moves all edges towards the dark by about so much, a linear one
# does not.
_COMMON_SD_PX = 0.3


@dataclass(frozen=True, slots=True, eq=False)
class Steps:
    """Edges found in one picture: where the model has them, and how far off they are, px."""

    rim: Rim
    offset_px: FloatArray
    eye: Eye


class OutlineMeter:
    """Measures the outline of one bone under one rig."""

    def __init__(self, model: RegistrationModel, geometry: RectifiedGeometry) -> None:
        self._model = model
        self._geometry = geometry
        found = ridge_edges(model.seen_mesh)
        self.ridges = Ridges(
            found.vertices_mm, found.edges, found.faces, found.opposite, found.planes
        )

    def join(
        self,
        pair: RectifiedPair,
        fit: Fit,
        coarse_px: NDArray[np.float32] | None,
        noise_variance_ratio: float = 1.0,
    ) -> Fit:
        """A fit to the model's surface, moved to what surface and outline say together.

        Any other fit stays as it is: from it the outline cannot be told from what lies around.

        Args:
            pair: that it was fitted in.
            fit: of the bone.
            coarse_px: (h, w) coarse disparity of whatever lies in its box.
            noise_variance_ratio: of the surface's noise to what it claims.
        """
        estimate, view = fit.estimate, fit.measured.view
        if view is None or not np.isfinite(estimate.covariance).all():
            return fit
        block = self.block(pair, fit.pose, view, fit.measured.disparity, coarse_px)
        centre_mm = fit.pose.apply(self._model.centre_mm)
        joined = join(estimate, MODEL_FIT.n_sigmas, block, centre_mm, noise_variance_ratio)
        return replace(fit, estimate=joined)

    def block(
        self,
        pair: RectifiedPair,
        pose: RigidTransform,
        view: RenderedView,
        measured: DisparityMap,
        coarse_px: NDArray[np.float32] | None = None,
    ) -> ResidualBlock:
        """Residuals of the outline in both pictures.

        Args:
            pair: rectified around the bone.
            pose: the rectified left camera from the bone.
            view: the model at that pose, or next to it.
            measured: on the model, in the view's box.
            coarse_px: (h, w) coarse disparity of whatever lies in that box.
        """
        left, right = self._eye(0.0), self._eye(self._geometry.baseline_mm)

        def residuals_in(
            picture: Image, eye: Eye, depth_mm: NDArray[np.float32], box: Box
        ) -> ResidualBlock:
            steps = self._steps(picture, eye, pose, depth_mm, box)
            return self._residuals(self._free(steps, view.box, measured, coarse_px), pose)

        blocks = run_both(
            lambda: residuals_in(pair.left, left, view.depth_mm, view.box),
            lambda: residuals_in(pair.right, right, *self._project_to_right(view, right)),
        )
        return ResidualBlock(
            np.concatenate([block.jacobian for block in blocks]),
            np.concatenate([block.residual for block in blocks]),
            np.concatenate([block.variance for block in blocks]),
            np.concatenate([block.n_sharing for block in blocks]),
            _COMMON_SD_PX,
        )

    def _eye(self, x_mm: float) -> Eye:
        geometry = self._geometry
        return Eye(x_mm, geometry.focal_px, geometry.centre_x_px, geometry.centre_y_px)

    def _project_to_right(self, view: RenderedView, right: Eye) -> tuple[NDArray[np.float32], Box]:
        depth, box = view.depth_mm, view.box
        nearest_mm, farthest_mm = find_known_range(depth)
        if nearest_mm > farthest_mm:
            return depth, box
        near, far = (self._geometry.disparity_px(z) for z in (nearest_mm, farthest_mm))
        x = box.x - math.ceil(near)
        width = box.width + math.ceil(near) - math.floor(far)
        warped = np.full((box.height, width), np.nan, dtype=np.float32)
        warp_depth(depth, box.x, right, warped, x)
        return warped, replace(box, x=x, width=width)

    def _steps(
        self,
        picture: Image,
        eye: Eye,
        pose: RigidTransform,
        depth_mm: NDArray[np.float32],
        box: Box,
    ) -> Steps:
        rim = find_rim(self.ridges, np.array(pose.rotation), np.array(pose.translation_mm), eye)
        rim = thin_rim(_only(rim, is_outline(rim, depth_mm, box.x, box.y)))
        offset_px = find_steps(picture, rim, _DARKER)
        is_found = np.isfinite(offset_px)
        return Steps(_only(rim, is_found), offset_px[is_found], eye)

    def _free(
        self,
        steps: Steps,
        box: Box,
        measured: DisparityMap,
        coarse_px: NDArray[np.float32] | None,
    ) -> Steps:
        """Those with the bone measured inside and nothing nearer beside them."""
        rim, geometry = steps.rim, self._geometry
        pixel = geometry.project(rim.point)
        inner = pixel[:, None] - _INSIDE_PX[:, None] * rim.normal[:, None]
        share = (_at(measured.origin, inner, box, 0) == Origin.MATCHED).mean(axis=1)
        is_free = share >= _LEAST_INSIDE
        if coarse_px is not None:
            next_px = _at(coarse_px, pixel + _BESIDE_PX * rim.normal, box, np.nan)
            is_free &= ~(next_px > geometry.disparity_map_px(rim.point[:, 2]) + _NEARER_PX)
        return Steps(_only(rim, is_free), steps.offset_px[is_free], steps.eye)

    def _residuals(self, steps: Steps, pose: RigidTransform) -> ResidualBlock:
        rim, focal = steps.rim, steps.eye.focal_px
        seen = rim.point - (steps.eye.x_mm, 0.0, 0.0)
        per_mm = focal / seen[:, 2]
        # The derivative of u . projection by the point; sliding along the surface changes nothing.
        slope = np.column_stack(
            [
                rim.normal * per_mm[:, None],
                -(rim.normal * seen[:, :2]).sum(axis=1) * per_mm / seen[:, 2],
            ]
        )
        arm = rim.point - pose.apply(self._model.centre_mm)
        surface_px = self._model.sigma_mm[rim.vertex] * per_mm
        apart = np.linalg.norm(rim.pixel[:, None] - rim.pixel[None], axis=2)
        return ResidualBlock(
            np.column_stack([slope, np.cross(arm, slope)]),
            steps.offset_px,
            _EDGE_SIGMA_PX**2 + surface_px**2,
            (apart <= 0.5 * MODEL_CORRELATION_PX).sum(axis=1).astype(np.float64),
            _COMMON_SD_PX,
        )


def _only(rim: Rim, kept: NDArray[np.bool_]) -> Rim:
    return Rim(
        rim.point[kept], rim.pixel[kept], rim.normal[kept], rim.length[kept], rim.vertex[kept]
    )


def _at(values: NDArray[Any], pixels: FloatArray, box: Box, elsewhere: float) -> NDArray[Any]:
    """Values (h, w) of a box at pixels (..., 2) of the picture, rounded; `elsewhere` out of it."""
    column = np.floor(pixels[..., 0] + 0.5).astype(int) - box.x
    row = np.floor(pixels[..., 1] + 0.5).astype(int) - box.y
    height, width = values.shape
    inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
    answer = np.full(column.shape, elsewhere, dtype=values.dtype)
    answer[inside] = values[row[inside], column[inside]]
    return answer
