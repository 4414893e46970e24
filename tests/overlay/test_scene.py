"""What belongs to a stage, and where guides stand against what is seen."""

from dataclasses import replace
from enum import IntEnum

import numpy as np
import pytest

from navapp.geometry.box import Box
from navapp.geometry.transform import RigidTransform
from navapp.geometry.zbuffer import render
from navapp.overlay.scene import BENEATH_WEIGHT, TISSUE_MM, Scene
from navapp.overlay.stroke_kernels import weigh
from navapp.values import DrillAxis, Origin, ResectionPlane, StageContent, SurgicalContent
from tests.geometry.shapes import sphere
from tests.overlay.scenes import (
    BEHIND,
    CAMERA,
    MESH,
    POSE,
    STAGE,
    TARGET,
    Occluder,
    grown,
    measured,
    scene,
    seen,
)

PLANES = {
    name: ResectionPlane(bone, np.zeros(3), np.array([0.0, 0.0, 1.0]))
    for name, bone in (("distal", "femur"), ("anterior", "femur"), ("proximal", "tibia"))
}
DRILLS = {"guide": DrillAxis("femur", np.zeros(3), np.array([0.0, 0.0, 1.0]), 20.0, 8.0)}


class Order(IntEnum):
    ON_TOP = 0
    BENEATH = 1
    HIDDEN = 2


def order_of(given: Scene, pixels: np.ndarray, depth_mm: np.ndarray) -> np.ndarray:
    """How points of guides are drawn, by the weights of lines."""
    is_near = np.abs(pixels) < 1e5
    told = [
        weigh(u, v, z, given.ground) if near.all() else given.ground.beyond
        for (u, v), z, near in zip(pixels, depth_mm, is_near, strict=True)
    ]
    weight = np.array(told)
    beneath = np.where(weight <= np.float32(BENEATH_WEIGHT), Order.BENEATH, Order.ON_TOP)
    return np.where(weight < 0.5 * BENEATH_WEIGHT, Order.HIDDEN, beneath)


def inside(given: Scene) -> np.ndarray:
    """(h, w) of the scene's box: well inside the bone."""
    return ~grown(np.isnan(given.bone_mm), 6)


def beside(given: Scene) -> np.ndarray:
    """(h, w) of the scene's box: well beside the bone."""
    return ~grown(np.isfinite(given.bone_mm), 12)


@pytest.mark.parametrize(
    ("content", "planes"),
    [
        (None, {"distal", "anterior"}),
        (StageContent("femur", planes=("anterior",)), {"anterior"}),
        (StageContent("femur", drills=("guide",)), {"distal", "anterior"}),
        (StageContent("femur", planes=("proximal",)), set()),
    ],
)
def test_a_stage_shows_what_the_plan_names_for_it_else_all_of_its_bone(content, planes) -> None:
    stages = {} if content is None else {"opening": content}
    given = scene(content=SurgicalContent(planes=PLANES, drills=DRILLS, stages=stages))
    assert set(given.planes) == planes
    assert set(given.drills) == {"guide"}
    of_tibia = replace(given, stage=replace(STAGE, bone="tibia", name="spacer"))
    assert set(of_tibia.planes) == {"proximal"}
    assert not of_tibia.drills


def test_a_curve_of_no_risk_structure_moves_with_the_femur() -> None:
    given = scene(curves={"nerve": BEHIND})
    assert given.risks["nerve"].safety_mm == 0.0
    assert not replace(given, stage=replace(STAGE, bone="tibia")).risks


def test_points_are_seen_where_the_camera_sees_them() -> None:
    given = scene()
    expected = CAMERA.project(POSE.apply(TARGET[None]))[0]
    np.testing.assert_allclose(CAMERA.project(given.to_camera(TARGET[None]))[0], expected)
    for axis, direction in zip(given.picture_axes_in_bone, np.eye(2), strict=True):
        moved = CAMERA.project(given.to_camera((TARGET + 2.0 * axis)[None]))[0] - expected
        assert moved @ direction > 0.99 * np.linalg.norm(moved)
    deeper = given.to_camera((TARGET + 2.0 * given.axis_in_bone)[None])[0]
    np.testing.assert_allclose(deeper - POSE.apply(TARGET), (0.0, 0.0, 2.0), atol=1e-9)


def test_the_bone_is_rendered_in_a_box_with_a_margin() -> None:
    given = scene()
    whole = render(MESH, POSE, CAMERA).depth_mm
    np.testing.assert_allclose(given.bone_mm, whole[given.box.slices], rtol=1e-5)
    rows, columns = np.nonzero(np.isfinite(given.bone_mm))
    assert min(rows[0], columns.min()) > 40


def test_where_nothing_is_known_all_is_beneath() -> None:
    given = scene()
    assert (given.weight == np.float32(BENEATH_WEIGHT)).all()
    pixels = CAMERA.project(POSE.apply(MESH.vertices_mm))
    order = order_of(given, pixels, POSE.apply(MESH.vertices_mm)[:, 2])
    assert (order == Order.BENEATH).all()


def test_a_bone_that_is_seen_has_guides_on_top() -> None:
    given = seen(scene())
    assert (given.weight[inside(given)] == 1.0).all()
    assert (given.weight[beside(given)] == 1.0).all()
    points = POSE.apply(MESH.vertices_mm)
    pixels = CAMERA.project(points)
    order = order_of(given, pixels, points[:, 2])
    assert (order == Order.ON_TOP).mean() > 0.95
    # What lies within the bone is beneath it, what stands before it is on top.
    assert (order_of(given, pixels, points[:, 2] + 3.0)[order == Order.ON_TOP] == 1).mean() > 0.95
    assert (order_of(given, pixels, points[:, 2] - 30.0)[order == Order.ON_TOP] == 0).all()


@pytest.mark.parametrize(
    ("nearer_mm", "weight"),
    [
        (TISSUE_MM - 0.7, 1.0),
        (TISSUE_MM + 0.7, BENEATH_WEIGHT),
        (4.5, BENEATH_WEIGHT),
        (5.5, 0.0),
        (100.0, 0.0),
    ],
)
def test_what_lies_before_the_bone_covers_it_by_how_near_it_is(nearer_mm, weight) -> None:
    given = seen(scene(), occluder=Occluder(nearer_mm=nearer_mm))
    found = given.weight[inside(given)]
    assert (np.abs(found - weight) < 1e-3).mean() > 0.97


def test_beside_the_bone_what_is_nearer_than_all_of_it_hides() -> None:
    given = seen(scene(), occluder=Occluder(nearer_mm=60.0))
    assert given.weight[beside(given)].max() < 1e-3
    # A tool without texture is filled from its own rim.
    guessed = seen(scene(), occluder=Occluder(nearer_mm=60.0), origin=Origin.FILLED_INTERIOR)
    assert guessed.weight[beside(guessed)].max() < 1e-3
    lower = seen(scene(), occluder=Occluder(nearer_mm=-30.0))
    assert (lower.weight[beside(lower)] == 1.0).all()


@pytest.mark.parametrize("origin", [Origin.FILLED_INTERIOR, Origin.UNKNOWN])
def test_a_guess_and_an_unknown_depth_are_beneath(origin: Origin) -> None:
    given = seen(scene(), origin=origin)
    assert (given.weight == np.float32(BENEATH_WEIGHT)).all()
    points = POSE.apply(MESH.vertices_mm)
    order = order_of(given, CAMERA.project(points), points[:, 2] - 30.0)
    assert (order == Order.BENEATH).all()


def test_points_behind_a_hand_are_hidden() -> None:
    given = seen(scene(), occluder=Occluder(325.0))
    points = POSE.apply(MESH.vertices_mm)
    pixels = CAMERA.project(points)
    order = order_of(given, pixels, points[:, 2])
    assert (order[pixels[:, 0] > 329.0] == Order.HIDDEN).all()
    assert (order[pixels[:, 0] < 321.0] != Order.HIDDEN).all()


def test_pixels_beside_the_picture_are_beneath() -> None:
    given = seen(scene())
    far = np.array([[-5.0, 3.0], [np.nan, np.nan], [1e6, 20.0], [319.0, -1e9]])
    assert (order_of(given, far, np.full(4, 100.0)) == Order.BENEATH).all()


def test_over_another_box_what_is_not_known_is_beneath() -> None:
    given = seen(scene())
    box = Box(given.box.x - 30, given.box.y + 5, 200, 60)
    weight = given.weight_over(box)
    assert (weight[:, :30] == np.float32(BENEATH_WEIGHT)).all()
    np.testing.assert_array_equal(weight[:, 30:], given.weight[5:65, :170])


def test_a_mesh_within_the_bone_is_beneath_it() -> None:
    given = seen(scene())
    for z_mm, weight in ((25.0, BENEATH_WEIGHT), (-25.0, 1.0)):
        view = given.render(sphere(6.0, 12, (0.0, 0.0, z_mm)))
        found = given.weight_of(view, view.box)[view.mask]
        assert len(found) > 100
        assert (found == np.float32(weight)).all()


def test_a_bone_out_of_view_has_an_empty_box() -> None:
    away = RigidTransform.from_parts("left", "femur", np.eye(3), (0.0, 3000.0, 400.0))
    given = scene(pose=away, foreground=measured())
    assert given.box.is_empty
    assert given.weight.size == 0
    assert (given.weight_over(Box(3, 4, 5, 6)) == np.float32(BENEATH_WEIGHT)).all()
    assert order_of(given, np.array([[5.0, 5.0]]), np.array([100.0])).tolist() == [Order.BENEATH]
