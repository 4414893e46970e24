"""Measures the mouths of drilled holes, in pairs of pictures in which the bone's pose is known.

A hole is dark, and its rim lies on the bone's surface, which the model gives: so the rim is looked
for on that surface, along rays from the middle of the mouth, in both pictures.
"""

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.camera import Camera
from navapp.geometry.rectification import Image
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.resection.face_errors import find_common_sd_mm
from navapp.values import BoneModel, DrillAxis, PoseEstimate
from navapp.values.holes import MeasuredHole

# All chosen. A drill misses its plan by no more; a hole is as wide as its drill within so much.
MOST_OFF_MM, _MOST_WIDER = 4.0, 0.25
_GRID_MM, _STEP_MM = 0.3, 0.1
_N_RAYS, _ROUNDS, _STEPS = 72, 5, 8
# Of the rim's brightness over the hole's; noise alone shows no such step.
_LEAST_CONTRAST = 0.25
# Width of the kernel of the fit, and how far neighbouring rays go together.
_KERNEL_MM, _SHARING_RAYS = 0.25, 4.0
# What shading and blood may move all of a rim by.
_COMMON_SD_MM = 0.08
_EDGE_MM = 1.0
_PATCH_MM, _LEAST_COSINE = 16.0, 0.3


class HoleMeter:
    """Measures the holes of one bone under one rig."""

    def __init__(self, rig: StereoRig, bone: BoneModel) -> None:
        self._rig, self._bone = rig, bone
        self._patches: dict[DrillAxis, _Patch | None] = {}

    def measure(
        self, left: Image, right: Image, estimate: PoseEstimate, planned: DrillAxis
    ) -> MeasuredHole | None:
        """One hole, against its plan.

        Args:
            left: picture of the left camera.
            right: of the right one, at the same instant.
            estimate: of the bone's pose in the left camera.
            planned: the hole.

        Returns:
            None where no dark mouth as wide as the drill is seen within 4 mm of the plan.
        """
        if planned not in self._patches:
            self._patches[planned] = _Patch.around(self._bone, planned)
        patch = self._patches[planned]
        if patch is None:
            return None
        eyes = [
            _Eye(picture, camera, seen_from @ estimate.camera_from_bone)
            for picture, camera, seen_from in (
                (left, self._rig.left, RigidTransform.identity("left", "left")),
                (right, self._rig.right, self._rig.right_from_left),
            )
        ]
        disc = _find_dark_disc(eyes, patch, planned)
        if disc is None:
            return None
        fit = _fit_circle(eyes, patch, planned, *disc)
        if fit is None:
            return None
        circle, covariance, share = fit
        entry_mm = patch.place(circle[None, :2])[0]
        return MeasuredHole(
            planned,
            entry_mm,
            circle[:2],
            2.0 * float(circle[2]),
            covariance,
            self._common_covariance(estimate, planned, entry_mm),
            share,
        )

    def _common_covariance(
        self, estimate: PoseEstimate, planned: DrillAxis, entry_mm: FloatArray
    ) -> FloatArray:
        """(3, 3) of offset and diameter by what pictures may share: pose, plan, rig, shading."""
        pose, bone = estimate.camera_from_bone, self._bone
        centre_mm = pose.apply(bone.mesh.centroid_mm[None])[0]
        seen_mm = pose.apply(entry_mm[None])[0]
        across = planned.axes @ pose.rotation.T
        jacobian = np.hstack([across, np.cross(seen_mm - centre_mm, across)])
        common_mm = find_common_sd_mm(pose, bone, self._rig.quality)
        covariance = _COMMON_SD_MM**2 * np.diag([1.0, 1.0, 4.0])
        covariance[:2, :2] += jacobian @ estimate.covariance @ jacobian.T + common_mm**2 * np.eye(2)
        return covariance


class _Patch:
    """The bone's surface around a planned entry, as heights over the plane across the hole."""

    def __init__(self, planned: DrillAxis, flat_mm: FloatArray, along_mm: FloatArray) -> None:
        from scipy.interpolate import LinearNDInterpolator

        self._planned = planned
        self._along = LinearNDInterpolator(flat_mm, along_mm)

    @classmethod
    def around(cls, bone: BoneModel, planned: DrillAxis) -> "_Patch | None":
        """None where the plan's entry lies on no surface."""
        offset = bone.mesh.vertices_mm - planned.entry_mm
        flat_mm, along_mm = offset @ planned.axes.T, offset @ planned.direction
        faces_drill = -(bone.mesh.normals @ planned.direction) > _LEAST_COSINE
        is_near = (np.abs(flat_mm).max(axis=1) < _PATCH_MM) & (np.abs(along_mm) < _PATCH_MM)
        here = is_near & faces_drill
        if np.count_nonzero(here) < 12:
            return None
        return cls(planned, flat_mm[here], along_mm[here])

    def place(self, flat_mm: FloatArray) -> FloatArray:
        """(N, 3) points of the surface, bone coordinates, of places (N, 2) across the hole."""
        along_mm = self._along(flat_mm)
        points: FloatArray = (
            self._planned.entry_mm
            + flat_mm @ self._planned.axes
            + along_mm[:, None] * self._planned.direction
        )
        return points


class _Eye:
    """One picture, asked for its brightness at points of the bone."""

    def __init__(self, picture: Image, camera: Camera, camera_from_bone: RigidTransform) -> None:
        self._picture = picture if picture.ndim == 2 else picture[..., 1]
        self._camera, self._pose = camera, camera_from_bone

    def look(self, points_mm: FloatArray) -> NDArray[np.float32]:
        """(N,) brightness; NaN beside the picture."""
        import cv2

        pixels = np.full((len(points_mm), 2), np.nan)
        known = np.isfinite(points_mm).all(axis=1)
        pixels[known] = self._camera.project(self._pose.apply(points_mm[known]))
        columns, rows = (one.astype(np.float32)[None] for one in pixels.T)
        height, width = self._picture.shape
        inside = (columns >= 0) & (columns <= width - 1) & (rows >= 0) & (rows <= height - 1)
        values = cv2.remap(self._picture.astype(np.float32), columns, rows, cv2.INTER_LINEAR)
        seen: NDArray[np.float32] = np.where(inside, values, np.float32(np.nan))[0]
        return seen


def _find_dark_disc(
    eyes: list[_Eye], patch: _Patch, planned: DrillAxis
) -> tuple[FloatArray, float] | None:
    """(2,) middle of the darkest disc as wide as the drill, and how light bone is around it."""
    import cv2

    radius_mm = 0.5 * planned.diameter_mm
    reach_mm = MOST_OFF_MM + 1.6 * radius_mm
    line = np.arange(-reach_mm, reach_mm, _GRID_MM)
    flat_mm = np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2)
    points_mm = patch.place(flat_mm)
    seen = np.mean([eye.look(points_mm) for eye in eyes], axis=0).reshape(len(line), len(line))
    is_known = np.isfinite(seen)
    if is_known.mean() < 0.6:
        return None
    seen = np.where(is_known, seen, np.nanmedian(seen)).astype(np.float32)
    cells = int(np.ceil(1.6 * radius_mm / _GRID_MM))
    distance = np.hypot(*np.mgrid[-cells : cells + 1, -cells : cells + 1]) * _GRID_MM
    away = distance / radius_mm
    disc, ring = away < 0.85, (away > 1.1) & (away < 1.6)
    dark, light = (
        cv2.filter2D(seen, cv2.CV_32F, (one / one.sum()).astype(np.float32)) for one in (disc, ring)
    )
    bone = float(np.percentile(seen[is_known], 75))
    contrast = (light - dark) / max(bone, 1.0)
    is_near = np.hypot(flat_mm[:, 0], flat_mm[:, 1]).reshape(seen.shape) <= MOST_OFF_MM
    best = int(np.argmax(np.where(is_near, contrast, -1.0)))
    if contrast.flat[best] < _LEAST_CONTRAST:
        return None
    return flat_mm[best], bone


def _fit_circle(
    eyes: list[_Eye], patch: _Patch, planned: DrillAxis, middle: FloatArray, bone: float
) -> tuple[FloatArray, FloatArray, float] | None:
    """(3,) middle and radius of the rim, (3, 3) covariance of middle and diameter, share seen.

    Weighted least squares under a kernel (Welsch's, as of `fit_disparity_plane`): a drill, blood
    and highlights do not count.
    """
    radius_mm = 0.5 * planned.diameter_mm
    circle = np.array([*middle, radius_mm])
    angles = 2.0 * np.pi * np.arange(_N_RAYS) / _N_RAYS
    rays = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    rows = np.concatenate([np.column_stack([rays, np.ones(_N_RAYS)])] * len(eyes))
    for _ in range(_ROUNDS):
        rims_mm = [
            _find_rim(eye, patch, circle, rays, radius_mm, _LEAST_CONTRAST * bone) for eye in eyes
        ]
        residual_mm = np.concatenate(rims_mm) - circle[2]
        known = np.isfinite(residual_mm)
        if np.count_nonzero(known) < _N_RAYS // 2:
            return None
        step, normal, misfit_mm = _solve(rows[known], residual_mm[known])
        circle = circle + step
        if np.hypot(*circle[:2]) > MOST_OFF_MM:
            return None
    if abs(circle[2] / radius_mm - 1.0) > _MOST_WIDER:
        return None
    share = float(np.count_nonzero(np.abs(misfit_mm) < 2.0 * _KERNEL_MM) / len(rows))
    weight = _weigh(misfit_mm)
    variance = float((weight * misfit_mm**2).sum() / weight.sum())
    covariance = _SHARING_RAYS * variance * np.linalg.inv(normal)
    to_diameter = np.diag([1.0, 1.0, 2.0])
    return circle, to_diameter @ covariance @ to_diameter, share


def _solve(rows: FloatArray, residual_mm: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(3,) step, (3, 3) its normal matrix and (N,) what is left of the residuals."""
    step = np.zeros(3)
    for _ in range(_STEPS):
        weighted = rows.T * _weigh(residual_mm - rows @ step)
        normal = weighted @ rows
        step = np.asarray(np.linalg.solve(normal, weighted @ residual_mm), dtype=np.float64)
    return step, normal, residual_mm - rows @ step


def _weigh(misfit_mm: FloatArray) -> FloatArray:
    weight: FloatArray = np.exp(-0.5 * (misfit_mm / _KERNEL_MM) ** 2)
    return weight


def _find_rim(
    eye: _Eye,
    patch: _Patch,
    circle: FloatArray,
    rays: FloatArray,
    radius_mm: float,
    least: float,
) -> FloatArray:
    """(N,) mm from the circle's middle where brightness rises most along each ray; NaN: nowhere."""
    away_mm: FloatArray = np.arange(0.55 * radius_mm, 1.5 * radius_mm, _STEP_MM)
    flat_mm = circle[:2] + away_mm[None, :, None] * rays[:, None]
    seen = np.asarray(eye.look(patch.place(flat_mm.reshape(-1, 2)))).reshape(len(rays), -1)
    kernel = np.exp(-0.5 * (np.arange(-6, 7) * _STEP_MM / 0.2) ** 2)
    smooth = np.apply_along_axis(np.convolve, 1, seen, kernel / kernel.sum(), mode="same")
    slope: FloatArray = np.asarray(np.gradient(smooth, _STEP_MM, axis=1))[:, 7:-7]
    slope = np.where(np.isfinite(slope), slope, -np.inf)
    best = np.clip(slope.argmax(axis=1), 1, slope.shape[1] - 2)
    row = np.arange(len(rays))
    before, at, after = slope[row, best - 1], slope[row, best], slope[row, best + 1]
    with np.errstate(invalid="ignore", divide="ignore"):
        shift = 0.5 * (before - after) / (before - 2.0 * at + after)
    # So much brighter within a millimetre.
    is_found = (at > least / _EDGE_MM) & (np.abs(shift) <= 1.0)
    found = away_mm[7 + best] + shift * _STEP_MM
    return np.where(is_found, found, np.nan)
