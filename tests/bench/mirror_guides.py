"""Guides as the product draws them for the mirror, read from the picture that the eye sees.

Each guide is drawn alone: `compose_mirror` with one layer, and of targets with one target. What is
expected comes from the true femur at its true pose and the simulator's own rays.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from navapp.control.stages import STAGES
from navapp.devices.simulated_mirror import true_display
from navapp.geometry.display_model_view import EyeView
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.overlay import MirrorView, Scene, compose_mirror
from navapp.values import Plan, StageSpec, SurgicalContent
from tests.bench.mirror_knees import BONE, FollowedKnee
from tests.bench.mirror_reading import (
    Sight,
    box_around,
    is_cross_whole,
    read_centroid,
    read_crossing,
    read_line,
)

PLANE = "femur_distal"
# Targets are so far apart as the eye sees them, and face it so well: nearer to the bone's outline
# nobody plans one.
_APART_MM, _FACING = 20.0, np.cos(np.radians(70.0))
# Around a cross whose bars are 3 mm long on each side, and around a line.
_MARGIN_MM = 5.0
# A target whose name is a space has no words beside its cross.
_TARGET = f"{BONE}/_"
_DRAWN_CHANNEL = 0


@dataclass(frozen=True, eq=False)
class Crosses:
    """Distances of crosses (n,) from their points, mm at the point; NaN where too little is lit."""

    centroid_mm: FloatArray  # of all light of the cross
    crossing_mm: FloatArray  # of the middles of its two bars
    is_whole: NDArray[np.bool_]  # without dashes and dark parts


@dataclass(frozen=True, eq=False)
class StepLine:
    """The true cut line where the eye sees it, a sample for each triangle that is cut."""

    points_mm: FloatArray  # (n, 3) left camera's frame
    px: FloatArray  # (n, 2) as the eye sees them
    along: FloatArray  # (n, 2) unit
    is_seen_by_cameras: NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class ReadCut:
    """The drawn line beside the true one."""

    off_mm: FloatArray  # (n,) across; NaN where none is read
    is_lit: NDArray[np.bool_]  # (n,) False in the gaps of dashes, and where nothing is drawn


def choose_targets(rng: np.random.Generator, knee: FollowedKnee, sight: Sight) -> FloatArray:
    """(n, 3) points of the femur, its coordinates, that the eye and both cameras see."""
    mesh = knee.plan.bones[BONE].mesh
    there = knee.true.apply(mesh.vertices_mm)
    to_eye = sight.eye_mm - there
    facing = (knee.true.rotate(mesh.normals) * to_eye).sum(axis=1)
    is_good = knee.is_seen_by_eye(mesh.vertices_mm, sight.eye_from_left)
    is_good &= knee.is_seen_by_cameras(mesh.vertices_mm)
    is_good &= facing > _FACING * np.linalg.norm(to_eye, axis=1)
    places_mm = sight.px(there) / sight.px_per_mm(there)[:, None]
    chosen: list[int] = []
    for one in rng.permutation(np.flatnonzero(is_good)):
        if (np.linalg.norm(places_mm[chosen] - places_mm[one], axis=1) >= _APART_MM).all():
            chosen.append(one)
    return mesh.vertices_mm[chosen]


def read_crosses(
    knee: FollowedKnee,
    sight: Sight,
    eye_view: EyeView,
    left_from_bone: RigidTransform,
    targets_mm: FloatArray,
) -> Crosses:
    """Draw targets (n, 3) one by one at a pose, and compare with where the true ones are seen."""
    there = knee.true.apply(targets_mm)
    expected, scales = sight.px(there), sight.px_per_mm(there)
    # The bars lie along the columns and rows of the screen.
    axes = true_display(sight.setup).view().eye_from_left.rotation[:2]
    found = []
    for target, point, place, scale in zip(targets_mm, there, expected, scales, strict=True):
        plan = Plan(knee.plan.bones, {_TARGET: target[None]})
        stage = replace(STAGES[0], targets=(_TARGET,))
        shown = _show(knee, eye_view, left_from_bone, plan, stage, "targets")
        low, high = box_around(place[None], _MARGIN_MM * scale)
        picture, near = sight.see(shown, low, high), place - low
        bars = sight.px(point + axes) - sight.px(point[None])
        bars /= np.linalg.norm(bars, axis=1, keepdims=True)
        asked = (picture, near, bars, scale, sight.full_light)
        read = (read_centroid(picture, sight.full_light), read_crossing(*asked))
        is_whole = is_cross_whole(*asked)
        found.append((*(np.linalg.norm(one - near) / scale for one in read), is_whole))
    centroid_mm, crossing_mm, is_whole = np.array(found).T
    return Crosses(centroid_mm, crossing_mm, is_whole > 0.5)


def find_cut(knee: FollowedKnee, sight: Sight) -> StepLine:
    """Where the plane of the distal cut leaves the true femur, as far as the eye sees it."""
    mesh, plane = knee.plan.bones[BONE].mesh, knee.plan.content.planes[PLANE]
    ends = np.array(list(_cut_triangles(mesh, (mesh.vertices_mm - plane.point_mm) @ plane.normal)))
    middles = ends.mean(axis=1)
    is_seen = knee.is_seen_by_eye(middles, sight.eye_from_left)
    start_px, end_px = (sight.px(knee.true.apply(ends[:, k])) for k in (0, 1))
    length_px = np.linalg.norm(end_px - start_px, axis=1)
    is_seen &= length_px > 0.0
    points_mm = knee.true.apply(middles[is_seen])
    return StepLine(
        points_mm,
        sight.px(points_mm),
        (end_px - start_px)[is_seen] / length_px[is_seen, None],
        knee.is_seen_by_cameras(middles[is_seen]),
    )


def read_cut(
    knee: FollowedKnee,
    sight: Sight,
    eye_view: EyeView,
    left_from_bone: RigidTransform,
    cut: StepLine,
) -> ReadCut:
    """Draw the plan's cut at a pose, and compare with the true line."""
    content = SurgicalContent(planes={PLANE: knee.plan.content.planes[PLANE]})
    plan = Plan(knee.plan.bones, content=content)
    shown = _show(knee, eye_view, left_from_bone, plan, STAGES[2], "planes")
    scales = sight.px_per_mm(cut.points_mm)
    low, high = box_around(cut.px, _MARGIN_MM * scales.max())
    picture = sight.see(shown, low, high)
    return ReadCut(*read_line(picture, cut.px - low, cut.along, scales, sight.full_light))


def _show(
    knee: FollowedKnee,
    eye_view: EyeView,
    left_from_bone: RigidTransform,
    plan: Plan,
    stage: StageSpec,
    layer: str,
) -> NDArray[np.uint8]:
    """(H, W) the blue light of the picture that the display is handed; guides have enough of it."""
    view = MirrorView(eye_view, knee.rig)
    scene = Scene(plan, stage, left_from_bone, view, False, knee.foreground, (layer,))
    shown = compose_mirror(scene, eye_view, "NAVIGATING", is_guiding=True)
    return np.ascontiguousarray(shown[:, :, _DRAWN_CHANNEL])


def _cut_triangles(mesh: TriangleMesh, height_mm: FloatArray) -> Iterator[FloatArray]:
    """(2, 3) where a plane enters and leaves each triangle that it cuts."""
    heights = height_mm[mesh.faces] > 0.0
    for face in mesh.faces[heights.any(axis=1) & ~heights.all(axis=1)]:
        corners, height = mesh.vertices_mm[face], height_mm[face]
        ends = []
        for k in range(3):
            here, there = height[k], height[(k + 1) % 3]
            if (here > 0.0) != (there > 0.0):
                share = here / (here - there)
                ends.append(corners[k] + share * (corners[(k + 1) % 3] - corners[k]))
        yield np.array(ends)
