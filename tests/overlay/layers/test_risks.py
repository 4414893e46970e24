"""Vessels and nerves, and what lies near them."""

import numpy as np
import pytest

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import RigidTransform
from navapp.geometry.zbuffer import render
from navapp.overlay.colours import ARTERY, NERVE, SAFETY
from navapp.overlay.layers.risks import sample_structure
from navapp.values import BoneModel, Plan, RiskStructure, SurgicalContent
from tests.geometry.shapes import sphere
from tests.overlay.scenes import (
    BEHIND,
    CAMERA,
    MESH,
    POSE,
    draw,
    grown,
    is_colour,
    pixels_of,
    scene,
    seen,
    words,
)
from tests.views import find_silhouette

ON_BONE = np.column_stack([np.linspace(-30, 30, 21), np.zeros(21), np.full(21, -3.0)])


def content(safety_mm: float, mesh: TriangleMesh | None = None, bone: str = "femur"):
    return SurgicalContent(risks={"artery": RiskStructure(bone, safety_mm, mesh)})


def surface_distance_mm(points_mm: np.ndarray) -> np.ndarray:
    """Of each of the bone's vertices to the nearest point."""
    off: np.ndarray = np.linalg.norm(MESH.vertices_mm[:, None] - points_mm, axis=2).min(axis=1)
    return off


def test_bone_within_the_safety_distance_is_coloured_and_no_other() -> None:
    given = seen(scene(curves={"artery": ON_BONE}, content=content(9.0)))
    image = draw("risks", given).astype(int)
    # Vermilion on black: no blue, and less green than red.
    is_near = (image[..., 2] > 60) & (image[..., 0] < 40)
    u, v = pixels_of(MESH.vertices_mm).T
    off = surface_distance_mm(sample_structure(given.plan, "artery", 0.5))
    # The vessel itself lies over the bone, with a rim.
    vessel = grown(is_colour(image, ARTERY), 3)
    mask = ~grown(~render(MESH, POSE, CAMERA).mask, 3) & ~vessel
    inner = mask[v, u]
    assert is_near[v, u][inner & (off < 8.0)].mean() > 0.9
    # Triangles that reach into the distance count whole.
    assert not is_near[v, u][inner & (off > 14.0)].any()
    assert (inner & (off < 8.0)).sum() > 30
    share = SAFETY[2] * 0.45
    assert abs(np.median(image[..., 2][is_near & mask]) - share) < 25


def test_without_a_safety_distance_only_the_structure_is_drawn() -> None:
    image = draw("risks", seen(scene(curves={"artery": ON_BONE}, content=content(0.0))))
    lit = grown(is_colour(image, ARTERY), 3)
    assert lit.any()
    assert not image[~lit].any()


def test_a_curve_is_dashed_behind_the_bone_and_whole_before_it() -> None:
    def lit(curve: np.ndarray) -> np.ndarray:
        image = draw("risks", seen(scene(curves={"nerve": curve})))
        u, v = pixels_of(curve).T
        mask = render(MESH, POSE, CAMERA).mask[v, u]
        found: np.ndarray = is_colour(image, NERVE)[v, u][mask]
        return found

    fine = np.column_stack([np.linspace(-60, 60, 241), np.full(241, 5.0), np.full(241, 60.0)])
    assert 0.5 < lit(fine).mean() < 0.85
    assert lit(fine - (0.0, 0.0, 90.0)).mean() > 0.97


@pytest.mark.parametrize(("z_mm", "is_beneath"), [(-25.0, False), (30.0, True)])
def test_a_surface_within_the_bone_is_beneath_it(z_mm: float, is_beneath: bool) -> None:
    ball = sphere(8.0, 24, (0.0, 0.0, z_mm))
    image = draw("risks", seen(scene(content=content(0.0, ball))))
    mask = render(ball, POSE, CAMERA).mask
    edge = find_silhouette(render(ball, POSE, CAMERA))
    inner = mask & ~grown(edge, 4)
    on_edge = (image[edge][:, 2] > 0.7 * ARTERY[2]).mean()
    assert (on_edge < 0.75) == is_beneath
    expected = 0.3 * ARTERY[2] * (0.55 if is_beneath else 1.0)
    assert abs(float(np.median(image[inner][:, 2])) - expected) < 2.0


def test_bone_beside_the_chords_of_a_surface_is_not_near() -> None:
    """Only the surface counts, whatever the order of its vertices."""
    left, right = (sphere(3.0, 8, (x, 0.0, 5.0)) for x in (-35.0, 35.0))
    both = TriangleMesh(
        np.stack([left.vertices_mm, right.vertices_mm], axis=1).reshape(-1, 3),
        np.vstack([2 * left.faces, 2 * right.faces + 1]),
    )
    image = draw("risks", seen(scene(content=content(6.0, both))))
    u, v = pixels_of(np.array([[-35.0, 4.0, 9.0], [0.0, 4.0, 0.2]])).T
    assert image[v[0], u[0]].any()
    assert not image[v[1], u[1]].any()


def test_the_samples_of_a_surface_lie_on_it_and_leave_no_gap() -> None:
    ball = sphere(20.0, 6)
    plan = Plan({"femur": BoneModel("femur", MESH)}, content=content(1.0, ball))
    points = sample_structure(plan, "artery", 1.0)
    edges = ball.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    middles = ball.vertices_mm[edges].mean(axis=1)
    off = np.linalg.norm(middles[:, None] - points, axis=2).min(axis=1)
    assert off.max() <= 0.5
    radius = np.linalg.norm(points, axis=1)
    assert radius.max() < 20.0 + 1e-9
    assert radius.min() > 17.0


def test_the_label_is_where_the_structure_is_seen() -> None:
    assert words("risks", seen(scene(curves={"tibial_nerve": BEHIND}))) == ["tibial nerve"]
    away = RigidTransform.from_parts("left", "femur", np.eye(3), (0.0, 3000.0, 400.0))
    assert words("risks", scene(curves={"tibial_nerve": BEHIND}, pose=away)) == []
