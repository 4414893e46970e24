"""Hypotheses of a bone's pose: views, rolls all around, and places on the measured surface."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.directions import ViewCone, make_view_rotation, turn_between, turn_towards
from navapp.geometry.rectification import RectifiedGeometry
from navapp.geometry.transform import FloatArray, RigidTransform, rotation_from_vector
from navapp.registration.model import RegistrationModel
from navapp.registration.scene import Scene
from navapp.registration.score_kernels import DepthMap, Hypotheses, scale_optics
from navapp.values import AspectGraph

# All chosen. Between views, where no aspects say; points of each view's surface.
_VIEW_STEP_DEG, _N_SURFACE_POINTS = 8.0, 40
# Surface that is seen at a flatter angle is rarely measured.
_LEAST_COSINE = 0.35
# Anchors lie at most so far behind the point that is nearest to the camera.
_FRONT_MM = 25.0
# Cost of an anchor's distance from the middle of the view, mm per mm^2.
_OFF_MIDDLE_COST = 0.02


class Views(NamedTuple):
    """A bone from V sides."""

    directions: FloatArray  # (V, 3) unit, towards the camera
    surface_mm: FloatArray  # (V, n, 3) points of the surface that each view shows
    anchors_mm: FloatArray  # (V, 2, 3) points that are likely to be measured
    aspects: AspectGraph | None  # of the same views, where their edges are known


def make_views(model: RegistrationModel, cone: ViewCone, aspects: AspectGraph | None) -> Views:
    """What a model shows to the views of its aspects, or without aspects to those of a cone."""
    directions = cone.directions(_VIEW_STEP_DEG) if aspects is None else aspects.directions
    rng = np.random.default_rng(len(directions))
    can_pair = model.arrays.can_pair
    surface, anchors = [], []
    for direction in directions:
        shown = np.flatnonzero(can_pair & (model.normals @ direction > _LEAST_COSINE))
        # A flat surface seen edge-on shows none: then all.
        shown = shown if len(shown) else np.arange(len(model.points_mm))
        surface.append(model.points_mm[rng.choice(shown, _N_SURFACE_POINTS)])
        anchors.append(_find_anchors(model.points_mm[shown], direction))
    return Views(directions, np.array(surface), np.array(anchors), aspects)


def _find_anchors(shown_mm: FloatArray, direction: FloatArray) -> FloatArray:
    """(2, 3) points in front of what a view shows: the foremost near the middle, one beside it.

    Tissue hides a bone from behind and from the sides, so that its front is what lies open.
    """
    towards = shown_mm @ direction
    off = shown_mm - np.median(shown_mm, axis=0)
    first = int(np.argmax(towards - _OFF_MIDDLE_COST * np.einsum("ij,ij->i", off, off)))
    front = shown_mm[towards > towards[first] - _FRONT_MM]
    distance = np.linalg.norm(front - shown_mm[first], axis=1)
    second = int(np.argmin(np.abs(distance - 0.5 * distance.max())))
    return np.stack([shown_mm[first], front[second]])


def thin_views(views: Views, step_deg: float) -> NDArray[np.intp]:
    """Indices of views about that far apart."""
    nearest = np.cos(np.radians(0.75 * step_deg))
    kept: list[int] = []
    for k, direction in enumerate(views.directions):
        if not kept or (views.directions[kept] @ direction).max() < nearest:
            kept.append(k)
    return np.array(kept, dtype=np.intp)


def sample_scene(
    scene: Scene, geometry: RectifiedGeometry, cell_px: int, most: int
) -> tuple[DepthMap, FloatArray]:
    """The median depth of each cell of a picture, and about `most` places (C, 3) mm on it, evenly.

    The scene's points are in the rectified left camera.
    """
    height, width = -(-geometry.height // cell_px), -(-geometry.width // cell_px)
    column, row = np.floor((geometry.project(scene.points_mm) + 0.5) / cell_px).T
    inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
    cell = (row[inside] * width + column[inside]).astype(np.int64)
    z_mm = scene.points_mm[inside, 2]
    order = np.lexsort((z_mm, cell))
    cell, z_mm = cell[order], z_mm[order]
    first = np.flatnonzero(np.diff(cell, prepend=-1))
    middle = (first + np.append(first[1:], len(cell))) // 2
    depth_mm = np.zeros((height, width), dtype=np.float32)
    depth_mm.flat[cell[first]] = z_mm[middle]

    every = max(1, round((len(first) / max(most, 1)) ** 0.5))
    rows, columns = np.nonzero(depth_mm[every // 2 :: every, every // 2 :: every])
    rows, columns = every // 2 + every * rows, every // 2 + every * columns
    z = depth_mm[rows, columns].astype(np.float64)
    u, v = (columns + 0.5) * cell_px - 0.5, (rows + 0.5) * cell_px - 0.5
    x = (u - geometry.centre_x_px) / geometry.focal_px * z
    y = (v - geometry.centre_y_px) / geometry.focal_px * z
    return DepthMap(depth_mm, scale_optics(geometry, cell_px)), np.column_stack([x, y, z])


def spread_hypotheses(
    views: Views, chosen: NDArray[np.intp], roll_step_deg: float, places_mm: FloatArray
) -> Hypotheses:
    """Chosen views x anchors x rolls all around x places (C, 3)."""
    rolls = np.radians(np.arange(0.0, 360.0, roll_step_deg))
    turns = np.array([rotation_from_vector((0.0, 0.0, roll)) for roll in rolls])
    upright = np.array([make_view_rotation(views.directions[view]) for view in chosen])
    rotations = np.einsum("rij,vjk->vrik", turns, upright)
    n_anchors = views.anchors_mm.shape[1]
    n_orientations = len(chosen) * n_anchors * len(rolls)
    return Hypotheses(
        np.repeat(np.arange(n_orientations, dtype=np.int32), len(places_mm)),
        np.tile(np.arange(len(places_mm), dtype=np.int32), n_orientations),
        np.repeat(chosen, n_anchors * len(rolls)).astype(np.int32),
        np.repeat(rotations[:, None], n_anchors, axis=1).reshape(-1, 3, 3),
        np.repeat(views.anchors_mm[chosen].reshape(-1, 3), len(rolls), axis=0),
        turn_towards(places_mm),
        places_mm,
    )


def place_hypothesis(
    directions: FloatArray, pose: RigidTransform, anchor_mm: FloatArray
) -> Hypotheses:
    """The one hypothesis of a pose (camera from bone), with the nearest of views (V, 3).

    `anchor_mm` (3,) is the point of the bone that stays in place when the hypothesis is varied.
    """
    position_mm = pose.apply(anchor_mm)
    towards_camera = -pose.rotation.T @ position_mm
    turn = turn_towards(position_mm[None])
    return Hypotheses(
        np.zeros(1, dtype=np.int32),
        np.zeros(1, dtype=np.int32),
        np.array([np.argmax(directions @ towards_camera)], dtype=np.int32),
        turn.transpose(0, 2, 1) @ pose.rotation,
        anchor_mm[None],
        turn,
        position_mm[None],
    )


def keep_best(some: Hypotheses, score: NDArray[np.float32], n: int) -> Hypotheses:
    """The n hypotheses of the largest scores (H,), largest first; ties in their order."""
    kept = np.arange(len(score))
    if n < len(score):
        kept = np.flatnonzero(score >= np.partition(score, -n)[-n])
    kept = kept[np.argsort(-score[kept], kind="stable")][:n]
    return some._replace(orientation=some.orientation[kept], place=some.place[kept])


def vary_hypotheses(
    some: Hypotheses, directions: FloatArray, step_deg: float, roll_deg: float, shift_mm: float
) -> Hypotheses:
    """Each hypothesis with its neighbours: views within a step, rolls and places beside it.

    The views' directions (V, 3) are those that the hypotheses index.
    """
    rolls = np.radians([-roll_deg, 0.0, roll_deg])
    turns = np.array([rotation_from_vector((0.0, 0.0, roll)) for roll in rolls])
    sides_mm = shift_mm * np.array([(0, 0, 0), (1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0)])
    # Which hypothesis is varied, and the view that it has then.
    here = directions[some.view_index[some.orientation]]
    varied, view = np.nonzero(here @ directions.T >= np.cos(np.radians(step_deg)))
    tilts = [turn_between(directions[k], here[h]) for h, k in zip(varied, view, strict=True)]
    tilted = some.rotation[some.orientation[varied]] @ np.array(tilts).reshape(-1, 3, 3)
    varied, view = np.repeat(varied, len(turns)), np.repeat(view, len(turns))
    places = len(sides_mm) * varied[:, None] + np.arange(len(sides_mm))
    positions_mm = (some.position_mm[some.place][:, None] + sides_mm).reshape(-1, 3)
    return Hypotheses(
        np.repeat(np.arange(len(varied), dtype=np.int32), len(sides_mm)),
        places.ravel().astype(np.int32),
        view.astype(np.int32),
        (turns @ tilted[:, None]).reshape(-1, 3, 3),
        some.anchor_mm[some.orientation[varied]],
        turn_towards(positions_mm),
        positions_mm,
    )


def compute_poses(some: Hypotheses) -> tuple[FloatArray, FloatArray]:
    """(H, 3, 3) rotations and (H, 3) translations in mm, camera from bone."""
    rotations = some.towards[some.place] @ some.rotation[some.orientation]
    anchored = np.einsum("hij,hj->hi", rotations, some.anchor_mm[some.orientation])
    return rotations, some.position_mm[some.place] - anchored
