"""The joint's gap on either side: the shortest distance between what is left of the two bones.

Surfaces that overlap have a gap below 0: as far as one reaches into the other.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import FloatArray
from navapp.values import PoseEstimate, Side
from navapp.values.faces import SIZE_95

# Both chosen. Wider gaps are not looked for; points of a surface are no further apart.
_WIDEST_MM, _SPACING_MM = 40.0, 1.2
_REACH_MM = 3.0 * _SPACING_MM  # surfaces that cross have points so near to each other
_SOME = 50  # one point of so many tells roughly how wide a gap is
# A point is inside when it lies straight below its nearest one (cosine): beside a rim it does not.
_BELOW = -0.5


@dataclass(frozen=True, slots=True)
class Gap:
    """A distance, and its 95 % bound by the two poses and the faces of cuts."""

    mm: float  # below 0 where the surfaces overlap
    bound_mm: float


class GapMeter:
    """Measures the gaps between two bones as they are now: whole, or what cuts have left.

    Args:
        femur: its surface.
        tibia: its surface.
        middle_x_mm: of the plan's x, parts the two sides of the femur.
        side: of the patient.
    """

    def __init__(
        self, femur: TriangleMesh, tibia: TriangleMesh, middle_x_mm: float, side: Side
    ) -> None:
        self._tibia_mm, self._normals = cover_with_points(tibia)
        self._tree = cKDTree(self._tibia_mm)
        points_mm, _ = cover_with_points(femur)
        is_left = points_mm[:, 0] > middle_x_mm
        is_medial = is_left if side == "right" else ~is_left
        self._sides = {"medial": points_mm[is_medial], "lateral": points_mm[~is_medial]}

    def measure(
        self,
        femur: PoseEstimate,
        tibia: PoseEstimate,
        centres_mm: tuple[FloatArray, FloatArray],
        surface_sd_mm: float = 0.0,
    ) -> dict[str, Gap]:
        """`medial` and `lateral`, of two poses of one pair of pictures; without wider ones.

        Args:
            femur: its pose.
            tibia: its pose.
            centres_mm: (3,) of each, about which the covariances are, in their own coordinates.
            surface_sd_mm: of the two surfaces themselves.
        """
        gaps = {}
        for name, points_mm in self._sides.items():
            gap = self._measure(points_mm, femur, tibia, centres_mm, surface_sd_mm)
            if gap is not None:
                gaps[name] = gap
        return gaps

    def _measure(
        self,
        points_mm: FloatArray,
        femur: PoseEstimate,
        tibia: PoseEstimate,
        centres_mm: tuple[FloatArray, FloatArray],
        surface_sd_mm: float,
    ) -> Gap | None:
        tibia_from_femur = tibia.camera_from_bone.inverse() @ femur.camera_from_bone
        placed_mm = tibia_from_femur.apply(points_mm)
        # Some points bound the distance of all; what lies further is not looked for.
        some_mm = np.asarray(self._tree.query(placed_mm[::_SOME])[0])
        widest_mm = max(float(some_mm.min(initial=np.inf)) + 1e-6, _REACH_MM)
        widest_mm = min(widest_mm, _WIDEST_MM)
        heights_mm, nearest = self._find_heights(placed_mm, widest_mm)
        if heights_mm.min(initial=np.inf) < 0.0:  # what lies deepest is further from any surface
            heights_mm, nearest = self._find_heights(placed_mm, _WIDEST_MM)
        if not np.isfinite(heights_mm.min(initial=np.inf)):
            return None
        k = int(np.argmin(heights_mm))
        gap_mm = float(heights_mm[k])
        ends_mm = points_mm[k], self._tibia_mm[int(nearest[k])]
        on_femur_mm = femur.camera_from_bone.apply(ends_mm[0])
        apart_mm = on_femur_mm - tibia.camera_from_bone.apply(ends_mm[1])
        direction = apart_mm / max(float(np.linalg.norm(apart_mm)), 1e-9)
        variance = sum(
            float(direction @ one.predict_covariances(centre_mm, end_mm[None])[0] @ direction)
            for one, centre_mm, end_mm in zip((femur, tibia), centres_mm, ends_mm, strict=True)
        )
        return Gap(gap_mm, SIZE_95 * float(np.sqrt(variance + surface_sd_mm**2)))

    def _find_heights(
        self, placed_mm: FloatArray, widest_mm: float
    ) -> tuple[FloatArray, NDArray[np.intp]]:
        """(N,) distances of the femur's points (N, 3) from the tibia, below 0 inside of it.

        Infinite beyond `widest_mm`. And which of the tibia's points (N,) is the nearest one.
        """
        found = self._tree.query(placed_mm, distance_upper_bound=widest_mm)
        heights_mm, nearest = (np.asarray(one) for one in found)
        near = np.flatnonzero(np.isfinite(heights_mm))
        away_mm = placed_mm[near] - self._tibia_mm[nearest[near]]
        above_mm = np.einsum("nk,nk->n", away_mm, self._normals[nearest[near]])
        is_inside = above_mm < _BELOW * heights_mm[near]
        heights_mm[near[is_inside]] = above_mm[is_inside]
        return heights_mm, nearest


def cover_with_points(mesh: TriangleMesh) -> tuple[FloatArray, FloatArray]:
    """Points (N, 3) of a mesh and their outward normals (N, 3).

    They are corners of its triangles and points between them, at most about `_SPACING_MM` apart:
    faces of cuts have few corners.
    """
    corners_mm = mesh.vertices_mm[mesh.faces]
    edges_mm = np.linalg.norm(corners_mm - np.roll(corners_mm, 1, axis=1), axis=2)
    n_steps = np.maximum(np.ceil(edges_mm.max(axis=1, initial=0.0) / _SPACING_MM).astype(int), 1)
    used = np.unique(mesh.faces)
    points_mm, normals = [mesh.vertices_mm[used]], [mesh.normals[used]]
    for n in np.unique(n_steps[n_steps > 1]):
        first, second = np.mgrid[0 : n + 1, 0 : n + 1].reshape(2, -1)
        shares = np.stack([first, second, n - first - second], axis=1) / n
        inner = shares[(shares >= 0.0).all(axis=1) & (shares < 1.0).all(axis=1)]
        fine = np.flatnonzero(n_steps == n)
        points_mm.append(np.einsum("ks,tsd->tkd", inner, corners_mm[fine]).reshape(-1, 3))
        normals.append(np.repeat(mesh.normals[mesh.faces[fine, 0]], len(inner), axis=0))
    return np.concatenate(points_mm), np.concatenate(normals)
