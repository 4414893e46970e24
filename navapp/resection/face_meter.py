"""Measures the faces that a saw left, in pairs of pictures in which the bone's pose is known.

Only matched pixels count, never filled ones. The plane of a face is found relative to the cameras,
without the bone's model; the pose then says where it lies in the bone.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.box import Box
from navapp.geometry.masks import grow
from navapp.geometry.rectification import Image, RectifiedPair, rectifier_of
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.resection.face_errors import make_face
from navapp.resection.face_fit import (
    DisparityPlane,
    disparity_coefficients,
    fit_disparity_plane,
)
from navapp.resection.face_view import LEAST_PIXELS, RIM_PX, FaceView, FaceViewer
from navapp.resection.remaining_bone import Cut
from navapp.stereo import match_surface, refine_on_model
from navapp.stereo.matte_pictures import find_clipped, make_matte_pair
from navapp.values import (
    BoneModel,
    DisparityMap,
    MeasuredFace,
    PoseEstimate,
    ResectionPlane,
)
from navapp.values.faces import MOST_OFF_PLAN_MM

# All chosen. A saw's face is looked for so far from where it is expected, along the view.
_BAND_MM = 8.0
# Neighbouring pixels share their windows: every second one each way tells as much.
_STRIDE_PX = 2
_MAX_ROUNDS, _REST_PX = 6, 0.02
# The matcher sees no further from the plane that it is given.
_NEAR_PX = 1.0
# By how much highlights move a face (standard deviation, as tests.bench.face_highlights shows it on
# chamfers), and which share of the difference of the planes with and without them is left open.
HIGHLIGHT_PX, _LEFT_OPEN = 0.1, 0.5
# The lamp may be so much less blue than white is in the pictures (standard deviation).
_OTHER_LAMP = 0.8
_SURELY_MOVED = 7.81  # chi-square of 3 degrees of freedom at 95 %


class FaceMeter:
    """Measures the sawn faces of one bone under one rig."""

    def __init__(self, rig: StereoRig, bone: BoneModel) -> None:
        self._rectifier = rectifier_of(rig)
        self._geometry = self._rectifier.geometry
        self._bone, self._quality = bone, rig.quality
        self._viewer = FaceViewer(bone, self._geometry)

    def measure(
        self,
        left: Image,
        right: Image,
        estimate: PoseEstimate,
        planned: ResectionPlane,
        others: Sequence[Cut],
        *,
        expected: ResectionPlane | None = None,
        row_shifts_px: tuple[FloatArray, FloatArray] | None = None,
    ) -> MeasuredFace | None:
        """One face, against its plan.

        Args:
            left: picture of the left camera.
            right: of the right one, at the same instant.
            estimate: of the bone's pose in the left camera.
            planned: the cut whose face is measured.
            others: the other cuts of the bone that have been made, as far as they are known.
            expected: where it lay in an earlier picture.
            row_shifts_px: as of `Rectifier.rectify`: with them the pose is that at their time.

        Returns:
            None when too little of it is seen, or it lies too far from the plan.
        """
        rectified_from_bone = self._geometry.rectified_from_left @ estimate.camera_from_bone

        def rectify(view: FaceView, *, is_grey: bool = False) -> RectifiedPair:
            return self._rectifier.rectify(
                left, right, view.box, self._band_px(view),
                is_grey=is_grey, row_shifts_px=row_shifts_px,
            )  # fmt: skip

        plane, pair = expected or planned, None
        # From the plan, where a saw may have missed it, the first look is a wide one.
        is_far = expected is None
        for _ in range(_MAX_ROUNDS):
            coefficients = self._coefficients(plane, rectified_from_bone)
            view = self._viewer.find(plane, planned, others, rectified_from_bone)
            if view is None:
                return None
            if pair is None or view.box.intersect(pair.box) != view.box:
                pair = rectify(view, is_grey=True)
            fit = self._fit(replace(pair, box=view.box), view, coefficients, is_far=is_far)
            if fit is None:
                return None
            plane = self._plane_in_bone(fit, plane, rectified_from_bone)
            moved_px = self._moved_px(fit.coefficients - coefficients, view)
            if not is_far and moved_px < _REST_PX:
                fit = self._choose_plane(replace(pair, box=view.box), rectify(view), view, fit)
                if fit is None:
                    return None
                share = fit.is_on.sum() * _STRIDE_PX**2 / max(view.n_whole, 1)
                face = make_face(
                    fit, self._geometry, estimate, self._bone, self._quality, planned,
                    min(float(share), 1.0),
                )  # fmt: skip
                return face if face.is_near_plan else None
            is_far = False
        return None

    def _coefficients(
        self, plane: ResectionPlane, rectified_from_bone: RigidTransform
    ) -> FloatArray:
        normal = rectified_from_bone.rotate(plane.normal[None])[0]
        distance_mm = float(normal @ rectified_from_bone.apply(plane.point_mm[None])[0])
        return disparity_coefficients(normal, distance_mm, self._geometry)

    def _band_px(self, view: FaceView) -> tuple[float, float]:
        """Smallest and largest disparity on the face, and around it."""
        near_mm, far_mm = view.depths_mm
        near_mm, far_mm = max(near_mm - _BAND_MM, 1.0), far_mm + _BAND_MM
        return self._geometry.disparity_px(far_mm), self._geometry.disparity_px(near_mm)

    def _places(self, pixels: NDArray[np.int64]) -> FloatArray:
        """(N, 3) of (u - c_x, v - c_y, 1)."""
        middle = np.array([self._geometry.centre_x_px, self._geometry.centre_y_px])
        return np.column_stack([pixels - middle, np.ones(len(pixels))])

    def _fit(
        self, pair: RectifiedPair, view: FaceView, coefficients: FloatArray, *, is_far: bool
    ) -> DisparityPlane | None:
        """The plane of what was matched on the face; None where too little is."""
        if is_far:
            found = match_surface(pair, self._band_px(view), fills=False).disparity
            reach_px = self._reach_px(view.box, coefficients)
            return self._fit_pixels(found, view.is_face, coefficients, reach_px)
        found = self._refine(pair, view, coefficients)
        fit = self._fit_pixels(found, view.is_face, coefficients, _NEAR_PX)
        if fit is None:
            return None
        # What covers a part of the face is seen by the windows beside it as well.
        covered = _without_specks(view.is_face & ~self._is_on(found, fit))
        inside = view.is_face & ~grow(covered, RIM_PX)
        return self._fit_pixels(found, inside, fit.coefficients, _NEAR_PX)

    def _choose_plane(
        self, grey: RectifiedPair, pair: RectifiedPair, view: FaceView, fit: DisparityPlane
    ) -> DisparityPlane | None:
        """A plane that highlights have not moved, or how far they may have moved it in its bound.

        Where the plane without highlights differs for sure, it is taken; else the one that is known
        better. Without colour the plane stays as it is, and more is left open.

        Returns:
            None where too little of the face is not clipped.
        """
        is_clipped = self._find_clipped(pair, view, fit.coefficients)
        if (is_clipped & view.is_face).any():
            view = replace(view, is_face=view.is_face & ~grow(is_clipped, RIM_PX))
            unclipped = self._fit(grey, view, fit.coefficients, is_far=False)
            if unclipped is None:
                return None
            fit = unclipped
        matte, other = (self._fit_matte(pair, view, fit, blue) for blue in (1.0, _OTHER_LAMP))
        if matte is None or other is None:
            return self._leave_highlights_open(fit, view)
        moved = matte.coefficients - fit.coefficients
        is_moved = moved @ np.linalg.solve(fit.covariance + matte.covariance, moved) > _SURELY_MOVED
        best = matte if is_moved else min(fit, matte, key=lambda one: np.linalg.det(one.covariance))
        by_lamp = other.coefficients - matte.coefficients
        return best.with_error(_LEFT_OPEN * moved).with_error(by_lamp)

    def _find_clipped(
        self, pair: RectifiedPair, view: FaceView, coefficients: FloatArray
    ) -> NDArray[np.bool_]:
        """(h, w) pixels of the face's box that are clipped in one of the pictures."""
        left, right = find_clipped(pair.left), find_clipped(pair.right)
        rows, columns = np.nonzero(view.is_face)
        rows, columns = rows + view.box.y, columns + view.box.x
        disparity_px = self._places(np.column_stack([columns, rows])) @ coefficients
        seen_at = np.rint(columns - disparity_px).astype(np.intp).clip(0, right.shape[1] - 1)
        is_clipped = np.zeros(view.is_face.shape, dtype=np.bool_)
        is_clipped[view.is_face] = left[rows, columns] | right[rows, seen_at]
        return is_clipped

    def _fit_matte(
        self, pair: RectifiedPair, view: FaceView, fit: DisparityPlane, blue: float
    ) -> DisparityPlane | None:
        """The plane in pictures without highlights, from one that is near; None without colour."""
        matte = make_matte_pair(pair, view.is_face, blue)
        return None if matte is None else self._fit(matte, view, fit.coefficients, is_far=False)

    def _leave_highlights_open(self, fit: DisparityPlane, view: FaceView) -> DisparityPlane:
        """With offset and both tilts as unsure as highlights make them."""
        rows, columns = np.nonzero(view.is_face)
        places = self._places(np.column_stack([columns + view.box.x, rows + view.box.y]))
        u, v, _ = places.mean(axis=0)
        half_u, half_v, _ = np.maximum(0.5 * np.ptp(places, axis=0), 1.0)
        for deviation in ((0.0, 0.0, 1.0), (1.0, 0.0, -u) / half_u, (0.0, 1.0, -v) / half_v):
            fit = fit.with_error(HIGHLIGHT_PX * np.asarray(deviation))
        return fit

    def _reach_px(self, box: Box, coefficients: FloatArray) -> float:
        """How far a saw may have missed, in disparity: along the view at most."""
        middle = self._places(np.array([[box.x + box.width // 2, box.y + box.height // 2]]))
        depth_mm = self._geometry.depth_mm(float(middle[0] @ coefficients))
        nearer_px = self._geometry.disparity_px(depth_mm - MOST_OFF_PLAN_MM)
        return nearer_px - self._geometry.disparity_px(depth_mm)

    def _fit_pixels(
        self,
        found: DisparityMap,
        mask: NDArray[np.bool_],
        start: FloatArray,
        reach_px: float,
    ) -> DisparityPlane | None:
        rows, columns = np.nonzero(mask & found.is_matched)
        thin = (rows % _STRIDE_PX == 0) & (columns % _STRIDE_PX == 0)
        rows, columns = rows[thin], columns[thin]
        if len(rows) * _STRIDE_PX**2 < LEAST_PIXELS:
            return None
        places = self._places(np.column_stack([columns + found.x, rows + found.y]))
        disparity_px = found.disparity_px[rows, columns].astype(np.float64)
        sigma_px = found.sigma_px[rows, columns].astype(np.float64)
        return fit_disparity_plane(places, disparity_px, sigma_px, start, reach_px)

    def _is_on(self, found: DisparityMap, fit: DisparityPlane) -> NDArray[np.bool_]:
        """(h, w) whether a pixel was matched on a plane."""
        residual = found.disparity_px - self._support_px(found.box, fit.coefficients)
        # A comparison with an unknown disparity is False.
        return np.asarray(np.abs(residual) < fit.width_px)

    def _refine(
        self, pair: RectifiedPair, view: FaceView, coefficients: FloatArray
    ) -> DisparityMap:
        support_px = self._support_px(view.box, coefficients)
        is_asked = grow(view.is_face, RIM_PX)
        return refine_on_model(pair, np.where(is_asked, support_px, np.float32(np.nan)))

    def _support_px(self, box: Box, coefficients: FloatArray) -> NDArray[np.float32]:
        """(h, w) disparity of a plane over a box."""
        u = np.arange(box.width) + (box.x - self._geometry.centre_x_px)
        v = np.arange(box.height) + (box.y - self._geometry.centre_y_px)
        a, b, c = coefficients
        return np.asarray(a * u + b * v[:, None] + c, dtype=np.float32)

    def _plane_in_bone(
        self, fit: DisparityPlane, plane: ResectionPlane, rectified_from_bone: RigidTransform
    ) -> ResectionPlane:
        normal, distance_mm = fit.in_camera(self._geometry)
        bone_from_rectified = rectified_from_bone.inverse()
        in_bone = bone_from_rectified.rotate(normal[None])[0]
        point = rectified_from_bone.apply(plane.point_mm[None])[0]
        moved_mm = plane.point_mm + (distance_mm - float(normal @ point)) * in_bone
        return replace(plane, point_mm=moved_mm, normal=in_bone)

    def _moved_px(self, change: FloatArray, view: FaceView) -> float:
        """Largest change of disparity over the face."""
        rows, columns = np.nonzero(view.is_face)
        pixels = np.column_stack([columns + view.box.x, rows + view.box.y])
        return float(np.abs(self._places(pixels) @ change).max(initial=0.0))


def _without_specks(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    import cv2

    square = np.ones((3, 3), np.uint8)
    return np.asarray(cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_OPEN, square) > 0)
