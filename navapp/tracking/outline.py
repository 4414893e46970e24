"""The model's outline in both pictures, as a residual block.

Source: the paper's state of the art, equation (4): contour points of the model, searched along
their normals in the left and the right picture, point to line.
"""

import math
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.bands import run_both
from navapp.geometry.both_eyes_kernels import warp_depth
from navapp.geometry.box import Box
from navapp.geometry.mesh_edges import ridge_edges
from navapp.geometry.rectification import Image, RectifiedGeometry, RectifiedPair
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.geometry.zbuffer import RenderedView, find_known_range
from navapp.registration.model import RegistrationModel
from navapp.registration.residual_blocks import ResidualBlock, join
from navapp.tracking.edge_kernels import measure_edge_offsets
from navapp.tracking.frame import MODEL_SETTINGS, Fit
from navapp.tracking.outline_kernels import (
    Eye,
    Rim,
    count_near,
    find_rim,
    is_outline,
    thin_rim,
)
from navapp.tracking.surface_meter import MODEL_CORRELATION_PX
from navapp.values import DisparityMap, Origin

# All chosen, but where a source is named. The bone must be measured inside the outline, in this
# fraction of the pixels at these distances.
_INSIDE_PX, _LEAST_INSIDE = np.arange(4, 13), 0.4
# At this distance outside, nothing may be nearer than the outline by this much.
_BESIDE_PX, _NEARER_PX = 9, 1.0
# Standard deviation of an edge's place: sampling, and texture that reaches the rim.
_EDGE_SIGMA_PX = 0.15
# Standard deviation of an offset that all edges share: the tone curve of video cameras (ITU-R
# BT.709, computed: docs/how/registration.md) moves edges towards the dark, a linear one does not.
_COMMON_SD_PX = 0.3
# Of a refinement by the outline alone. It slides over the surface as the bone turns: it is found
# anew so often; so few edges move nothing.
_ROUNDS, _FEWEST = 2, 12
# Length at which a turn counts as much as a shift, and the least share of the largest singular
# value at which a direction is moved: the outline may leave some of them free.
_ARM_MM, _LEAST_SHARE = 30.0, 0.05


class OutlineMeter:
    """Measures the outline of one bone under one rig."""

    def __init__(self, model: RegistrationModel, geometry: RectifiedGeometry) -> None:
        self._model, self._geometry = model, geometry
        self.ridges = ridge_edges(model.seen_mesh)
        self._left = Eye(0.0, geometry.focal_px, geometry.centre_x_px, geometry.centre_y_px)
        self._right = self._left._replace(x_mm=geometry.baseline_mm)

    def join(
        self,
        pair: RectifiedPair,
        fit: Fit,
        coarse_px: NDArray[np.float32] | None,
        noise_variance_ratio: float = 1.0,
        *,
        counts_unmeasured: bool = False,
    ) -> Fit:
        """A fit to the model's surface, moved to what surface and outline say together.

        Any other fit stays as it is: from it the outline cannot be told from what lies around.

        Args:
            pair: in which it was fitted.
            fit: of the bone.
            coarse_px: (h, w) coarse disparity of whatever lies in its box.
            noise_variance_ratio: variance of the surface's noise over the one it claims.
            counts_unmeasured: edges count although the bone is not measured inside them, unless the
                coarse map has something nearer there.
        """
        estimate, view = fit.estimate, fit.measured.rendered
        if view is None or not estimate.has_finite_covariance:
            return fit
        found = fit.measured.disparity
        if counts_unmeasured and coarse_px is not None:
            nearest_px = self._geometry.disparity_map_px(view.depth_mm) + _NEARER_PX
            # Of a flank that one eye hardly sees neither model nor coarse map know anything there.
            is_free = ~(coarse_px > nearest_px)
            found = replace(found, origin=np.where(is_free, Origin.MATCHED, found.origin))
        # Where thickness is unknown, the points of an outline share one error.
        is_bare_only = estimate.thickness_ratio is not None
        block = self.block(pair, fit.pose, view, found, coarse_px, is_bare_only=is_bare_only)
        centre_mm = fit.pose.apply(self._model.centre_mm)
        seen_mm = fit.measured.cloud.points_mm
        joined = join(
            estimate, MODEL_SETTINGS.n_sigmas, block, centre_mm, seen_mm, noise_variance_ratio
        )
        return replace(fit, estimate=joined)

    def block(
        self,
        pair: RectifiedPair,
        pose: RigidTransform,
        view: RenderedView,
        measured: DisparityMap,
        coarse_px: NDArray[np.float32] | None = None,
        *,
        is_bare_only: bool = False,
    ) -> ResidualBlock:
        """Residuals of the outline in both pictures.

        Args:
            pair: rectified around the bone.
            pose: the rectified left camera from the bone.
            view: the model at that pose, or next to it.
            measured: on the model, in the view's box.
            coarse_px: (h, w) coarse disparity of whatever lies in that box.
            is_bare_only: without the outline of cartilage whose thickness is not known.
        """

        def find_edges(
            picture: Image, eye: Eye, depth_mm: NDArray[np.float32], first_column: int
        ) -> tuple[FloatArray, ...]:
            rim = self.find_seen_rim(pose, eye, depth_mm, (first_column, view.box.y))
            offset_px = measure_edge_offsets(picture, rim)
            is_found = np.isfinite(offset_px)
            rim, offset_px = select_points(rim, is_found), offset_px[is_found]
            is_free = self._is_free(rim, view.box, measured, coarse_px)
            if is_bare_only:
                is_free &= self._model.bone.cartilage_sd_mm[rim.vertex] == 0.0
            return offset_px[is_free], *self._linearise(select_points(rim, is_free), eye, pose)

        both = run_both(
            lambda: find_edges(pair.left, self._left, view.depth_mm, view.box.x),
            lambda: find_edges(pair.right, self._right, *self._warp_to_right(view)),
        )
        offset_px, jacobian, variance, n_sharing, arm_mm = map(
            np.concatenate, zip(*both, strict=True)
        )
        return ResidualBlock(jacobian, offset_px, variance, n_sharing, _COMMON_SD_PX, arm_mm)

    def find_seen_rim(
        self, pose: RigidTransform, eye: Eye, depth_mm: NDArray[np.float32], first: tuple[int, int]
    ) -> Rim:
        """What an eye should see of the outline.

        Args:
            pose: rectified left camera from bone.
            eye: that looks.
            depth_mm: (h, w) what it sees of the model, NaN beside it.
            first: column and row of that buffer's first pixel in its picture.
        """
        rim = find_rim(self.ridges, np.array(pose.rotation), np.array(pose.translation_mm), eye)
        thin: Rim = thin_rim(select_points(rim, is_outline(rim, depth_mm, *first)))
        return thin

    def refine(
        self, pair: RectifiedPair, pose: RigidTransform, measured: DisparityMap
    ) -> RigidTransform:
        """The pose whose outline lies on the edges of both pictures; unmoved without edges.

        Source: equation (4): the mean of the squared distances along the normals is least.

        Args:
            pair: rectified around the bone.
            pose: rectified left camera from bone.
            measured: surface; an edge counts only where the bone is measured inside it.
        """
        model, arm = self._model, np.repeat((1.0, _ARM_MM), 3)
        for _ in range(_ROUNDS):
            view = model.render(pose, pair.geometry, measured.box)
            block = self.block(pair, pose, view, measured)
            if len(block.residual) < _FEWEST:
                break
            step = np.linalg.lstsq(block.jacobian / arm, block.residual, _LEAST_SHARE)[0] / arm
            pose = pose.move(step, pose.apply(model.centre_mm))
        return pose

    def _warp_to_right(self, view: RenderedView) -> tuple[NDArray[np.float32], int]:
        """The view's depth as the right camera sees it, and its first column there."""
        box = view.box
        near_px, far_px = map(self._geometry.disparity_px, find_known_range(view.depth_mm))
        first_column = box.x - math.ceil(near_px)
        width = box.width + math.ceil(near_px) - math.floor(far_px)
        warped = np.full((box.height, width), np.nan, dtype=np.float32)
        scale_px_mm = self._geometry.focal_px * self._geometry.baseline_mm
        warp_depth(view.depth_mm, box.x, scale_px_mm, warped, first_column)
        return warped, first_column

    def _is_free(
        self, rim: Rim, box: Box, measured: DisparityMap, coarse_px: NDArray[np.float32] | None
    ) -> NDArray[np.bool_]:
        """(N,) points with the bone measured inside and nothing nearer outside."""
        pixel = self._geometry.project(rim.point)
        inner = pixel[:, None] - _INSIDE_PX[:, None] * rim.normal[:, None]
        is_measured = look_up(measured.origin, inner, box, 0) == Origin.MATCHED
        is_free: NDArray[np.bool_] = is_measured.mean(axis=1) >= _LEAST_INSIDE
        if coarse_px is not None:
            beside_px = look_up(coarse_px, pixel + _BESIDE_PX * rim.normal, box, np.nan)
            rim_px = self._geometry.disparity_map_px(rim.point[:, 2])
            is_free &= ~(beside_px > rim_px + _NEARER_PX)
        return is_free

    def _linearise(self, rim: Rim, eye: Eye, pose: RigidTransform) -> tuple[FloatArray, ...]:
        """(N, 6) Jacobian, (N,) variance, (N,) how many share an error, (N, 3) arm."""
        seen = rim.point - (eye.x_mm, 0.0, 0.0)
        per_mm = eye.focal_px / seen[:, 2]
        # The derivative of u . projection by the point; sliding along the surface changes nothing.
        by_depth = -(rim.normal * seen[:, :2]).sum(axis=1) * per_mm / seen[:, 2]
        slope = np.column_stack([rim.normal * per_mm[:, None], by_depth])
        arm = rim.point - pose.apply(self._model.centre_mm)
        surface_px = self._model.sigma_mm[rim.vertex] * per_mm
        n_sharing = count_near(rim.pixel, 0.5 * MODEL_CORRELATION_PX)
        jacobian = np.column_stack([slope, np.cross(arm, slope)])
        return jacobian, _EDGE_SIGMA_PX**2 + surface_px**2, n_sharing, arm


def select_points(rim: Rim, kept: NDArray[np.bool_]) -> Rim:
    """Those of a rim's points (N,) that are kept."""
    kept_parts: Any = (part[kept] for part in rim)
    return Rim(*kept_parts)


def look_up(values: NDArray[Any], pixels: FloatArray, box: Box, elsewhere: float) -> NDArray[Any]:
    """Values (h, w) of a box at pixels (..., 2) of the picture, rounded; `elsewhere` out of it."""
    column = np.floor(pixels[..., 0] + 0.5).astype(int) - box.x
    row = np.floor(pixels[..., 1] + 0.5).astype(int) - box.y
    height, width = values.shape
    inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
    answer = np.full(column.shape, elsewhere, dtype=values.dtype)
    answer[inside] = values[row[inside], column[inside]]
    return answer
