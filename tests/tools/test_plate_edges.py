"""Places on the edges of a plate, looked up in the cells of its markers."""

import numpy as np
import pytest

from navapp.geometry.transform import FloatArray, rotation_from_vector
from navapp.tools.paper import count_parameters
from navapp.tools.plate import Plate
from navapp.tools.plate_edges import PlateEdges, find_paper_slopes, find_plate_edges

PLATES = {
    "flat": Plate(),
    "folded": Plate(first_id=20, columns=1, rows=2, faces=3, fold_deg=50.0),
    "fine": Plate("DICT_6X6_50", 3, columns=2, rows=1, square_mm=18.0, marker_mm=13.0),
}


@pytest.fixture(params=PLATES)
def plate(request: pytest.FixtureRequest) -> Plate:
    return PLATES[request.param]


def cells_of(plate: Plate, edges: PlateEdges) -> tuple[FloatArray, FloatArray]:
    """(N, 2) places in cells from their markers' upper left corners, and normals in the face."""
    per_face = plate.columns * plate.rows
    corners = plate.marker_corners_mm[edges.face, edges.marker % per_face, 0]
    cell_mm = plate.marker_mm / plate.n_cells
    turns = plate.plate_from_faces[edges.face, :3, :3]
    normals = np.einsum("nji,nj->ni", turns, edges.normals)
    np.testing.assert_allclose(normals[:, 2], 0.0, atol=1e-12)
    return (edges.flat_mm - corners) / cell_mm, normals[:, :2]


def is_black(plate: Plate, marker: int, cell: FloatArray) -> bool:
    """Whether a place in cells is black; white around the marker."""
    n = plate.n_cells
    column, row = np.floor(cell).astype(int)
    if not (0 <= column < n and 0 <= row < n):
        return False
    return bool(plate.black_cells(plate.ids[marker])[row, column])


def test_every_place_has_white_before_it_and_black_behind(plate: Plate) -> None:
    edges = find_plate_edges(plate)
    places, normals = cells_of(plate, edges)
    for place, normal, marker in zip(places, normals, edges.marker, strict=True):
        assert not is_black(plate, marker, place + 0.2 * normal)
        assert is_black(plate, marker, place - 0.2 * normal)


def test_no_edge_is_left_out(plate: Plate) -> None:
    edges = find_plate_edges(plate)
    cell_mm = plate.marker_mm / plate.n_cells
    for marker, number in enumerate(plate.ids):
        black = np.pad(plate.black_cells(number), 1).astype(int)
        n_sides = sum(np.abs(np.diff(black, axis=axis)).sum() for axis in (0, 1))
        own = edges.marker == marker
        # The first of an edge's places lies half a step from its beginning.
        length_mm = sum(
            2.0 * np.count_nonzero(edges.edge == edge) * edges.end_mm[edges.edge == edge].min()
            for edge in np.unique(edges.edge[own])
        )
        assert length_mm / cell_mm == pytest.approx(n_sides)


def test_places_lie_on_their_faces_in_the_plates_frame(plate: Plate) -> None:
    edges = find_plate_edges(plate)
    flat = np.column_stack([edges.flat_mm, np.zeros(len(edges.flat_mm)), np.ones(len(edges.face))])
    placed = np.einsum("nij,nj->ni", plate.plate_from_faces[edges.face], flat)
    np.testing.assert_allclose(edges.points_mm, placed[:, :3], atol=1e-12)


def test_what_is_clear_ends_at_the_next_edge(plate: Plate) -> None:
    edges = find_plate_edges(plate)
    cell_mm, step = plate.marker_mm / plate.n_cells, 1.0
    places, normals = cells_of(plate, edges)
    for edge in np.unique(edges.edge):
        own = np.flatnonzero(edges.edge == edge)
        nearest_mm = np.inf
        for place, normal in zip(places[own], normals[own], strict=True):
            for way in (1.0, -1.0):
                here = place + 0.5 * way * normal
                first, n = is_black(plate, edges.marker[own[0]], here), 0
                while is_black(plate, edges.marker[own[0]], here) == first and n < 10:
                    here, n = here + step * way * normal, n + 1
                # White that goes on ends where the marker's square does.
                nearest_mm = min(nearest_mm, n * cell_mm if n < 10 else plate.margin_mm)
        assert edges.clear_mm[own] == pytest.approx(nearest_mm, abs=1e-9)


def test_ends_are_those_of_the_edge(plate: Plate) -> None:
    edges = find_plate_edges(plate)
    places, normals = cells_of(plate, edges)
    cell_mm = plate.marker_mm / plate.n_cells
    for place, normal, end_mm, marker in zip(
        places, normals, edges.end_mm, edges.marker, strict=True
    ):
        along = np.abs(normal[::-1])
        for way in (1.0, -1.0):
            before_end = place + way * (end_mm / cell_mm - 0.01) * along
            assert not is_black(plate, marker, before_end + 0.2 * normal)
            assert is_black(plate, marker, before_end - 0.2 * normal)


def test_border_places_lie_round_their_marker(plate: Plate) -> None:
    edges = find_plate_edges(plate)
    places, _ = cells_of(plate, edges)
    on_border = (np.abs(places - 0.5 * plate.n_cells).max(axis=1) * 2.0) > plate.n_cells - 1e-6
    np.testing.assert_array_equal(edges.is_border, on_border)


def test_a_side_is_one_marker_and_one_direction(plate: Plate) -> None:
    edges = find_plate_edges(plate)
    _, normals = cells_of(plate, edges)
    groups = {
        (marker, *np.rint(normal).astype(int))
        for marker, normal in zip(edges.marker, normals, strict=True)
    }
    assert len(np.unique(edges.side)) == len(groups) == 4 * len(plate.ids)
    for side in np.unique(edges.side):
        own = edges.side == side
        assert len(np.unique(edges.marker[own])) == 1
        np.testing.assert_allclose(normals[own], np.tile(normals[own][0], (own.sum(), 1)))


def printed(plate: Plate, edges: PlateEdges, paper: FloatArray) -> FloatArray:
    """(N, 3) the places on paper that differs from the design, as `paper.py` describes it."""
    (stretch_x, stretch_y, shear), left = paper[:3], paper[3:]
    n_markers = len(plate.ids)
    shifts, folds = left[: 2 * n_markers].reshape(-1, 2), left[2 * n_markers :].reshape(-1, 6)
    places = []
    for (x, y), face, marker in zip(edges.flat_mm, edges.face, edges.marker, strict=True):
        flat = [x + stretch_x * x + shear * y, y + stretch_y * y, 0.0] + np.r_[shifts[marker], 0.0]
        pose = plate.plate_from_faces[face]
        arm, middle = pose[:3, :3] @ flat, pose[:3, 3]
        if face > 0:
            fold = folds[face - 1]
            arm, middle = rotation_from_vector(fold[3:]) @ arm, middle + fold[:3]
        places.append(middle + arm)
    return np.array(places)


def test_paper_slopes_are_those_of_the_printed_places(plate: Plate) -> None:
    edges = find_plate_edges(plate)
    slopes = find_paper_slopes(plate, edges)
    n = count_parameters(plate)
    assert slopes.shape == (len(edges.face), 3, n)
    np.testing.assert_allclose(printed(plate, edges, np.zeros(n)), edges.points_mm, atol=1e-12)
    small = 1e-5
    for number in range(n):
        paper = small * np.eye(n)[number]
        moved = printed(plate, edges, paper) - printed(plate, edges, -paper)
        np.testing.assert_allclose(slopes[:, :, number], moved / (2.0 * small), atol=1e-6)
