"""Soft tissue round the opened knee, and the drape: height fields over the bones.

Everything here is in the table's frame: x to the right in the picture, y down, z away from the
cameras. Heights are -z, towards the cameras.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import FloatArray
from sim_devices.raster_kernels import raster_triangles
from sim_devices.textures import make_smooth_noise

CELL_MM = 1.25
# How far the ground is known on which the drape lies, and where the visible sheet ends under it.
GROUND_HALF_MM = 150.0
SHEET_RADIUS_MM = 100.0
# Bone deeper than this below the most prominent point stays covered.
EXPOSED_DEPTH_MM = 46.0
SKIN_BELOW_TOP_MM = 4.0
DRAPE_HOLE_MM = 75.0
DRAPE_GAP_MM = 5.0
# Distance over which the wound's wall reaches the skin.
WALL_MM = 24.0
# Tissue stays so far away from what the surgeon has freed.
FREED_MM = 5.0


@dataclass(frozen=True, slots=True, eq=False)
class Sheet:
    """A surface with values per vertex for the renderer."""

    mesh: TriangleMesh  # in the table's frame
    mark: FloatArray  # (V,) 0 flesh, 1 skin (of the tissue); 1 stained (of the drape)
    exposure: FloatArray  # (V,) 0 to 1, light that reaches the vertex


def make_tissue(
    exposed_bones: Sequence[TriangleMesh],
    bones: Sequence[TriangleMesh],
    seed: int,
    freed: Sequence[TriangleMesh] = (),
) -> Sheet:
    """The sheet of skin, fat and muscle with its opening, far beyond the drape's hem.

    Where the border of the opening lies on bone it either rises from the bone's own surface (zero
    thickness) or ends as a lip of some millimetres; where it lies beside the bone, a gap opens.

    Args:
        exposed_bones: the parts that the surgeon laid bare, in the table's frame at the start.
        bones: all of them; what is not laid bare stays covered.
        seed: of the border.
        freed: what no tissue reaches over, up to its rim: sawn faces, an everted patella.
    """
    grid = _Grid(GROUND_HALF_MM, CELL_MM)
    bare = _heights(exposed_bones, grid)
    bone = _heights(bones, grid)
    top = float(np.nanmax(bare))
    exposed = bare > top - EXPOSED_DEPTH_MM
    border = _border_distance(exposed, grid, seed)
    if freed:
        border = np.minimum(border, _outside_mm(~np.isnan(_heights(freed, grid)), grid) - FREED_MM)
    ground = _ground(np.where(exposed, bare, np.nan), top)
    points = grid.points
    relief = _field(points, 9.0, seed + 1, grid) * 0.9 + _field(points, 4.0, seed + 2, grid) * 0.45
    height = _tissue_height(border, ground, relief, top, grid, seed)
    height = _below_bone(height, bone, border)
    cover = 3.0 * np.clip(border / 6.0, 0.0, 1.0)
    height = np.where((border > 0.0) & (bone + cover > height), bone + cover, height)
    fringe = 15.0 + 6.0 * _field(points, 34.0, seed + 3, grid)
    skin = np.clip(0.5 + (border - fringe) / 3.0, 0.0, 1.0)
    # Deep inside the opening little light arrives.
    floor = np.clip((top - 16.0 - height) / 26.0, 0.0, 1.0)
    exposure = 1.0 - 0.6 * floor * (border < 8.0)
    return Sheet(grid.mesh(height), skin.ravel(), exposure.ravel())


def trim(sheet: Sheet) -> Sheet:
    """What of the tissue can ever show from under the drape."""
    mesh = sheet.mesh
    near = np.hypot(mesh.vertices_mm[:, 0], mesh.vertices_mm[:, 1]) < SHEET_RADIUS_MM
    new_index = np.cumsum(near, dtype=np.int32) - np.int32(1)
    faces = new_index[mesh.faces[near[mesh.faces].all(axis=1)]]
    kept = TriangleMesh(mesh.vertices_mm[near], faces, mesh.normals[near])
    return Sheet(kept, sheet.mark[near], sheet.exposure[near])


def make_drape(tissue: Sheet, skin_height_mm: float, seed: int) -> Sheet:
    """A cloth with an irregular hole: rings of vertices from the hole's hem outwards.

    Args:
        tissue: what it lies on, not trimmed.
        skin_height_mm: towards the cameras, of the skin at the hem.
        seed: of the hem and the folds.
    """
    columns, rows = 240, 78
    angle = np.linspace(0.0, 2.0 * np.pi, columns, endpoint=False)
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    hem = DRAPE_HOLE_MM + 4.0 * make_smooth_noise(circle * 60.0, 70.0, seed)
    # Narrow rings at the hem, wide ones outside; none wider than 9 mm.
    step = np.minimum(0.8 * 1.09 ** np.arange(rows), 9.0)
    outwards = np.concatenate([[0.0], np.cumsum(step)])[:rows]
    radius = hem[None, :] + outwards[:, None]
    x, y = radius * np.cos(angle), radius * np.sin(angle)
    flat = np.column_stack([x.ravel(), y.ravel()])
    folds = make_smooth_noise(flat, 95.0, seed + 1) * 6.0
    # Creases: the absolute value of a smooth field has sharp valleys.
    creases = np.abs(make_smooth_noise(flat, 70.0, seed + 2)) * 7.0
    small = make_smooth_noise(flat, 22.0, seed + 3) * 0.7
    distance = np.repeat(outwards, columns)
    calm = np.clip(distance / 45.0, 0.0, 1.0)
    roll = 4.5 * np.exp(-(((distance - 4.0) / 4.0) ** 2)) - 4.0 * np.exp(-distance / 1.5)
    slope = -0.22 * distance - 0.0004 * distance**2
    height = skin_height_mm + 7.0 + roll + calm * (folds + creases) + small * calm + slope
    lifted = np.maximum(height, _raise_height(tissue, flat) + roll)
    vertices = np.column_stack([flat, -lifted])
    mesh = TriangleMesh(vertices, _ring_faces(rows, columns))
    stain = make_smooth_noise(flat, 50.0, seed + 5) - 1.9 + 0.7 * np.exp(-distance / 40.0)
    valley = np.clip(1.0 - creases / 5.0, 0.0, 1.0) * calm
    return Sheet(mesh, np.clip(0.5 + 2.0 * stain, 0.0, 1.0), 1.0 - 0.35 * valley)


class _Grid:
    """A square grid of the table's x and y, row by row."""

    def __init__(self, half_mm: float, cell_mm: float) -> None:
        self.cell_mm = cell_mm
        self.half_mm = half_mm
        self.size = round(2.0 * half_mm / cell_mm) + 1
        axis = np.linspace(-half_mm, half_mm, self.size)
        self.x, self.y = np.meshgrid(axis, axis)
        self.points = np.column_stack([self.x.ravel(), self.y.ravel()])

    def mesh(self, height: FloatArray) -> TriangleMesh:
        """The height field as triangles that face the cameras."""
        vertices = np.column_stack([self.points, -height.ravel()])
        index = np.arange(self.size**2, dtype=np.int32).reshape(self.size, self.size)
        a, b = index[:-1, :-1].ravel(), index[:-1, 1:].ravel()
        c, d = index[1:, :-1].ravel(), index[1:, 1:].ravel()
        faces = np.concatenate([np.column_stack([a, c, b]), np.column_stack([b, c, d])])
        return TriangleMesh(vertices, faces)


def _raise_height(tissue: Sheet, places: FloatArray) -> FloatArray:
    """(N,) the tissue's greatest height near places (x, y), some millimetres up; -inf beyond it."""
    import cv2
    from scipy.ndimage import map_coordinates

    grid = _Grid(GROUND_HALF_MM, CELL_MM)
    height = -tissue.mesh.vertices_mm[:, 2].reshape(grid.size, grid.size)
    near = np.asarray(cv2.dilate(height, np.ones((7, 7), np.uint8)), dtype=np.float64)
    cells = (places[:, ::-1].T + grid.half_mm) / grid.cell_mm
    # The leg moves under the cloth, most where it is far from the knee.
    slack = DRAPE_GAP_MM + 0.22 * np.maximum(np.hypot(*places.T) - DRAPE_HOLE_MM, 0.0)
    raised: FloatArray = map_coordinates(near, cells, order=1, mode="nearest") + slack
    return np.where((np.abs(places) < grid.half_mm).all(axis=1), raised, -np.inf)


def _ring_faces(rows: int, columns: int) -> NDArray[np.int32]:
    """Faces between rings of vertices, facing the cameras when the rings grow outwards."""
    index = np.arange(rows * columns, dtype=np.int32).reshape(rows, columns)
    following = np.roll(index, -1, axis=1)
    a, b = index[:-1].ravel(), following[:-1].ravel()
    c, d = index[1:].ravel(), following[1:].ravel()
    return np.concatenate([np.column_stack([a, b, c]), np.column_stack([b, d, c])])


def _heights(bones: Sequence[TriangleMesh], grid: _Grid) -> FloatArray:
    """(n, n) height of the bones, seen along z; NaN beside them."""
    # The z-buffer keeps the largest positive value: shift all heights above zero.
    lift = 1000.0
    keys = np.zeros((grid.size, grid.size), dtype=np.float32)
    triangle = np.full(keys.shape, -1, dtype=np.int32)
    box = np.array([0, 0, grid.size, grid.size], dtype=np.int64)
    for bone in bones:
        screen = np.empty((len(bone.vertices_mm), 3))
        screen[:, :2] = (bone.vertices_mm[:, :2] + grid.half_mm) / grid.cell_mm
        screen[:, 2] = lift - bone.vertices_mm[:, 2]
        raster_triangles(screen, np.array(bone.faces), 0, box, keys, triangle)
    return np.where(triangle >= 0, keys.astype(np.float64) - lift, np.nan)


def _field(points: FloatArray, wavelength_mm: float, seed: int, grid: _Grid) -> FloatArray:
    return make_smooth_noise(points, wavelength_mm, seed).reshape(grid.size, grid.size)


def _border_distance(exposed: NDArray[np.bool_], grid: _Grid, seed: int) -> FloatArray:
    """Signed distance (mm) to the border of the opening, positive in the tissue.

    The opening is the exposed bone, its notches closed, with a border that wanders inwards and
    outwards.
    """
    import cv2

    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (25, 25))
    closed = cv2.morphologyEx(exposed.astype(np.uint8), cv2.MORPH_CLOSE, kernel)
    distance = _outside_mm(closed > 0, grid)
    points = grid.points
    wander = 4.6 * _field(points, 32.0, seed, grid) + 1.9 * _field(points, 10.0, seed + 9, grid)
    result: FloatArray = distance + 4.0 + wander
    return result


def _outside_mm(mask: NDArray[np.bool_], grid: _Grid) -> FloatArray:
    """(n, n) signed distance to the border of a mask, positive outside."""
    import cv2

    outside, inside = (
        cv2.distanceTransform(side.astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
        for side in (~mask, mask)
    )
    distance: FloatArray = (outside.astype(np.float64) - inside) * grid.cell_mm
    return distance


def _ground(bone: FloatArray, top: float) -> FloatArray:
    """Bone heights carried on beyond the bone: the nearest rim, smoothed."""
    import cv2
    from scipy.ndimage import distance_transform_edt

    missing = np.isnan(bone)
    row, column = distance_transform_edt(missing, return_distances=False, return_indices=True)
    carried = np.maximum(bone[row, column], top - EXPOSED_DEPTH_MM)
    # The rim itself falls away steeply: take what lies a little inside of it.
    raised = cv2.dilate(carried, np.ones((7, 7), np.uint8))
    smooth: FloatArray = np.asarray(cv2.GaussianBlur(raised, (0, 0), 4.0), dtype=np.float64)
    return np.where(missing, smooth - 3.0, np.maximum(carried, smooth - 6.0))


def _tissue_height(
    border: FloatArray,
    ground: FloatArray,
    relief: FloatArray,
    top: float,
    grid: _Grid,
    seed: int,
) -> FloatArray:
    """From the border up the wound's wall to the skin, which sinks under the drape."""
    points = grid.points
    outward = np.maximum(border, 0.0)
    lip = np.clip(1.4 * _field(points, 40.0, seed + 4, grid), 0.0, 2.2)
    thickness = lip * (1.0 - np.exp(-outward / 0.8)) + 3.5 * (1.0 - np.exp(-outward / 9.0))
    radius = np.hypot(grid.x, grid.y)
    skin = top - SKIN_BELOW_TOP_MM - 0.0016 * radius**2 + 1.2 * _field(points, 60.0, seed + 5, grid)
    skin -= np.clip(radius - DRAPE_HOLE_MM - 4.0, 0.0, None) * 0.9
    share = np.clip(outward / WALL_MM, 0.0, 1.0)
    share = share**2 * (3.0 - 2.0 * share)
    # Flesh is lumpy, skin is not, and a flush border must stay flush.
    lumps = relief * np.clip(outward / 4.0, 0.0, 1.0) * (1.0 - 0.85 * share)
    height: FloatArray = (1.0 - share) * (ground + thickness) + share * skin + lumps
    return height


def _below_bone(height: FloatArray, bone: FloatArray, border: FloatArray) -> FloatArray:
    """Inside the opening the sheet dives under the bone and forms the floor of notch and gap."""
    inside = np.maximum(-border, 0.0)
    dive = np.minimum(2.5 * inside, 30.0)
    sunk = np.where(border < 0.0, height - dive, height)
    below = np.where(np.isnan(bone), np.inf, bone - np.minimum(1.5 * inside, 6.0))
    result: FloatArray = np.where(border < 0.0, np.minimum(sunk, below), sunk)
    return result
