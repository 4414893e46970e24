from dataclasses import replace

import numpy as np
import pytest

from navapp.errors import PlanError
from navapp.geometry.directions import ViewCone
from navapp.geometry.mesh import TriangleMesh
from navapp.preop import AspectSettings, build_aspects, read_aspects, write_aspects
from navapp.preop.aspects_kernels import find_contour_segments, select_spread
from navapp.preop.bone_edges import find_near_ends
from navapp.values import AspectGraph, BoneModel
from tests.bones import femur_model
from tests.reference.aspects_reference import contour_pieces, farthest_first

RADIUS_MM = 30.0


def sphere() -> TriangleMesh:
    from scipy.spatial import ConvexHull

    k = np.arange(1500) + 0.5
    z, angle = 1 - k / 750, np.pi * (1 + np.sqrt(5)) * k
    r = np.sqrt(1 - z * z)
    points = RADIUS_MM * np.column_stack([r * np.cos(angle), r * np.sin(angle), z])
    faces = ConvexHull(points).simplices.astype(np.int32)
    corners = points[faces]
    outward = np.einsum(
        "ij,ij->i",
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]),
        corners[:, 0],
    )
    faces[outward < 0] = faces[outward < 0, ::-1]
    return TriangleMesh(points, faces)


def tube(n_rings: int = 40, cap: bool = False) -> TriangleMesh:
    """A shaft along z, open at both ends or with a flat cap at the lower one."""
    angle = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    z = np.linspace(0.0, 78.0, n_rings)
    vertices = np.array([(15 * np.cos(a), 15 * np.sin(a), h) for h in z for a in angle])
    faces = []
    for i in range(n_rings - 1):
        for j in range(60):
            a, b = i * 60 + j, i * 60 + (j + 1) % 60
            faces += [(a, b, b + 60), (a, b + 60, a + 60)]
    if cap:
        faces += [(len(vertices), (j + 1) % 60, j) for j in range(60)]
        vertices = np.vstack([vertices, (0.0, 0.0, 0.0)])
    return TriangleMesh(vertices, np.array(faces, dtype=np.int32))


def test_edges_are_those_of_the_surface_that_is_seen() -> None:
    """Cartilage that grows thicker along x turns the outline: it leans from the bone's normals."""
    ball = sphere()
    bone = BoneModel("ball", ball, cartilage_mm=3.0 + 0.09 * ball.vertices_mm[:, 0])
    covered = build_aspects(bone, (1, 0, 1), 10.0)
    seen_mm = ball.vertices_mm + bone.cartilage_mm[:, None] * ball.normals
    bare = build_aspects(BoneModel("ball", TriangleMesh(seen_mm, ball.faces)), (1, 0, 1), 10.0)
    np.testing.assert_allclose(covered.points_mm, bare.points_mm, atol=1e-9)


def test_the_outline_of_a_sphere_is_its_circle_with_tangents_along_it() -> None:
    graph = build_aspects(BoneModel("ball", sphere()), (0, 0, 1), 20.0)
    assert len(graph) >= 1
    for k, direction in enumerate(graph.directions):
        points = graph.points_mm[graph.starts[k] : graph.starts[k + 1]]
        tangents = graph.tangents[graph.starts[k] : graph.starts[k + 1]]
        assert len(points) > 60
        # The tangent cone from 450 mm touches where the height is R^2 / distance.
        assert points @ direction == pytest.approx(RADIUS_MM**2 / 450.0, abs=0.6)
        assert np.linalg.norm(points, axis=1) == pytest.approx(RADIUS_MM, abs=0.3)
        across = np.einsum("ij,ij->i", tangents, points) / RADIUS_MM
        assert np.abs(across).max() < 0.15
        assert np.abs(tangents @ direction).max() < 0.3


def test_a_coarser_level_is_spread_evenly_too() -> None:
    graph = build_aspects(BoneModel("ball", sphere()), (0, 0, 1), 1.0)
    points = graph.points_mm[:16] - graph.directions[0] * (graph.points_mm[:16] @ [[0], [0], [1]])
    angle = np.sort(np.arctan2(points[:, 1], points[:, 0]))
    gaps = np.diff(np.append(angle, angle[0] + 2 * np.pi))
    assert gaps.max() < 2.5 * 2 * np.pi / 16


def test_views_fill_the_cone_and_only_it() -> None:
    axis = np.array([0.0, -0.6, -0.8])
    settings = AspectSettings(step_deg=12.0, n_points=60)
    graph = build_aspects(femur_model(), axis, 30.0, settings)
    angle = np.degrees(np.arccos(np.clip(graph.directions @ axis, -1, 1)))
    assert angle.max() <= 30.0
    assert angle.max() > 20.0
    assert np.diff(graph.starts).max() <= 60
    between = np.degrees(np.arccos(np.clip(graph.directions @ graph.directions.T, -1, 1)))
    np.fill_diagonal(between, 180.0)
    assert between.min() > 5.0
    assert between.min(axis=1).max() < 15.0


def test_without_settings_views_are_eight_degrees_apart() -> None:
    cone = femur_model(), (0.0, -0.6, -0.8), 14.0
    expected = build_aspects(*cone, AspectSettings(step_deg=8.0)).directions
    np.testing.assert_array_equal(build_aspects(*cone).directions, expected)


def test_what_lies_behind_is_no_edge() -> None:
    """The far one of two balls in a row is hidden by the near one."""
    far, near = sphere().vertices_mm - (0, 0, 80.0), sphere().vertices_mm * 1.5
    faces = np.concatenate([sphere().faces, sphere().faces + len(far)])
    mesh = TriangleMesh(np.concatenate([far, near]), faces)
    graph = build_aspects(BoneModel("balls", mesh), (0, 0, 1), 1.0)
    assert len(graph.points_mm) > 50
    assert graph.points_mm[:, 2].min() > -20.0


@pytest.mark.parametrize("cap", [False, True])
def test_the_ends_of_a_shaft_are_no_edges(cap: bool) -> None:
    mesh = tube(cap=cap)
    graph = build_aspects(BoneModel("shaft", mesh), (1, 0, 0), 25.0)
    assert graph.points_mm[:, 2].min() > 2.5
    assert graph.points_mm[:, 2].max() < 75.5
    ends = find_near_ends(mesh)
    assert ends[mesh.vertices_mm[:, 2] < 1.0].all()
    assert not ends[np.abs(mesh.vertices_mm[:, 2] - 39.0) < 20.0].any()


def test_what_a_stage_has_removed_is_no_edge() -> None:
    bone = femur_model()
    low = bone.mesh.vertices_mm[:, 2] < bone.mesh.vertices_mm[:, 2].min() + 15.0
    cut = replace(bone, is_removed=low)
    graph = build_aspects(cut, (0, -0.6, -0.8), 5.0)
    assert graph.points_mm[:, 2].min() > bone.mesh.vertices_mm[low, 2].max()


def test_views_that_look_the_same_are_one() -> None:
    """Round its axis, a shaft without ends looks the same in neighbouring views."""
    settings = AspectSettings(step_deg=3.0, n_points=80)
    ball = build_aspects(BoneModel("shaft", tube(200)), (1, 0, 0), 6.0, settings)
    knee = build_aspects(femur_model(), (0, -0.6, -0.8), 6.0, settings)
    assert len(ball) <= len(knee)


def test_a_file_gives_back_what_was_written(tmp_path) -> None:
    graph = build_aspects(femur_model(), (0, -0.6, -0.8), 8.0, AspectSettings(n_points=40))
    path = tmp_path / "aspects_femur.npz"
    write_aspects(path, graph)
    again = read_aspects(path)
    assert again.bone == "femur"
    np.testing.assert_array_equal(again.starts, graph.starts)
    np.testing.assert_allclose(again.points_mm, graph.points_mm, atol=1e-4)
    np.testing.assert_allclose(again.tangents, graph.tangents, atol=1e-6)
    np.testing.assert_array_equal(again.directions, graph.directions)


@pytest.mark.parametrize("content", [None, b"", b"no archive", b"PK\x03\x04 half"])
def test_a_damaged_file_is_refused(tmp_path, content: bytes | None) -> None:
    path = tmp_path / "aspects.npz"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(PlanError, match=r"aspects\.npz cannot be read"):
        read_aspects(path)


def test_a_folder_that_is_not_there_is_said(tmp_path) -> None:
    graph = AspectGraph("femur", np.eye(3)[:1], np.array([0, 1]), np.ones((1, 3)), np.eye(3)[:1])
    with pytest.raises(PlanError, match="cannot be written"):
        write_aspects(tmp_path / "none" / "aspects.npz", graph)


@pytest.mark.parametrize("starts", [[0], [0, 2], [1, 1], [0, 1, 1]])
def test_a_graph_must_divide_its_points(starts) -> None:
    with pytest.raises(ValueError, match="divide"):
        AspectGraph("femur", np.eye(3)[:1], np.array(starts), np.ones((1, 3)), np.eye(3)[:1])


def test_the_work_is_told_and_can_be_stopped() -> None:
    told: list[float] = []
    build_aspects(femur_model(), (0, -0.6, -0.8), 12.0, on_progress=told.append)
    assert told == sorted(told)
    assert told[-1] == 1.0

    class StoppedError(Exception):
        pass

    def stop(share: float) -> None:
        raise StoppedError

    with pytest.raises(StoppedError):
        build_aspects(femur_model(), (0, -0.6, -0.8), 12.0, on_progress=stop)


@pytest.mark.kernel
def test_contours_are_those_of_the_reference() -> None:
    mesh = sphere()
    facing = mesh.vertices_mm @ (0.3, 0.5, 0.8) - 4.0
    middles, tangents = np.empty((2, len(mesh.faces), 3))
    vertices, faces = np.array(mesh.vertices_mm), np.array(mesh.faces)
    n = find_contour_segments(vertices, faces, facing, middles, tangents)
    pieces = contour_pieces(vertices, faces, facing)
    assert n == len(pieces) > 50
    np.testing.assert_allclose(middles[:n], pieces.mean(axis=1), atol=1e-9)
    along = pieces[:, 1] - pieces[:, 0]
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    np.testing.assert_allclose(np.abs((along * tangents[:n]).sum(axis=1)), 1.0, atol=1e-6)


@pytest.mark.kernel
def test_spreading_is_that_of_the_reference() -> None:
    points = np.random.default_rng(3).normal(size=(80, 3))
    order = np.empty(20, dtype=np.int64)
    assert select_spread(points, order) == 20
    assert order.tolist() == farthest_first(points, 20)
    twice = np.concatenate([points[:5], points[:5]])
    assert select_spread(twice, order) == 5


def test_views_of_a_cone_are_those_of_the_whole_graph() -> None:
    graph = build_aspects(BoneModel("ball", sphere()), settings=AspectSettings(step_deg=25.0))
    cone = ViewCone(np.array([0.0, -1.0, 0.0]), 40.0)
    part = graph.within(cone)
    inside = np.flatnonzero(graph.directions @ cone.axis >= np.cos(np.radians(40.0)))
    assert 0 < len(part) < len(graph)
    assert np.array_equal(part.directions, graph.directions[inside])
    for k, view in enumerate(inside):
        mine = slice(part.starts[k], part.starts[k + 1])
        whole = slice(graph.starts[view], graph.starts[view + 1])
        assert np.array_equal(part.points_mm[mine], graph.points_mm[whole])
        assert np.array_equal(part.tangents[mine], graph.tangents[whole])


def test_a_cone_between_the_views_has_the_nearest_one() -> None:
    graph = build_aspects(BoneModel("ball", sphere()), settings=AspectSettings(step_deg=60.0))
    between = graph.directions[0] + graph.directions[1]
    part = graph.within(ViewCone(between, 0.5))
    assert len(part) == 1
    assert part.directions[0] @ between == pytest.approx((graph.directions @ between).max())
