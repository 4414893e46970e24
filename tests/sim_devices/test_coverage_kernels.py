import numpy as np
import pytest

from sim_devices.anatomy import KneeSpec, make_knee
from sim_devices.coverage_kernels import number_edges, raster_places
from sim_devices.raster_kernels import raster_triangles
from tests.reference import coverage_reference

WIDTH, HEIGHT, FOCAL_PX = 96, 72, 110.0
BOX = np.array([4, 3, WIDTH - 5, HEIGHT - 6], dtype=np.int64)


@pytest.fixture(scope="module")
def scene():
    """Two bones of two materials before nothing: vertices on the screen, faces, owners."""
    bones = make_knee(KneeSpec(1)).bones
    screens, faces, parts = [], [], []
    for k, (name, away) in enumerate((("femur", (-20.0, 5.0, 420.0)), ("patella", (15, 0, 380)))):
        mesh = bones[name]
        points = mesh.vertices_mm - mesh.centroid_mm + away
        uv = points[:, :2] / points[:, 2:] * FOCAL_PX * 2.0 + (WIDTH / 2, HEIGHT / 2)
        faces.append(mesh.faces + np.int32(sum(map(len, screens))))
        screens.append(np.column_stack([uv, 1.0 / points[:, 2]]))
        parts.append(np.full(len(mesh.faces), k, dtype=np.uint8))
    return np.vstack(screens), np.vstack(faces).astype(np.int32), np.concatenate(parts)


def draw(screen, faces, shape):
    depth, triangle = np.zeros(shape, np.float32), np.full(shape, -1, np.int32)
    box = np.array([0, 0, shape[1], shape[0]], dtype=np.int64)
    raster_triangles(screen, faces, 0, box, depth, triangle)
    return depth, triangle


@pytest.mark.kernel
def test_edges_are_those_of_the_reference(scene):
    screen, faces, parts = scene
    materials = (np.arange(len(faces)) % 997 == 0).astype(np.uint8)
    depth, triangle = draw(screen, faces, (HEIGHT, WIDTH))
    number = np.full((HEIGHT, WIDTH), -5, np.int32)
    n = number_edges(triangle, depth, parts, materials, BOX, FOCAL_PX, number)
    x0, y0, x1, y1 = BOX
    expected = coverage_reference.find_edges(
        triangle[y0:y1, x0:x1], depth[y0:y1, x0:x1], parts, materials, FOCAL_PX
    )
    inside = number[y0:y1, x0:x1]
    assert 200 < n < 0.5 * inside.size
    np.testing.assert_array_equal(inside >= 0, expected)
    np.testing.assert_array_equal(inside[expected], np.arange(n))
    assert (number == -5).sum() == number.size - inside.size


@pytest.mark.kernel
def test_places_show_what_three_times_as_many_pixels_show(scene):
    screen, faces, _ = scene
    number = np.full((HEIGHT, WIDTH), -1, np.int32)
    x0, y0, x1, y1 = BOX
    rng = np.random.default_rng(3)
    chosen = rng.uniform(size=(y1 - y0, x1 - x0)) < 0.4
    number[y0:y1, x0:x1][chosen] = np.arange(chosen.sum())
    depth = np.zeros((chosen.sum(), 9), np.float32)
    triangle = np.full((chosen.sum(), 9), -1, np.int32)
    raster_places(screen, faces, 5, BOX, number, depth, triangle)
    # The middle of a pixel is the middle one of its nine.
    finer_screen = np.column_stack([3.0 * screen[:, :2] + 1.0, screen[:, 2]])
    finer_depth, finer_triangle = draw(finer_screen, faces, (3 * HEIGHT, 3 * WIDTH))
    v, u = np.nonzero(chosen)
    for m in range(9):
        row, column = 3 * (v + y0) + m // 3, 3 * (u + x0) + m % 3
        found = finer_triangle[row, column]
        agrees = np.where(found < 0, -1, found + 5) == triangle[:, m]
        # A place on a border between two triangles may be of either.
        assert agrees.mean() > 0.999
        np.testing.assert_allclose(depth[:, m], finer_depth[row, column], rtol=1e-5)


def test_what_was_nearer_before_stays(scene):
    screen, faces, _ = scene
    number = np.arange(HEIGHT * WIDTH, dtype=np.int32).reshape(HEIGHT, WIDTH)
    depth = np.full((HEIGHT * WIDTH, 9), 1.0 / 400.0, np.float32)
    triangle = np.full((HEIGHT * WIDTH, 9), -1, np.int32)
    raster_places(screen, faces, 0, BOX, number, depth, triangle)
    assert (triangle >= 0).any()
    assert (1.0 / depth[triangle >= 0] < 400.001).all()
