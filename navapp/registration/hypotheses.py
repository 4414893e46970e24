"""Poses to be tried when none is known: views, rolls, and places on the measured surface."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.directions import ViewCone, make_view_rotation, turn_between
from navapp.geometry.rectification import RectifiedGeometry
from navapp.geometry.transform import FloatArray, RigidTransform, rotation_from_vector
from navapp.registration.initial_kernels import Hypotheses
from navapp.registration.model import RegistrationModel
from navapp.registration.scene import Scene
from navapp.values import AspectGraph

# Surface that is seen at a flatter angle is rarely measured.
_LEAST_COSINE = 0.35
# Anchors are looked for so far behind the point that is nearest to the camera.
_FRONT_MM = 25.0
# A place off the middle of the view is the worse for it, per mm^2.
_OFF_MIDDLE = 0.02


@dataclass(frozen=True, slots=True, eq=False)
class Views:
    """A bone from many sides.

    Attributes:
        directions: (V, 3) unit, towards the camera.
        surface_mm: (V * n, 3) n points of the surface that each view shows.
        starts: (V + 1,) where each view's points begin.
        anchors_mm: (V, A, 3) points that are likely to be seen.
        edges: of the same views, where they are known.
    """

    directions: FloatArray
    surface_mm: FloatArray
    starts: NDArray[np.int64]
    anchors_mm: FloatArray
    edges: AspectGraph | None


def views_of(
    model: RegistrationModel,
    cone: ViewCone,
    step_deg: float,
    aspects: AspectGraph | None,
    n_points: int,
) -> Views:
    """What a model shows from everywhere in a cone.

    Args:
        model: prepared bone.
        cone: of the camera.
        step_deg: between views, where the aspects do not say.
        aspects: edges of the bone; their views are then taken, as far as they lie in the cone.
        n_points: of the surface, a view.
    """
    directions = cone.directions(step_deg)
    if aspects is not None:
        aspects = _inside(aspects, cone, 0.5 * step_deg)
        directions = np.asarray(aspects.directions)
    rng = np.random.default_rng(len(directions))
    can_pair = model.arrays.can_pair
    surface, anchors = [], []
    for direction in directions:
        shown = np.flatnonzero(can_pair & (model.normals @ direction > _LEAST_COSINE))
        # A flat thing from its edge: then whatever there is.
        shown = shown if len(shown) else np.arange(len(model.points_mm))
        surface.append(model.points_mm[rng.choice(shown, n_points)])
        anchors.append(_anchors(model.points_mm[shown], direction))
    return Views(
        directions,
        np.concatenate(surface),
        np.arange(len(directions) + 1, dtype=np.int64) * n_points,
        np.array(anchors),
        aspects,
    )


def places_of(
    scene: Scene, geometry: RectifiedGeometry, cell_px: int, most: int
) -> tuple[NDArray[np.float32], FloatArray]:
    """The measured surface as a coarse depth map, and places on it for hypotheses.

    Args:
        scene: points in the rectified left camera.
        geometry: of the pair.
        cell_px: size of the map's cells.
        most: about so many places are chosen, evenly.

    Returns:
        (h, w) float32 median depth of each cell, mm, 0 where nothing was measured; (C, 3) mm.
    """
    height, width = -(-geometry.height // cell_px), -(-geometry.width // cell_px)
    depth = np.zeros((height, width), dtype=np.float32)
    column, row = np.floor((geometry.project(scene.points_mm) + 0.5) / cell_px).T
    inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
    cell = (row[inside] * width + column[inside]).astype(np.int64)
    z_mm = scene.points_mm[inside, 2]
    order = np.lexsort((z_mm, cell))
    cell, z_mm = cell[order], z_mm[order]
    first = np.flatnonzero(np.diff(cell, prepend=-1))
    middle = (first + np.append(first[1:], len(cell))) // 2
    depth.flat[cell[first]] = z_mm[middle]
    every = max(1, round((len(first) / max(most, 1)) ** 0.5))
    thinned = np.zeros_like(depth)
    thinned[every // 2 :: every, every // 2 :: every] = depth[
        every // 2 :: every, every // 2 :: every
    ]
    rows, columns = np.nonzero(thinned)
    z = thinned[rows, columns].astype(np.float64)
    u, v = (columns + 0.5) * cell_px - 0.5, (rows + 0.5) * cell_px - 0.5
    x = (u - geometry.centre_x_px) / geometry.focal_px * z
    y = (v - geometry.centre_y_px) / geometry.focal_px * z
    return depth, np.column_stack([x, y, z])


def spread_hypotheses(
    views: Views, chosen: NDArray[np.intp], roll_step_deg: float, positions_mm: FloatArray
) -> Hypotheses:
    """Chosen views x anchors x rolls all around x places."""
    rolls = np.radians(np.arange(0.0, 360.0, roll_step_deg))
    turns = np.array([rotation_from_vector((0.0, 0.0, roll)) for roll in rolls])
    upright = np.array([make_view_rotation(views.directions[view]) for view in chosen]).reshape(
        -1, 3, 3
    )
    rotations = np.einsum("rij,vjk->vrik", turns, upright)
    n_anchors = views.anchors_mm.shape[1]
    shape = (len(chosen), n_anchors, len(rolls))
    n_orientations, n_places = int(np.prod(shape)), len(positions_mm)
    anchors = np.broadcast_to(views.anchors_mm[chosen][:, :, None], (*shape, 3))
    rotation = np.broadcast_to(rotations[:, None], (*shape, 3, 3))
    return Hypotheses(
        np.repeat(np.arange(n_orientations, dtype=np.int32), n_places),
        np.tile(np.arange(n_places, dtype=np.int32), n_orientations),
        np.repeat(chosen, n_anchors * len(rolls)).astype(np.int32),
        np.ascontiguousarray(rotation).reshape(-1, 3, 3),
        _towards(positions_mm),
        positions_mm,
        np.ascontiguousarray(anchors).reshape(-1, 3),
    )


def select_hypotheses(some: Hypotheses, which: NDArray[np.intp]) -> Hypotheses:
    """Some of the hypotheses, in that order."""
    return some._replace(orientation=some.orientation[which], place=some.place[which])


def vary_hypotheses(
    some: Hypotheses, views: Views, step_deg: float, roll_deg: float, shift_mm: float
) -> Hypotheses:
    """Each hypothesis with its neighbours: views within a step, rolls and places beside it."""
    orientation: list[int] = []
    place: list[int] = []
    aspect: list[int] = []
    anchor: list[FloatArray] = []
    rotation: list[FloatArray] = []
    position: list[FloatArray] = []
    turns = [rotation_from_vector((0.0, 0.0, np.radians(a))) for a in (-roll_deg, 0.0, roll_deg)]
    sides = shift_mm * np.array([(0, 0, 0), (1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0)])
    cosine = np.cos(np.radians(step_deg))
    for o, c in zip(some.orientation, some.place, strict=True):
        here = views.directions[some.aspect[o]]
        for view in np.flatnonzero(views.directions @ here >= cosine):
            tilted = some.rotation[o] @ turn_between(views.directions[view], here)
            for turn in turns:
                orientation += [len(rotation)] * len(sides)
                place += range(len(position), len(position) + len(sides))
                rotation.append(turn @ tilted)
                aspect.append(int(view))
                anchor.append(some.anchor[o])
                position.extend(some.position[c] + sides)
    positions = np.array(position).reshape(-1, 3)
    return Hypotheses(
        np.array(orientation, dtype=np.int32),
        np.array(place, dtype=np.int32),
        np.array(aspect, dtype=np.int32),
        np.array(rotation).reshape(-1, 3, 3),
        _towards(positions),
        positions,
        np.array(anchor).reshape(-1, 3),
    )


def poses_of(some: Hypotheses, target: str, bone: str) -> list[RigidTransform]:
    """`target_from_bone` of each hypothesis."""
    rotations, shifts = _parts(some)
    return [
        RigidTransform.from_parts(target, bone, rotation, shift)
        for rotation, shift in zip(rotations, shifts, strict=True)
    ]


def find_distinct(
    some: Hypotheses, centre_mm: FloatArray, least_mm: float, least_deg: float
) -> NDArray[np.intp]:
    """Indices of hypotheses that repeat none before them, in their order.

    Args:
        some: hypotheses, best first.
        centre_mm: (3,) of the bone; its distance counts.
        least_mm: two whose centres are nearer than this ...
        least_deg: ... and that are turned by less are the same.
    """
    rotations, shifts = _parts(some)
    centres = rotations @ centre_mm + shifts
    least_trace = 1.0 + 2.0 * np.cos(np.radians(least_deg))
    left = np.arange(len(rotations))
    kept: list[int] = []
    while len(left):
        first = left[0]
        kept.append(int(first))
        trace = np.einsum("hij,ij->h", rotations[left], rotations[first])
        distance = np.linalg.norm(centres[left] - centres[first], axis=1)
        left = left[(trace < least_trace) | (distance > least_mm)]
    return np.array(kept, dtype=np.intp)


def _parts(some: Hypotheses) -> tuple[FloatArray, FloatArray]:
    """(H, 3, 3) rotations and (H, 3) translations."""
    rotations = some.towards[some.place] @ some.rotation[some.orientation]
    anchored = np.einsum("hij,hj->hi", rotations, some.anchor[some.orientation])
    return rotations, some.position[some.place] - anchored


def thin_views(views: Views, step_deg: float) -> NDArray[np.intp]:
    """Indices of views about that far apart."""
    nearest = np.cos(np.radians(0.75 * step_deg))
    kept: list[int] = []
    for k, direction in enumerate(views.directions):
        if not kept or (views.directions[kept] @ direction).max() < nearest:
            kept.append(k)
    return np.array(kept, dtype=np.intp)


def _inside(aspects: AspectGraph, cone: ViewCone, margin_deg: float) -> AspectGraph:
    """The views in a cone, or all when it has none."""
    is_inside = cone.off_axis_deg(aspects.directions) <= cone.half_angle_deg + margin_deg
    kept = np.flatnonzero(is_inside)
    if len(kept) in (0, len(aspects)):
        return aspects
    parts = [np.arange(aspects.starts[k], aspects.starts[k + 1]) for k in kept]
    points = np.concatenate(parts)
    starts = np.concatenate([[0], np.cumsum([len(part) for part in parts])]).astype(np.int64)
    return AspectGraph(
        aspects.bone,
        aspects.directions[kept],
        starts,
        aspects.points_mm[points],
        aspects.tangents[points],
    )


def _anchors(shown_mm: FloatArray, direction: FloatArray) -> FloatArray:
    """(2, 3) points in front of what a view shows: the foremost near the middle, one beside it.

    Tissue hides a bone from behind and from the sides, so that its front is what lies open.
    """
    towards = shown_mm @ direction
    off = shown_mm - np.median(shown_mm, axis=0)
    first = int(np.argmax(towards - _OFF_MIDDLE * np.einsum("ij,ij->i", off, off)))
    front = shown_mm[towards > towards[first] - _FRONT_MM]
    beside = front - shown_mm[first]
    distance = np.linalg.norm(beside, axis=1)
    second = int(np.argmin(np.abs(distance - 0.5 * distance.max())))
    return np.stack([shown_mm[first], front[second]])


def _towards(positions_mm: FloatArray) -> FloatArray:
    """(C, 3, 3) rotations that turn the optical axis into the line of sight of each place."""
    x, y, z = (positions_mm / np.linalg.norm(positions_mm, axis=1, keepdims=True)).T
    # Rodrigues for the turn of (0, 0, 1) into (x, y, z), which is in front: z > 0.
    part = 1.0 / (1.0 + z)
    rotation = np.empty((len(positions_mm), 3, 3))
    rotation[:, 0] = np.column_stack([1.0 - x * x * part, -x * y * part, x])
    rotation[:, 1] = np.column_stack([-x * y * part, 1.0 - y * y * part, y])
    rotation[:, 2] = np.column_stack([-x, -y, z])
    return rotation
