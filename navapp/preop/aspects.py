"""The aspect graph: a bone's outlines and creases from every side that a camera may stand on.

Source: the paper, "aspect graph" of its preoperative part; equation 3 is what it is made for.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from navapp.errors import PlanError
from navapp.geometry.bands import run_both
from navapp.geometry.camera import Camera
from navapp.geometry.directions import ViewCone, make_view_rotation
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.geometry.zbuffer import render
from navapp.preop.aspects_kernels import find_contour_segments, select_spread
from navapp.preop.bone_edges import Crease, find_creases, find_near_ends
from navapp.values import AspectGraph, BoneModel

# Two views of which so much agrees are one: pairs of edges as near and as parallel as this.
_SAME_FRACTION, _SAME_MM, _SAME_COSINE = 0.95, 1.5, 0.966
# A point so far behind what is seen around it is hidden.
_HIDDEN_MM = 1.5
_CREASE_FRACTION = 0.35
_CREASE_COSINE = 0.3
_MARGIN_MM = 6.0


@dataclass(frozen=True, slots=True)
class AspectSettings:
    """How finely a bone is looked at."""

    step_deg: float = 8.0  # angle between neighbouring views
    distance_mm: float = 450.0  # of the camera from the bone's middle
    n_points: int = 220  # of a view, at most
    pixel_mm: float = 1.0  # of the picture that tells what is hidden


def build_aspects(
    bone: BoneModel,
    axis: ArrayLike | None = None,
    half_angle_deg: float = 180.0,
    settings: AspectSettings | None = None,
    on_progress: Callable[[float], None] = lambda share: None,
) -> AspectGraph:
    """Look at a bone from every direction of a cone, and keep the edges.

    Where the model ends (open borders, caps of a cut shaft) or a stage has cut there is no edge.

    Args:
        bone: what is looked at.
        axis: (3,) from the bone towards the cameras, in bone coordinates; None for all around.
        half_angle_deg: of the cone.
        settings: how finely.
        on_progress: told the share done; what it raises stops the work.
    """
    settings = settings or AspectSettings()
    cone = ViewCone(None if axis is None else np.asarray(axis, dtype=np.float64), half_angle_deg)
    directions = cone.directions(settings.step_deg)
    look = _AspectView(bone, settings)
    views: list[tuple[FloatArray, FloatArray] | None] = [None] * len(directions)

    def run(first: int) -> None:
        for number in range(first, len(directions), 2):
            if first == 0:
                on_progress(number / len(directions))
            views[number] = look.at(directions[number])

    run_both(lambda: run(0), lambda: run(1))
    kept = _select_distinct(directions, [view for view in views if view is not None], settings)
    on_progress(1.0)
    seen = [view for view in (views[k] for k in kept) if view is not None]
    if not seen:
        raise PlanError(
            f"no edge of the {bone.name} can be seen: its surface is all cut ends",
            subject=bone.name,
            remedy="give a surface of the whole bone end",
        )
    sizes = [len(points_mm) for points_mm, _ in seen]
    return AspectGraph(
        bone.name,
        directions[kept],
        np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64),
        np.concatenate([points_mm for points_mm, _ in seen]),
        np.concatenate([tangents for _, tangents in seen]),
    )


class _AspectView:
    """One bone, looked at from anywhere."""

    def __init__(self, bone: BoneModel, settings: AspectSettings) -> None:
        self._mesh = bone.make_seen_surface()
        surface_mm = self._mesh.vertices_mm
        self._settings = settings
        self._middle_mm = 0.5 * (surface_mm.min(axis=0) + surface_mm.max(axis=0))
        is_anatomy = ~find_near_ends(self._mesh)
        self._faces = np.ascontiguousarray(
            self._mesh.faces[is_anatomy[self._mesh.faces].all(axis=1)]
        )
        self._creases: Crease = find_creases(self._mesh, is_anatomy)
        radius_mm = float(np.linalg.norm(surface_mm - self._middle_mm, axis=1).max())
        near_mm = max(settings.distance_mm - radius_mm, 0.3 * settings.distance_mm)
        focal_px = settings.distance_mm / settings.pixel_mm
        half_px = int(np.ceil((radius_mm + _MARGIN_MM) / near_mm * focal_px))
        matrix = np.array([[focal_px, 0.0, half_px], [0.0, focal_px, half_px], [0.0, 0.0, 1.0]])
        self._camera = Camera(matrix, np.empty(0), 2 * half_px + 1, 2 * half_px + 1)

    def at(self, direction: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(n, 3) points of the edges seen from a direction, and their tangents."""
        rotation = make_view_rotation(direction)
        shift = np.array([0.0, 0.0, self._settings.distance_mm]) - rotation @ self._middle_mm
        pose = RigidTransform.from_parts("view", "bone", rotation, shift)
        camera_mm = pose.inverse().translation_mm
        rays = camera_mm - self._mesh.vertices_mm
        facing = np.einsum("ij,ij->i", self._mesh.normals, rays)
        depth = render(self._mesh, pose, self._camera).depth_mm
        middles, tangents = np.empty((2, len(self._faces), 3))
        vertices = np.array(self._mesh.vertices_mm)
        n = find_contour_segments(vertices, self._faces, facing, middles, tangents)
        outline = self._find_visible(middles[:n], pose, depth)
        crease = self._creases
        towards = camera_mm - crease.points_mm
        cosine = np.einsum("ij,ij->i", crease.normals, towards) / np.linalg.norm(towards, axis=1)
        turned = np.flatnonzero(cosine > _CREASE_COSINE)
        turned = turned[self._find_visible(crease.points_mm[turned], pose, depth)]
        most = self._settings.n_points
        n_creases = min(len(turned), int(_CREASE_FRACTION * most))
        chosen = _spread(middles[:n][outline], most - n_creases)
        also = _spread(crease.points_mm[turned], n_creases)
        points = np.concatenate([middles[:n][outline][chosen], crease.points_mm[turned][also]])
        along = np.concatenate([tangents[:n][outline][chosen], crease.tangents[turned][also]])
        order = _spread(points, len(points))
        return points[order], along[order]

    def _find_visible(
        self, points_mm: FloatArray, pose: RigidTransform, depth_mm: NDArray[np.float32]
    ) -> NDArray[np.bool_]:
        """(n,) whether something around each point is no nearer than the point itself."""
        import cv2

        # On a rim the surface beside a point is nearer on one side only.
        furthest_mm = cv2.dilate(np.nan_to_num(depth_mm, nan=1e9), np.ones((3, 3), np.uint8))
        moved = pose.apply(points_mm)
        pixels = np.floor(self._camera.project(moved) + 0.5).astype(int)
        height, width = depth_mm.shape
        inside = np.all((pixels >= 0) & (pixels < (width, height)), axis=1)
        column, row = np.where(inside[:, None], pixels, 0).T
        seen: NDArray[np.bool_] = inside & (moved[:, 2] <= furthest_mm[row, column] + _HIDDEN_MM)
        return seen


def _spread(points_mm: FloatArray, n: int) -> NDArray[np.int64]:
    """Indices of at most n points, spread evenly, coarse before fine."""
    if len(points_mm) == 0 or n == 0:
        return np.empty(0, dtype=np.int64)
    order = np.empty(min(n, len(points_mm)), dtype=np.int64)
    return order[: select_spread(np.ascontiguousarray(points_mm), order)]


def _select_distinct(
    directions: FloatArray, views: list[tuple[FloatArray, FloatArray]], settings: AspectSettings
) -> list[int]:
    """The views that are left when each repeats no neighbour that was kept before it."""
    from scipy.spatial import cKDTree

    near = np.cos(np.radians(1.5 * settings.step_deg))
    kept: list[int] = []
    trees: dict[int, cKDTree] = {}
    for k, (points_mm, tangents) in enumerate(views):
        if len(points_mm) == 0:
            continue
        is_new = True
        for other in kept:
            if directions[other] @ directions[k] < near:
                continue
            distance, index = trees[other].query(points_mm)
            parallel = np.abs(np.einsum("ij,ij->i", tangents, views[other][1][index]))
            agrees = np.asarray(distance < _SAME_MM) & (parallel > _SAME_COSINE)
            is_new &= float(agrees.mean()) < _SAME_FRACTION
        if is_new:
            kept.append(k)
            trees[k] = cKDTree(points_mm)
    return kept
