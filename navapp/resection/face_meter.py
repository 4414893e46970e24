"""Measures the faces that a saw left, in pairs of pictures in which the bone's pose is known.

Only matched pixels count, never filled ones. The plane of a face is found relative to the cameras,
without the bone's model; the pose then says where it lies in the bone.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.box import Box
from navapp.geometry.mesh import TriangleMesh, join_meshes
from navapp.geometry.mesh_sections import fill_section, section_lines
from navapp.geometry.rectification import Image, RectifiedPair, Rectifier
from navapp.geometry.rig import StereoRig
from navapp.geometry.simplify import drawn
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.geometry.zbuffer import render_rectified
from navapp.resection.face_fit import (
    DisparityPlane,
    disparity_coefficients,
    fit_disparity_plane,
    plane_in_camera,
)
from navapp.resection.remaining_bone import Cut, heights_over, remove_cuts
from navapp.stereo import MODEL_REFINEMENT, match_surface, refine_on_model
from navapp.values import BoneModel, DisparityMap, MeasuredFace, Origin, PoseEstimate
from navapp.values.contents import ResectionPlane

# All chosen. A saw's face is looked for so far from where it is expected, along the view.
_BAND_MM = 8.0
# Windows of the matcher that reach over the rim of a face see both sides of it.
_RIM_PX = MODEL_REFINEMENT.radius_px
_MARGIN_PX = 12
# Neighbouring pixels share their windows: every second one each way tells as much.
_STRIDE_PX = 2
_MAX_ROUNDS, _REST_PX = 6, 0.02
# The matcher sees no further from the plane that it is given.
_NEAR_PX = 1.0
# A saw misses its plan by no more: what is flat, but lies further off, is something else.
_MOST_OFF_MM, _MOST_TILT_DEG = 4.0, 6.0
_LEAST_PIXELS = 300
# A face that is seen at a grazing angle tells nothing; one of which most lies beside the picture
# neither.
_LEAST_COSINE, _MOST_PICTURES = 0.17, 20
# Errors that all of a bone's surface shares turn a pose by as much as they are over this length.
_LEVER_MM = 30.0
# Another cut's bone is gone as well, and its edge is as wide.
_BESIDE_MM = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class _View:
    """A face as the left camera should see it: its pixels, and how many the whole face has."""

    box: Box
    is_face: NDArray[np.bool_]  # (h, w) without its rim
    n_whole: int  # without their rim as well; outside of the picture, too
    depths_mm: tuple[float, float]  # least and largest


class FaceMeter:
    """Measures the sawn faces of one bone under one rig."""

    def __init__(self, rig: StereoRig, bone: BoneModel) -> None:
        self._rectifier = Rectifier(rig)
        self._geometry = self._rectifier.geometry
        self._bone, self._quality = bone, rig.quality
        self._centre_mm = bone.mesh.centroid_mm
        self._rest = lru_cache(maxsize=8)(_make_rest)

    def measure(
        self,
        left: Image,
        right: Image,
        estimate: PoseEstimate,
        made: Sequence[ResectionPlane],
        planned: ResectionPlane,
        expected: ResectionPlane | None = None,
    ) -> MeasuredFace | None:
        """One face, against its plan.

        Args:
            left: picture of the left camera.
            right: of the right one, at the same instant.
            estimate: of the bone's pose in the left camera.
            made: all cuts of the bone that have been made.
            planned: the one whose face is measured.
            expected: where it lay in an earlier picture.

        Returns:
            None when too little of it is seen.
        """
        rectified_from_bone = self._geometry.rectified_from_left @ estimate.camera_from_bone
        plane, pair = expected or planned, None
        # From the plan, where a saw may have missed it, the first look is a wide one.
        is_far = expected is None
        for _ in range(_MAX_ROUNDS):
            coefficients = self._coefficients(plane, rectified_from_bone)
            view = self._view(plane, made, planned, rectified_from_bone)
            if view is None:
                return None
            if pair is None or view.box.intersect(pair.box) != view.box:
                pair = self._rectify(left, right, view)
            fit = self._fit(replace(pair, box=view.box), view, coefficients, is_far=is_far)
            if fit is None:
                return None
            plane = self._plane_in_bone(fit, plane, rectified_from_bone)
            moved_px = self._moved_px(fit.coefficients - coefficients, view)
            if not is_far and moved_px < _REST_PX:
                share = fit.is_on.sum() * _STRIDE_PX**2 / max(view.n_whole, 1)
                face = self._face(fit, estimate, planned, min(float(share), 1.0))
                return face if _is_of_plan(face) else None
            is_far = False
        return None

    def _coefficients(
        self, plane: ResectionPlane, rectified_from_bone: RigidTransform
    ) -> FloatArray:
        normal = rectified_from_bone.rotate(plane.normal[None])[0]
        distance_mm = float(normal @ rectified_from_bone.apply(plane.point_mm[None])[0])
        return disparity_coefficients(normal, distance_mm, self._geometry)

    def _view(
        self,
        plane: ResectionPlane,
        made: Sequence[ResectionPlane],
        planned: ResectionPlane,
        rectified_from_bone: RigidTransform,
    ) -> _View | None:
        """Where the face is seen; None when it looks away, or out of view."""
        normal = rectified_from_bone.rotate(plane.normal[None])[0]
        point_mm = rectified_from_bone.apply(plane.point_mm[None])[0]
        if -(normal @ point_mm) < _LEAST_COSINE * np.linalg.norm(point_mm):
            return None
        mesh = self._bone.mesh
        lines = section_lines(mesh, heights_over(mesh, Cut(plane, 0.0)))
        face = fill_section(lines, plane.normal)
        if face is None:
            return None
        corners_mm = rectified_from_bone.apply(face.vertices_mm)
        around = Box.around(self._geometry.project(corners_mm))
        if around is None or corners_mm[:, 2].min() <= 0.0:
            return None
        around = around.grow(_MARGIN_PX)
        box = around.clip(self._geometry.width, self._geometry.height)
        is_near = around.width * around.height > _MOST_PICTURES * box.width * box.height
        if box.is_empty or is_near:
            return None
        others = [one for one in made if one is not planned]
        rest = self._rest(self._bone, tuple(made))
        both = render_rectified(join_meshes(rest, face), rectified_from_bone, self._geometry, box)
        alone = render_rectified(face, rectified_from_bone, self._geometry, around)
        is_kept = self._is_kept(alone.depth_mm, around, others, rectified_from_bone)
        is_seen = (both.face_index >= len(rest.faces)) & is_kept[box.relative_to(around).slices]
        is_face, n_whole = _erode(is_seen), int(np.count_nonzero(_erode(alone.mask & is_kept)))
        if np.count_nonzero(is_face) < _LEAST_PIXELS:
            return None
        depths_mm = float(corners_mm[:, 2].min()), float(corners_mm[:, 2].max())
        return _View(box, is_face, n_whole, depths_mm)

    def _is_kept(
        self,
        depth_mm: NDArray[np.float32],
        box: Box,
        others: Sequence[ResectionPlane],
        rectified_from_bone: RigidTransform,
    ) -> NDArray[np.bool_]:
        """(h, w) whether the bone is still there after the other cuts, at those depths."""
        rows, columns = np.nonzero(np.isfinite(depth_mm))
        z = depth_mm[rows, columns].astype(np.float64)
        x = (columns + box.x - self._geometry.centre_x_px) * z / self._geometry.focal_px
        y = (rows + box.y - self._geometry.centre_y_px) * z / self._geometry.focal_px
        points_mm = rectified_from_bone.inverse().apply(np.column_stack([x, y, z]))
        is_gone = np.zeros(len(points_mm), dtype=np.bool_)
        for plane in others:
            is_gone |= (plane.heights_mm(points_mm) > -_BESIDE_MM) & plane.is_over(points_mm)
        is_kept = np.zeros(depth_mm.shape, dtype=np.bool_)
        is_kept[rows, columns] = ~is_gone
        return is_kept

    def _rectify(self, left: Image, right: Image, view: _View) -> RectifiedPair:
        band_px = self._band_px(view)
        return self._rectifier.rectify(left, right, view.box, band_px, is_grey=True)

    def _band_px(self, view: _View) -> tuple[float, float]:
        """Smallest and largest disparity on the face, and around it."""
        near_mm, far_mm = view.depths_mm
        near_mm, far_mm = max(near_mm - _BAND_MM, 1.0), far_mm + _BAND_MM
        return self._geometry.disparity_px(far_mm), self._geometry.disparity_px(near_mm)

    def _places(self, pixels: NDArray[np.int64]) -> FloatArray:
        """(N, 3) of (u - c_x, v - c_y, 1)."""
        middle = np.array([self._geometry.centre_x_px, self._geometry.centre_y_px])
        return np.column_stack([pixels - middle, np.ones(len(pixels))])

    def _fit(
        self, pair: RectifiedPair, view: _View, coefficients: FloatArray, *, is_far: bool
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
        inside = view.is_face & ~_grow(_without_specks(view.is_face & ~self._is_on(found, fit)))
        return self._fit_pixels(found, inside, fit.coefficients, _NEAR_PX)

    def _reach_px(self, box: Box, coefficients: FloatArray) -> float:
        """How far a saw may have missed, in disparity: along the view at most."""
        middle = self._places(np.array([[box.x + box.width // 2, box.y + box.height // 2]]))
        depth_mm = self._geometry.depth_mm(float(middle[0] @ coefficients))
        nearer_px = self._geometry.disparity_px(depth_mm - _MOST_OFF_MM)
        return nearer_px - self._geometry.disparity_px(depth_mm)

    def _fit_pixels(
        self,
        found: DisparityMap,
        mask: NDArray[np.bool_],
        start: FloatArray,
        reach_px: float,
    ) -> DisparityPlane | None:
        rows, columns = np.nonzero(mask & (found.origin == Origin.MATCHED))
        thin = (rows % _STRIDE_PX == 0) & (columns % _STRIDE_PX == 0)
        rows, columns = rows[thin], columns[thin]
        if len(rows) * _STRIDE_PX**2 < _LEAST_PIXELS:
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

    def _refine(self, pair: RectifiedPair, view: _View, coefficients: FloatArray) -> DisparityMap:
        support_px = self._support_px(view.box, coefficients)
        return refine_on_model(pair, np.where(_grow(view.is_face), support_px, np.float32(np.nan)))

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

    def _moved_px(self, change: FloatArray, view: _View) -> float:
        """Largest change of disparity over the face."""
        rows, columns = np.nonzero(view.is_face)
        pixels = np.column_stack([columns + view.box.x, rows + view.box.y])
        return float(np.abs(self._places(pixels) @ change).max(initial=0.0))

    def _face(
        self,
        fit: DisparityPlane,
        estimate: PoseEstimate,
        planned: ResectionPlane,
        seen_share: float,
    ) -> MeasuredFace:
        """With the covariances that matching and pose leave, by differences."""
        left_from_bone = estimate.camera_from_bone
        centre_mm = left_from_bone.apply(self._centre_mm[None])[0]
        turn = self._geometry.rectified_from_left.inverse().rotation

        def describe(coefficients: FloatArray, pose: RigidTransform) -> FloatArray:
            normal, distance_mm = plane_in_camera(coefficients, self._geometry)
            return _tilts_offset(turn @ normal, distance_mm, pose, planned)

        value = describe(fit.coefficients, left_from_bone)
        deviation = np.sqrt(np.diag(fit.covariance))
        by_fit = np.stack(
            [
                (describe(fit.coefficients + d * axis, left_from_bone) - value) / d
                for d, axis in zip(0.1 * deviation, np.eye(3), strict=True)
            ],
            axis=1,
        )
        steps = np.array([1e-3] * 3 + [1e-5] * 3)
        by_pose = np.stack(
            [
                (describe(fit.coefficients, left_from_bone.move(d * axis, centre_mm)) - value) / d
                for d, axis in zip(steps, np.eye(6), strict=True)
            ],
            axis=1,
        )
        common = np.diag(self._common_sd(left_from_bone) ** 2)
        return MeasuredFace(
            planned,
            value,
            by_fit @ fit.covariance @ by_fit.T,
            by_pose @ estimate.covariance @ by_pose.T + common,
            seen_share,
        )

    def _common_sd(self, left_from_bone: RigidTransform) -> FloatArray:
        """(3,) of tilts and offset: what the plan's surface and the rig add to any pose's error."""
        bone = self._bone
        depth_mm = float(left_from_bone.apply(self._centre_mm[None])[0, 2])
        cartilage_mm = float(np.sqrt(np.mean(bone.cartilage_sd_mm**2)))
        rig_mm = 0.0 if self._quality is None else self._quality.error_mm(depth_mm)
        sd_mm = np.sqrt(cartilage_mm**2 + bone.surface_sd_mm**2 + (0.5 * rig_mm) ** 2)
        return np.array([sd_mm / _LEVER_MM, sd_mm / _LEVER_MM, sd_mm])


def _tilts_offset(
    normal: FloatArray, distance_mm: float, left_from_bone: RigidTransform, planned: ResectionPlane
) -> FloatArray:
    """(3,) as of `MeasuredFace`, of the plane N . X = distance in the left camera."""
    in_bone = left_from_bone.inverse().rotate(normal[None])[0]
    tilts = planned.axes @ in_bone / float(in_bone @ planned.normal)
    offset_mm = distance_mm - float(normal @ left_from_bone.apply(planned.point_mm[None])[0])
    return np.array([*tilts, offset_mm])


def _is_of_plan(face: MeasuredFace) -> bool:
    is_near = abs(face.offset_mm) <= _MOST_OFF_MM
    return is_near and face.angle_deg <= _MOST_TILT_DEG


def _make_rest(bone: BoneModel, made: tuple[ResectionPlane, ...]) -> TriangleMesh:
    """What is left of a bone, to hide what lies behind it."""
    left = remove_cuts(bone, [Cut(plane, 0.0) for plane in made])
    is_left = ~left.is_removed[bone.mesh.faces].any(axis=1)
    return drawn(TriangleMesh(bone.mesh.vertices_mm, bone.mesh.faces[is_left], bone.mesh.normals))


def _erode(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    import cv2

    size = 2 * _RIM_PX + 1
    inner = cv2.erode(mask.astype(np.uint8), np.ones((size, size), np.uint8), borderValue=0)
    return np.asarray(inner > 0)


def _without_specks(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    import cv2

    square = np.ones((3, 3), np.uint8)
    return np.asarray(cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_OPEN, square) > 0)


def _grow(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    import cv2

    size = 2 * _RIM_PX + 1
    return np.asarray(cv2.dilate(mask.astype(np.uint8), np.ones((size, size), np.uint8)) > 0)
