import numpy as np

from navapp.geometry.mesh import TriangleMesh
from navapp.preop.cut_ends import on_flat_ends, on_open_borders
from tests.geometry.shapes import sphere

BALL = sphere(30.0, 30)


def test_a_flat_end_is_found_and_a_round_one_is_none() -> None:
    assert not on_flat_ends(BALL).any()
    level = np.minimum(BALL.vertices_mm[:, 2], 20.0)
    cut = TriangleMesh(np.column_stack([BALL.vertices_mm[:, :2], level]), BALL.faces)
    np.testing.assert_array_equal(on_flat_ends(cut), BALL.vertices_mm[:, 2] > 19.95)


def test_an_open_border_is_where_a_triangle_has_no_neighbour() -> None:
    assert not on_open_borders(BALL).any()
    opened = TriangleMesh(BALL.vertices_mm, BALL.faces[1:])
    assert set(np.flatnonzero(on_open_borders(opened))) == set(BALL.faces[0].tolist())
