"""Edges between black and white on a plate: where pictures can be compared with it."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.transform import FloatArray
from navapp.tools.paper import count_parameters
from navapp.tools.plate import Plate

# Places along an edge.
_SPACING_MM = 0.8


@dataclass(frozen=True, slots=True, eq=False)
class PlateEdges:
    """Places on the edges of all faces, mm in the plate's frame."""

    points_mm: FloatArray  # (N, 3)
    normals: FloatArray  # (N, 3) unit, in the face, from black to white
    # (N,) white and black beyond the place along its normal, to the next edge.
    clear_mm: FloatArray
    end_mm: FloatArray  # (N,) to the nearer end of its edge
    face: NDArray[np.intp]  # (N,)
    marker: NDArray[np.intp]  # (N,) counted from the plate's first
    edge: NDArray[np.intp]  # (N,) which straight edge
    side: NDArray[np.intp]  # (N,) which marker, and which of four directions the edge faces
    is_border: NDArray[np.bool_]  # (N,) between a marker's black border and the white around it
    flat_mm: FloatArray  # (N, 2) x and y in the face


@dataclass(frozen=True, slots=True)
class _Edge:
    """A straight edge of a marker; lengths in cells."""

    is_vertical: bool
    at: int  # its column or row
    # first, last: along it.
    first: int
    last: int
    sign: int  # 1: white is at the larger coordinate
    clear: float  # to the nearest edge beside it


class _Numbers(NamedTuple):
    """Of an edge, as of the fields of `PlateEdges`."""

    face: int
    marker: int
    edge: int
    side: int
    is_border: bool


def find_plate_edges(plate: Plate) -> PlateEdges:
    """All edges of a plate, with places less than a millimetre apart."""
    cell_mm = plate.marker_mm / plate.n_cells
    per_face = plate.columns * plate.rows
    parts: list[PlateEdges] = []
    for marker, marker_id in enumerate(plate.ids):
        face = marker // per_face
        corner_mm = plate.marker_corners_mm[face, marker % per_face, 0]
        for edge in _marker_edges(plate.black_cells(marker_id), plate.margin_mm / cell_mm):
            # Both signs of both directions of a marker.
            side = 4 * marker + 2 * edge.is_vertical + (edge.sign > 0)
            numbers = _Numbers(face, marker, len(parts), side, edge.at in (0, plate.n_cells))
            parts.append(_place_edge(edge, cell_mm, corner_mm, plate, numbers))
    names = PlateEdges.__dataclass_fields__
    joined = {name: np.concatenate([getattr(one, name) for one in parts]) for name in names}
    return PlateEdges(**joined)


def _place_edge(
    edge: _Edge,
    cell_mm: float,
    corner_mm: FloatArray,
    plate: Plate,
    numbers: _Numbers,
) -> PlateEdges:
    """Places on one edge of a marker, whose upper left corner lies at `corner_mm` of its face."""
    plate_from_face = plate.plate_from_faces[numbers.face]
    along = np.array([0.0, 1.0] if edge.is_vertical else [1.0, 0.0])
    across = along[::-1]
    length_mm = (edge.last - edge.first) * cell_mm
    steps_mm = _places(length_mm)
    n = len(steps_mm)
    begin_mm = corner_mm + cell_mm * (edge.first * along + edge.at * across)
    flat_mm = begin_mm + steps_mm[:, None] * along
    turn = plate_from_face[:3, :2]
    return PlateEdges(
        flat_mm @ turn.T + plate_from_face[:3, 3],
        np.tile(edge.sign * turn @ across, (n, 1)),
        np.full(n, edge.clear * cell_mm),
        np.minimum(steps_mm, length_mm - steps_mm),
        np.full(n, numbers.face),
        np.full(n, numbers.marker),
        np.full(n, numbers.edge),
        np.full(n, numbers.side),
        np.full(n, numbers.is_border),
        flat_mm,
    )


def _places(length_mm: float) -> FloatArray:
    """From an edge's beginning, mm."""
    n = int(np.ceil(length_mm / _SPACING_MM))
    places: FloatArray = (np.arange(n) + 0.5) / n * length_mm
    return places


def _marker_edges(black: NDArray[np.bool_], around: float) -> Iterator[_Edge]:
    """Edges of one marker; `around` cells of it are white."""
    for is_vertical, cells in ((True, black), (False, black.T)):
        # Rows of `cells` are crossed by the edges that are looked for.
        padded = np.pad(cells, [(0, 0), (1, 1)], constant_values=False).astype(int)
        step = np.diff(padded, axis=1)
        for at in range(step.shape[1]):
            yield from _edges_of_line(is_vertical, at, step, around)


def _edges_of_line(
    is_vertical: bool, at: int, step: NDArray[np.int_], around: float
) -> Iterator[_Edge]:
    """Runs of cells of one line between columns where black and white change the same way."""
    line = step[:, at]
    n = len(line)
    starts = [k for k in range(n) if line[k] != 0 and (k == 0 or line[k - 1] != line[k])]
    for first in starts:
        last = first
        while last < n and line[last] == line[first]:
            last += 1
        clear = min(_clear(step[k], at, around) for k in range(first, last))
        yield _Edge(is_vertical, at, first, last, -int(np.sign(line[first])), clear)


def _clear(steps: NDArray[np.int_], at: int, around: float) -> float:
    """Cells to the nearest other edge of the same row, or to the end of the white around."""
    others = np.flatnonzero(steps)
    others = others[others != at]
    nearest = float(np.abs(others - at).min())
    return min(nearest, around) if at in (0, len(steps) - 1) else nearest


def find_paper_slopes(plate: Plate, edges: PlateEdges) -> FloatArray:
    """(N, 3, P) of the places by the paper's parameters (`paper.py`), mm in the plate's frame."""
    n = len(edges.face)
    rotation = plate.plate_from_faces[edges.face, :3, :3]
    x, y = rotation[:, :, 0], rotation[:, :, 1]
    slopes = np.zeros((n, 3, count_parameters(plate)))
    slopes[:, :, 0] = x * edges.flat_mm[:, :1]
    slopes[:, :, 1] = y * edges.flat_mm[:, 1:]
    slopes[:, :, 2] = x * edges.flat_mm[:, 1:]
    every = np.arange(n)
    slopes[every, :, 3 + 2 * edges.marker] = x
    slopes[every, :, 4 + 2 * edges.marker] = y
    first = 3 + 2 * len(plate.ids)
    for face in range(1, plate.faces):
        of_face = np.flatnonzero(edges.face == face)
        place = first + 6 * (face - 1)
        slopes[of_face, :, place : place + 3] = np.eye(3)
        arms = edges.points_mm[of_face] - plate.plate_from_faces[face, :3, 3]
        for axis in range(3):
            slopes[of_face, :, place + 3 + axis] = np.cross(np.eye(3)[axis], arms)
    return slopes
