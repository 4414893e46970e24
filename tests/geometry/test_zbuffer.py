import numpy as np
import pytest

from navapp.geometry.box import Box
from navapp.geometry.lane_kernels import FLOAT_LANES
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.rectification import RectifiedGeometry
from navapp.geometry.transform import RigidTransform, rotation_from_vector
from navapp.geometry.zbuffer import find_known_range, render, render_rectified
from navapp.geometry.zbuffer_kernels import (
    bounds_of_points,
    project_points,
    raster_nearest,
    tell_depth,
)
from tests.geometry.shapes import STRONG, camera, cube, sphere
from tests.reference import zbuffer_reference
from tests.views import find_silhouette, find_unhidden_vertices, project_box

IDENTITY = RigidTransform.identity("left_rect", "bone")
GEOMETRY = RectifiedGeometry(
    400.0, 79.5, 59.5, 60.0, 160, 120, RigidTransform.identity("left_rect", "left")
)
WHOLE = Box(0, 0, 160, 120)
EMPTY = TriangleMesh(np.empty((0, 3)), np.empty((0, 3), dtype=np.int32))


def pose(vector=(0.4, -0.7, 0.2), translation=(3.0, -4.0, 300.0)):
    return RigidTransform.from_parts("left_rect", "bone", rotation_from_vector(vector), translation)


def seen(mesh, left_rect_from_bone=IDENTITY, box=WHOLE):
    return render_rectified(mesh, left_rect_from_bone, GEOMETRY, box)


def square(z_mm, half_mm=10.0, centre=(0.0, 0.0)):
    x, y = centre
    corners = [[-1, -1], [1, -1], [1, 1], [-1, 1]]
    vertices = [[x + half_mm * i, y + half_mm * j, z_mm] for i, j in corners]
    return TriangleMesh(np.array(vertices), [[0, 2, 1], [0, 3, 2]])


def drawn(pixels, depths, faces, width, height, bands=None):
    """Inverse depth and triangle per pixel."""
    inverse_depth = np.zeros((height, width + FLOAT_LANES), dtype=np.float32)
    codes = np.full(inverse_depth.shape, -1, dtype=np.int32)
    depth, face_index = (np.empty((height, width), dtype=kind) for kind in (np.float32, np.int32))
    for band in bands or [(0, height)]:
        raster_nearest(pixels, depths, faces, inverse_depth, codes.view(np.float32), band, False)
        tell_depth(inverse_depth, codes, band, depth, face_index)
    np.testing.assert_array_equal(np.isnan(depth), face_index < 0)
    return np.where(face_index < 0, 0.0, 1.0 / depth), face_index


@pytest.mark.kernel
@pytest.mark.parametrize("seed", range(4))
def test_the_kernel_agrees_with_the_reference(seed):
    rng = np.random.default_rng(seed)
    width, height = 36, 28
    pixels = rng.uniform((-10, -10), (46, 38), (60, 2))
    depths = rng.uniform(100, 600, 60)
    pixels[:3] = np.nan
    depths[3:6] = (-50.0, 0.0, 1e-7)
    faces = rng.integers(0, 60, (25, 3)).astype(np.int32)
    bands = ((0, 11), (11, height))
    inverse_depth, face_index = drawn(pixels, depths, faces, width, height, bands)
    expected_depth, expected_face = zbuffer_reference.nearest(pixels, depths, faces, width, height)
    assert (face_index >= 0).mean() > 0.3
    np.testing.assert_array_equal(face_index, expected_face)
    # Needles of triangles: what float32 leaves of them.
    np.testing.assert_allclose(inverse_depth, expected_depth, rtol=1e-5)


@pytest.mark.kernel
def test_the_edges_of_a_triangle_on_pixel_centres_belong_to_it():
    pixels = np.array([[2.0, 3.0], [8.0, 3.0], [2.0, 9.0]])
    faces = np.array([[0, 1, 2]], dtype=np.int32)
    inverse_depth, face_index = drawn(pixels, np.full(3, 100.0), faces, 12, 12)
    expected, _ = zbuffer_reference.nearest(pixels, np.full(3, 100.0), [[0, 1, 2]], 12, 12)
    np.testing.assert_array_equal(inverse_depth > 0, expected > 0)
    assert face_index[3, 2:9].tolist() == [0] * 7
    assert face_index[3:10, 2].tolist() == [0] * 7


def test_a_closed_mesh_looks_the_same_without_its_far_side():
    mesh, left_rect_from_bone = sphere(30.0, 30), pose()
    whole = seen(mesh, left_rect_from_bone)
    n_faces = len(mesh.faces)
    facing = render_rectified(mesh, left_rect_from_bone, GEOMETRY, whole.box, n_outward=n_faces)
    np.testing.assert_array_equal(facing.face_index, whole.face_index)
    np.testing.assert_array_equal(facing.depth_mm, whole.depth_mm)
    # Turned inside out, only its far side is drawn.
    given = mesh.flip(), left_rect_from_bone, GEOMETRY, whole.box
    inside = render_rectified(*given, n_outward=n_faces)
    middle = np.isfinite(whole.depth_mm)
    assert (inside.depth_mm[middle] > whole.depth_mm[middle] + 1.0).mean() > 0.9
    # What comes after the outward ones is seen from both sides.
    both = render_rectified(*given, n_outward=n_faces // 2)
    is_near = both.depth_mm[middle] < whole.depth_mm[middle] + 1e-3
    assert 0.1 < is_near.mean() < 0.9
    assert (both.face_index[middle][is_near] >= n_faces // 2).all()


def test_depth_agrees_with_ray_casting():
    open3d = pytest.importorskip("open3d")
    mesh, left_rect_from_bone = sphere(30.0, 30), pose()
    view = seen(mesh, left_rect_from_bone)
    scene = open3d.t.geometry.RaycastingScene(nthreads=1)
    moved = mesh.transform(left_rect_from_bone)
    scene.add_triangles(
        open3d.core.Tensor(moved.vertices_mm.astype(np.float32)),
        open3d.core.Tensor(moved.faces.astype(np.uint32)),
    )
    # Its rays go through pixel + 0.5: the first pixel's centre is at (0.5, 0.5).
    matrix = GEOMETRY.camera_matrix
    matrix[:2, 2] += 0.5
    rays = scene.create_rays_pinhole(matrix, np.eye(4), 160, 120)
    answer = scene.cast_rays(rays, nthreads=1)
    length = answer["t_hit"].numpy()
    depth = length * rays.numpy()[:, :, 5]
    hit = np.isfinite(length)
    assert (hit != view.mask).sum() <= 4
    both = hit & view.mask
    assert both.sum() > 2000
    np.testing.assert_allclose(view.depth_mm[both], depth[both], rtol=0, atol=5e-3)
    same = answer["primitive_ids"].numpy()[both].astype(np.int64) == view.face_index[both]
    assert same.mean() > 0.99


def test_a_tilted_plane_has_its_own_depth():
    """The plane z = 300 + 0.5 x, seen at u: x = (u - cx) z / f."""
    vertices = np.array([[x, y, 300 + 0.5 * x] for x, y in ((-40, -30), (40, -30), (40, 30))])
    view = seen(TriangleMesh(vertices, [[0, 1, 2]]))
    u = np.nonzero(view.mask)[1]
    expected = 300.0 / (1.0 - 0.5 * (u - 79.5) / 400.0)
    assert len(u) > 1000
    np.testing.assert_allclose(view.depth_mm[view.mask], expected, rtol=1e-6)


def test_the_nearer_surface_hides_the_other_in_either_order():
    near, far = square(200.0, 5.0), square(400.0, 30.0)
    for first, second in ((near, far), (far, near)):
        both = TriangleMesh(
            np.vstack([first.vertices_mm, second.vertices_mm]),
            np.vstack([first.faces, second.faces + 4]),
        )
        view = seen(both)
        assert view.depth_mm[60, 80] == pytest.approx(200.0, rel=1e-6)
        assert view.depth_mm[60, 55] == pytest.approx(400.0, rel=1e-6)


def test_unseen_pixels_have_no_depth_and_no_face():
    view = seen(square(300.0))
    assert np.isnan(view.depth_mm[~view.mask]).all()
    assert (view.face_index[~view.mask] == -1).all()
    assert np.isfinite(view.depth_mm[view.mask]).all()
    assert view.depth_mm.dtype == np.float32
    assert view.face_index.dtype == np.int32


def test_the_silhouette_is_the_rim():
    view = seen(square(300.0))
    rows, columns = np.nonzero(view.mask)
    expected = np.zeros_like(view.mask)
    expected[rows.min() : rows.max() + 1, columns.min() : columns.max() + 1] = True
    np.testing.assert_array_equal(view.mask, expected)
    expected[rows.min() + 1 : rows.max(), columns.min() + 1 : columns.max()] = False
    np.testing.assert_array_equal(find_silhouette(view), expected)


def test_vertices_behind_the_body_are_hidden():
    ball = sphere(30.0, 24)
    placed = pose()
    view = seen(ball, placed)
    shown = find_unhidden_vertices(ball, placed, GEOMETRY, view)
    towards = np.einsum("ij,ij->i", placed.rotate(ball.normals), placed.apply(ball.vertices_mm))
    towards /= np.linalg.norm(placed.apply(ball.vertices_mm), axis=1)
    assert shown[towards < -0.6].all()
    assert not shown[towards > 0.3].any()


def test_vertices_behind_another_part_are_hidden():
    near, far = square(200.0, 8.0), square(400.0, 4.0)
    both = TriangleMesh(
        np.vstack([near.vertices_mm, far.vertices_mm]), np.vstack([near.faces, far.faces + 4])
    )
    shown = find_unhidden_vertices(both, IDENTITY, GEOMETRY, seen(both))
    assert not shown[4:].any()
    assert find_unhidden_vertices(far, IDENTITY, GEOMETRY, seen(far)).any()


@pytest.mark.parametrize(("gap_mm", "is_shown"), [(0.5, True), (1.5, False)])
def test_vertices_hidden_by_less_than_a_millimetre_are_still_shown(gap_mm, is_shown):
    near, far = square(200.0, 8.0), square(200.0 + gap_mm, 4.0)
    both = TriangleMesh(
        np.vstack([near.vertices_mm, far.vertices_mm]), np.vstack([near.faces, far.faces + 4])
    )
    shown = find_unhidden_vertices(both, IDENTITY, GEOMETRY, seen(both))
    assert (shown[4:] == is_shown).all()


def test_vertices_outside_the_box_or_behind_the_camera_are_not_shown():
    aside = square(300.0, 5.0, (500.0, 0.0))
    assert not find_unhidden_vertices(aside, IDENTITY, GEOMETRY, seen(aside)).any()
    behind = square(-300.0)
    assert not find_unhidden_vertices(behind, IDENTITY, GEOMETRY, seen(behind)).any()
    small = Box(0, 0, 20, 20)
    view = seen(square(300.0), box=small)
    assert not find_unhidden_vertices(square(300.0), IDENTITY, GEOMETRY, view).any()


def test_a_box_is_a_window_of_the_whole():
    whole = seen(sphere(30.0), pose())
    part = seen(sphere(30.0), pose(), Box(50, 40, 60, 30))
    np.testing.assert_array_equal(part.face_index, whole.face_index[40:70, 50:110])
    np.testing.assert_allclose(part.depth_mm, whole.depth_mm[40:70, 50:110], rtol=1e-5)


def test_a_box_may_reach_beyond_the_picture():
    view = seen(square(300.0, 10.0, (-60.0, 0.0)), box=Box(-40, 30, 60, 60))
    columns = np.nonzero(view.mask.any(axis=0))[0] - 40
    assert columns.min() == int(np.ceil(79.5 - 400 * 70 / 300))
    assert columns.max() == int(np.floor(79.5 - 400 * 50 / 300))


@pytest.mark.parametrize(
    "mesh",
    [
        EMPTY,
        square(-300.0),
        square(300.0, 5.0, (900.0, 0.0)),
        square(300.0, 5.0, (0.0, -900.0)),
        TriangleMesh(np.array([[0, 0, 300.0], [1, 1, 300], [2, 2, 300]]), [[0, 1, 2]]),
    ],
)
def test_what_is_not_in_view_is_not_seen(mesh):
    view = seen(mesh)
    assert not view.mask.any()
    assert np.isnan(view.depth_mm).all()
    assert not find_silhouette(view).any()


def test_a_triangle_that_crosses_the_camera_plane_is_left_out():
    vertices = np.array([[0, 0, -50.0], [20, 0, 300], [-20, 5, 300]])
    assert not seen(TriangleMesh(vertices, [[0, 1, 2]])).mask.any()


@pytest.mark.parametrize("box", [Box(0, 0, 0, 0), Box(3, 3, -4, 5), Box(5, 5, 10, 0)])
def test_an_empty_box_gives_an_empty_view(box):
    view = seen(square(300.0), box=box)
    assert view.mask.size == 0
    assert not find_unhidden_vertices(square(300.0), IDENTITY, GEOMETRY, view).any()


def test_vertices_close_before_the_camera_do_no_harm():
    vertices = np.array([[1e6, 0, 2e-6], [-1e6, 1e6, 2e-6], [0, -1e6, 2e-6]])
    view = render(TriangleMesh(vertices, [[0, 1, 2]]), IDENTITY, camera(STRONG))
    assert view.mask.shape == (480, 640)


def test_the_projected_box_holds_the_mesh_and_is_clipped():
    view = seen(sphere(30.0), pose())
    box = project_box(sphere(30.0), pose(), GEOMETRY)
    rows, columns = np.nonzero(view.mask)
    assert 0 <= columns.min() - box.x <= 1
    assert 0 <= box.x + box.width - 1 - columns.max() <= 1
    assert 0 <= rows.min() - box.y <= 1
    assert 0 <= box.y + box.height - 1 - rows.max() <= 1
    near = project_box(sphere(30.0), pose(translation=(0, 0, 100.0)), GEOMETRY)
    assert near == WHOLE


@pytest.mark.parametrize("mesh", [EMPTY, square(-300.0), square(300.0, 5.0, (900.0, 0.0))])
def test_there_is_no_projected_box_out_of_view(mesh):
    assert project_box(mesh, IDENTITY, GEOMETRY) is None


def test_a_distorted_camera_sees_the_vertices_where_it_projects_them():
    lens = camera(STRONG)
    mesh = cube(40.0)
    placed = pose((0.3, 0.4, 0.1), (90.0, 60.0, 400.0))
    view = render(mesh, placed, lens)
    pixels = lens.project(placed.apply(mesh.vertices_mm))
    rows, columns = np.nonzero(view.mask)
    assert abs(columns.min() - pixels[:, 0].min()) < 1.5
    assert abs(columns.max() - pixels[:, 0].max()) < 1.5
    assert abs(rows.min() - pixels[:, 1].min()) < 1.5
    assert abs(rows.max() - pixels[:, 1].max()) < 1.5
    assert view.box == Box(0, 0, 640, 480)


@pytest.mark.parametrize("seed", range(3))
def test_neighbours_leave_no_seam(seed):
    rng = np.random.default_rng(seed)
    x, y = np.meshgrid(np.arange(-6, 60, 3.0), np.arange(-6, 48, 3.0))
    # Corners between and on pixel centres, edges through many of them.
    x, y = (part + rng.integers(-4, 5, part.shape) / (1.0, 3.0, 8.0)[seed] / 4 for part in (x, y))
    index = np.arange(x.size).reshape(x.shape)
    a, b, c, d = (
        part.ravel() for part in (index[:-1, :-1], index[:-1, 1:], index[1:, :-1], index[1:, 1:])
    )
    faces = np.vstack([np.column_stack([a, b, c]), np.column_stack([d, c, b])])
    for turn in range(3):
        _, face_index = drawn(
            np.column_stack([x.ravel(), y.ravel()]),
            np.full(x.size, 250.0),
            np.roll(faces, turn, axis=1).astype(np.int32),
            50,
            40,
        )
        assert (face_index >= 0).all()


def test_the_box_around_a_mesh_shows_what_the_whole_picture_shows() -> None:
    seen_by = camera((-0.2, 0.08, 5e-4, -4e-4, 0.0))
    pose = RigidTransform.from_parts("left", "bone", np.eye(3), (25.0, -12.0, 300.0))
    whole, part = (render(sphere(), pose, seen_by, is_whole=flag) for flag in (True, False))
    box = part.box
    rows, columns = slice(box.y, box.y + box.height), slice(box.x, box.x + box.width)
    np.testing.assert_array_equal(part.face_index, whole.face_index[rows, columns])
    assert part.mask.sum() == whole.mask.sum() > 100
    assert part.face_index.size < 0.5 * whole.face_index.size


def test_the_box_around_a_mesh_out_of_view_is_empty() -> None:
    away = RigidTransform.from_parts("left", "bone", np.eye(3), (9000.0, 0.0, 300.0))
    assert render(sphere(), away, camera(), is_whole=False).box.is_empty


def test_points_are_projected_as_the_geometry_says():
    rng = np.random.default_rng(5)
    points = rng.uniform((-60.0, -40.0, -90.0), (60.0, 40.0, 300.0), (200, 3))
    tilted = pose((0.2, -0.1, 0.3), (4.0, -7.0, 30.0))
    moved = tilted.apply(points)
    pixels, depths = np.empty((200, 2)), np.empty(200)
    centre = (GEOMETRY.centre_x_px, GEOMETRY.centre_y_px)
    place = (tilted.rotation, tilted.translation_mm, GEOMETRY.focal_px, centre)
    project_points(points, *place, pixels, depths)
    expected = GEOMETRY.project(moved)
    assert np.isnan(expected).any()
    np.testing.assert_allclose(pixels, expected, rtol=1e-9)
    np.testing.assert_allclose(depths, moved[:, 2], rtol=1e-9)
    limits = bounds_of_points(points, *place)
    low, high = np.nanmin(expected, axis=0), np.nanmax(expected, axis=0)
    np.testing.assert_allclose(limits[:4], [*low, *high], rtol=1e-9)
    np.testing.assert_allclose(limits[4:], [moved[:, 2].min(), moved[:, 2].max()], rtol=1e-9)


@pytest.mark.kernel
@pytest.mark.parametrize("is_whole", [True, False])
@pytest.mark.parametrize("turned", range(3))
@pytest.mark.parametrize("away", [(100.0, 0.0), (60.0, 80.0), (90.0, 120.0)])
def test_where_a_lens_shows_nothing_nothing_is_drawn(away, turned, is_whole):
    """At and beyond 45 degrees from the axis, where the denominator of this lens is 0, or less."""
    odd = camera((0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0))
    corners = np.array([[*away, 100.0], [0.0, 0.0, 100.0], [0.0, 10.0, 100.0]])
    mesh = TriangleMesh(np.roll(corners, turned, axis=0), np.array([[0, 1, 2]]))
    view = render(mesh, RigidTransform.identity("left", "bone"), odd, is_whole=is_whole)
    assert not view.mask.any()


def test_the_range_is_that_of_what_is_known():
    values = np.array([[np.nan, 3.0, -1.0], [7.0, np.nan, 2.0]], dtype=np.float32)
    assert find_known_range(values) == (-1.0, 7.0)
    assert find_known_range(np.full((2, 3), np.nan, np.float32)) == (np.inf, -np.inf)
    rng = np.random.default_rng(1)
    for shape in ((5, 8), (7, 13), (40, 3), (0, 4)):
        values = rng.normal(size=shape).astype(np.float32)
        values[rng.random(shape) < 0.3] = np.nan
        known = values[np.isfinite(values)]
        ends = (known.min(), known.max()) if known.size else (np.inf, -np.inf)
        assert find_known_range(values) == ends
