"""Triangle meshes of implicit solids: naive surface nets on a grid, then Newton onto the surface.

One vertex per cell that the surface crosses, one quadrilateral per grid edge that it crosses
(Gibson 1998, "Constrained elastic surface nets"). Cells in which the surface has more than one
sheet would give edges shared by four faces; their samples are repaired first, so the result is
always a closed manifold.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.mesh import IntArray, TriangleMesh
from navapp.geometry.transform import FloatArray
from sim_devices.implicit import Field, compute_gradient

BoolArray = NDArray[np.bool_]

CORNERS = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
EDGES = np.array(
    [
        [a, b]
        for a in range(8)
        for b in range(a + 1, 8)
        if np.abs(CORNERS[a] - CORNERS[b]).sum() == 1
    ]
)


@dataclass(frozen=True, slots=True, eq=False)
class Grid:
    """A regular lattice of sample points."""

    origin_mm: FloatArray  # (3,) first point
    spacing_mm: FloatArray  # (3,) along x, y, z
    shape: tuple[int, int, int]  # number of points along x, y, z

    def points(self, index: NDArray[np.intp]) -> FloatArray:
        """(N, 3) positions of integer or fractional indices (N, 3)."""
        result: FloatArray = self.origin_mm + index * self.spacing_mm
        return result


def make_grid(lower_mm: FloatArray, upper_mm: FloatArray, spacing_mm: float) -> Grid:
    """A cubic lattice that covers the box."""
    counts = np.ceil((upper_mm - lower_mm) / spacing_mm).astype(int) + 1
    return Grid(lower_mm, np.full(3, spacing_mm), (int(counts[0]), int(counts[1]), int(counts[2])))


def sample(field: Field, grid: Grid, stride: int = 4, chunk: int = 1 << 16) -> FloatArray:
    """(nx, ny, nz) values: exact in blocks near the surface, interpolated linearly elsewhere.

    Blocks are `stride` cells wide. A block is near when a corner's value is below 1.5 times half
    its diagonal, which is safe for fields that grow by up to 1.5 per mm.
    """
    counts = [-(-(n - 1) // stride) + 1 for n in grid.shape]
    index = np.stack(np.meshgrid(*[np.arange(n) for n in counts], indexing="ij"), -1)
    coarse = field(grid.points(index.reshape(-1, 3) * stride)).reshape(counts)
    limit = 1.5 * 0.5 * stride * float(np.linalg.norm(grid.spacing_mm))
    near_node = np.abs(coarse) < limit
    near_block = np.zeros([n - 1 for n in counts], dtype=bool)
    for corner in CORNERS:
        near_block |= near_node[_shift_slices(corner, near_block.shape)]
    values = coarse
    block_of = []
    for axis, n in enumerate(grid.shape):
        fine = np.arange(n)
        block = np.minimum(fine // stride, counts[axis] - 2)
        weight = ((fine - block * stride) / stride).reshape(
            [-1 if a == axis else 1 for a in range(3)]
        )
        values = values.take(block, axis) * (1.0 - weight) + values.take(block + 1, axis) * weight
        block_of.append(block)
    near = np.flatnonzero(near_block[np.ix_(*block_of)])
    flat = values.reshape(-1)
    for start in range(0, len(near), chunk):
        part = near[start : start + chunk]
        flat[part] = field(grid.points(np.stack(np.unravel_index(part, grid.shape), -1)))
    return flat.reshape(grid.shape)


def _shift_slices(corner: NDArray[np.intp], shape: tuple[int, ...]) -> tuple[slice, ...]:
    return tuple(slice(int(c), int(c) + n) for c, n in zip(corner, shape, strict=True))


@lru_cache(maxsize=1)
def _single_sheet() -> BoolArray:
    """(256,) whether the inside corners, and the outside corners, of a cell hang together."""
    result = np.zeros(256, dtype=bool)
    for code in range(256):
        pieces = 0
        left = set(range(8))
        while left:
            stack = [left.pop()]
            pieces += 1
            while stack:
                a = stack.pop()
                for b in [b for edge in EDGES if a in edge for b in edge if b in left]:
                    if (code >> a & 1) == (code >> int(b) & 1):
                        left.remove(b)
                        stack.append(int(b))
        result[code] = pieces <= 2
    return result


def compute_cell_codes(inside: BoolArray) -> NDArray[np.uint8]:
    """(nx-1, ny-1, nz-1) bit c set when corner c of the cell is inside."""
    cells = tuple(n - 1 for n in inside.shape)
    codes = np.zeros(cells, dtype=np.uint8)
    for bit, corner in enumerate(CORNERS):
        codes |= inside[_shift_slices(corner, cells)].astype(np.uint8) << np.uint8(bit)
    return codes


def repair_ambiguous(values: FloatArray) -> FloatArray:
    """Values with the weakest corner of every many-sheeted cell moved to the other side.

    After a few rounds corners only move outwards, so that it ends whatever the samples are.
    """
    values = values.copy()
    flat = values.reshape(-1)
    rounds = 0
    while True:
        bad = np.argwhere(~_single_sheet()[compute_cell_codes(values < 0.0)])
        if len(bad) == 0:
            return values
        corners = np.ravel_multi_index(
            tuple(np.moveaxis(bad[:, None] + CORNERS[None], -1, 0)), values.shape
        )
        strength = np.abs(flat[corners])
        if rounds >= 5:
            strength[flat[corners] >= 0.0] = np.inf
        weakest = np.unique(corners[np.arange(len(bad)), strength.argmin(axis=1)])
        flat[weakest] = np.where(flat[weakest] < 0.0, 1e-6, -1e-6) - 0.05 * flat[weakest]
        rounds += 1


def make_surface_net(values: FloatArray, grid: Grid) -> TriangleMesh:
    """The closed zero level of sampled values, negative inside; coordinates in mm.

    Raises:
        ValueError: no surface, or the solid touches the border of the grid.
    """
    values = repair_ambiguous(values)
    inside = values < 0.0
    border = [inside.take(side, axis).any() for axis in range(3) for side in (0, -1)]
    if any(border) or not inside.any():
        raise ValueError("the solid must lie inside the grid and not be empty")
    codes = compute_cell_codes(inside)
    cells = np.argwhere((codes != 0) & (codes != 255))
    number = np.full(codes.shape, -1, dtype=np.int32)
    number[tuple(cells.T)] = np.arange(len(cells), dtype=np.int32)
    corner_values = values[tuple(np.moveaxis(cells[:, None] + CORNERS[None], -1, 0))]
    start, end = corner_values[:, EDGES[:, 0]], corner_values[:, EDGES[:, 1]]
    crossed = (start < 0.0) != (end < 0.0)
    fraction = np.where(crossed, start / np.where(crossed, start - end, 1.0), 0.0)[..., None]
    crossing = CORNERS[EDGES[:, 0]] * (1.0 - fraction) + CORNERS[EDGES[:, 1]] * fraction
    local = (crossing * crossed[..., None]).sum(1) / crossed.sum(1)[:, None]
    vertices = grid.points(cells + local)
    faces = np.concatenate([_faces_across(inside, number, vertices, axis) for axis in range(3)])
    return TriangleMesh(vertices, faces)


def _faces_across(inside: BoolArray, number: IntArray, vertices: FloatArray, axis: int) -> IntArray:
    """(F, 3) triangles of the quadrilaterals around crossed grid edges along the axis."""
    head = np.moveaxis(inside, axis, 0)
    cells = np.moveaxis(number, axis, 0)
    at = np.argwhere(head[:-1, 1:-1, 1:-1] != head[1:, 1:-1, 1:-1])
    i, j, k = at[:, 0], at[:, 1], at[:, 2]
    quad = np.stack(
        [cells[i, j, k], cells[i, j + 1, k], cells[i, j + 1, k + 1], cells[i, j, k + 1]], axis=1
    )
    # Moving axis 1 to the front turns the frame left-handed; the sign of the crossing decides too.
    reverse = head[i, j + 1, k + 1] == (axis == 1)
    quad[reverse] = quad[reverse][:, ::-1]
    a, b, c, d = (vertices[quad[:, n]] for n in range(4))
    flip = np.linalg.norm(a - c, axis=1) > np.linalg.norm(b - d, axis=1)
    quad[flip] = np.roll(quad[flip], 1, axis=1)
    return np.concatenate([quad[:, [0, 1, 2]], quad[:, [0, 2, 3]]])


def mesh_solid(
    field: Field, lower_mm: FloatArray, upper_mm: FloatArray, cell_mm: float
) -> TriangleMesh:
    """Closed manifold mesh of the largest piece of a solid, its vertices on the surface."""
    grid = make_grid(lower_mm, upper_mm, cell_mm)
    mesh = make_surface_net(sample(field, grid), grid).largest_component()
    vertices = relax(mesh.vertices_mm, mesh.faces)
    return TriangleMesh(move_onto_surface(field, vertices, cell_mm), mesh.faces)


def relax(vertices: FloatArray, faces: IntArray) -> FloatArray:
    """Vertices moved to the middle between themselves and the mean of their neighbours, twice."""
    starts, ends = faces.reshape(-1), np.roll(faces, -1, axis=1).reshape(-1)
    count = np.bincount(starts, minlength=len(vertices))[:, None]
    for _ in range(2):
        total = np.stack(
            [np.bincount(starts, vertices[ends, c], len(vertices)) for c in range(3)], axis=1
        )
        vertices = 0.5 * vertices + 0.5 * total / count
    return vertices


def move_onto_surface(field: Field, vertices: FloatArray, cell_mm: float) -> FloatArray:
    """Vertices moved onto the surface: three Newton steps of at most half a cell.

    The slope is taken once: the way is so short that the first direction does.
    """
    slope = compute_gradient(field, vertices)
    squared = np.maximum(np.einsum("ij,ij->i", slope, slope), 0.05)
    limit = 0.5 * cell_mm / np.sqrt(squared)
    for _ in range(3):
        step = np.clip(field(vertices) / squared, -limit, limit)
        vertices = vertices - step[:, None] * slope
    return vertices
