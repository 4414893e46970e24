"""Shapes of instruments and of the hand that holds them."""

import numpy as np

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import FloatArray
from sim_devices.textures import make_smooth_noise

DRILL_RADIUS_MM = 4.2
_DRILL_LENGTH_MM = 125.0
# A direction that no instrument has.
_ODD = np.array([1.0, 1.6180339887, 2.6180339887])


def make_tube(centres: FloatArray, radii: FloatArray, columns: int = 24) -> TriangleMesh:
    """A closed tube along a path of centres (N, 3) with radii (N,) or (N, columns)."""
    along = np.gradient(centres, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    side = np.cross(along, _ODD / np.linalg.norm(_ODD))
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    other = np.cross(along, side)
    angle = np.linspace(0.0, 2.0 * np.pi, columns, endpoint=False)
    spread = np.broadcast_to(radii if radii.ndim == 2 else radii[:, None], (len(centres), columns))
    ring = side[:, None] * np.cos(angle)[:, None] + other[:, None] * np.sin(angle)[:, None]
    vertices = (centres[:, None] + spread[..., None] * ring).reshape(-1, 3)
    index = np.arange(len(vertices)).reshape(len(centres), columns)
    following = np.roll(index, -1, axis=1)
    a, b = index[:-1].ravel(), following[:-1].ravel()
    c, d = index[1:].ravel(), following[1:].ravel()
    sides = [np.column_stack([a, b, c]), np.column_stack([b, d, c])]
    first, last = len(vertices), len(vertices) + 1
    caps = [
        np.column_stack([following[0], index[0], np.full(columns, first)]),
        np.column_stack([index[-1], following[-1], np.full(columns, last)]),
    ]
    vertices = np.concatenate([vertices, centres[[0, -1]]])
    return TriangleMesh(vertices, np.concatenate([*sides, *caps]).astype(np.int32))


def merge_meshes(meshes: list[TriangleMesh]) -> TriangleMesh:
    """Several meshes as one."""
    starts = np.cumsum([0, *(len(mesh.vertices_mm) for mesh in meshes)])
    return TriangleMesh(
        np.concatenate([mesh.vertices_mm for mesh in meshes]),
        np.concatenate([m.faces + np.int32(s) for m, s in zip(meshes, starts, strict=False)]),
        np.concatenate([mesh.normals for mesh in meshes]),
    )


def make_drill_mesh() -> TriangleMesh:
    """A twist drill with its tip at the origin and its shaft along -z."""
    z = np.linspace(0.0, _DRILL_LENGTH_MM, 160)
    radius = np.minimum(DRILL_RADIUS_MM, 0.05 + 1.1 * z)
    angle = np.linspace(0.0, 2.0 * np.pi, 28, endpoint=False)
    flute = np.cos(2.0 * (angle[None, :] - 2.0 * np.pi * z[:, None] / 26.0))
    groove = np.where(z[:, None] < 65.0, 0.34 * np.clip(flute - 0.1, 0.0, 1.0), 0.0)
    centres = np.column_stack([np.zeros_like(z), np.zeros_like(z), -z])
    return make_tube(centres, radius[:, None] * (1.0 - groove), 28)


def make_chuck_mesh() -> TriangleMesh:
    """The chuck and nose of the drilling machine, in the drill's frame but not turning."""
    z = np.linspace(95.0, 190.0, 40)
    radius = np.interp(
        z, [95.0, 97.0, 112.0, 114.0, 150.0, 190.0], [6.0, 9.0, 11.0, 15.0, 17.0, 20.0]
    )
    return make_tube(np.column_stack([np.zeros_like(z), np.zeros_like(z), -z]), radius, 36)


def hand_meshes() -> tuple[TriangleMesh, TriangleMesh]:
    """A gloved hand and the steel instrument in it; the instrument's tip is at the origin.

    In the table's directions: the hand comes from the lower right and from above.
    """
    axis = np.array([0.72, 0.48, -0.50])
    axis /= np.linalg.norm(axis)
    s = np.linspace(0.0, 165.0, 60)
    tip = np.array([-22.0, -16.0, 0.0])
    rod = np.interp(s, [0.0, 4.0, 12.0, 60.0, 66.0, 165.0], [0.4, 1.8, 2.6, 3.0, 6.5, 7.5])
    tool = make_tube(tip + s[:, None] * axis, rod, 28)
    u, v = across(axis)
    grip = tip + 62.0 * axis
    pieces = []
    for k, turn in enumerate((0.2, 1.25, 2.2, 3.3)):
        around = np.cos(turn) * u + np.sin(turn) * v
        start = grip + (9.0 * k) * axis + 11.0 * around
        knuckle = start + 30.0 * axis + 24.0 * around
        palm = tip + 135.0 * axis + np.array([12.0, 10.0, -4.0])
        pieces.append(_limb([start, 0.5 * (start + knuckle) + 4.0 * around, knuckle, palm], 8.2))
    wrist = tip + 135.0 * axis + np.array([12.0, 10.0, -4.0])
    pieces.append(_limb([wrist - 20.0 * axis, wrist, wrist + np.array([60.0, 60.0, -4.0])], 23.0))
    sleeve = [wrist + np.array([40.0, 42.0, -4.0]), wrist + np.array([330.0, 260.0, 20.0])]
    pieces.append(_limb(sleeve, 27.0))
    return merge_meshes(pieces), tool


def _limb(knots: list[FloatArray], radius: float) -> TriangleMesh:
    """A rounded tube through a few points."""
    from scipy.interpolate import PchipInterpolator

    points = np.array(knots)
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    s = np.linspace(0.0, length[-1], max(24, int(length[-1] / 5.0)))
    path = PchipInterpolator(length, points)(s)
    ends = np.minimum(s, length[-1] - s)
    taper = np.sqrt(np.clip(1.0 - (1.0 - np.minimum(ends / radius, 1.0)) ** 2, 0.01, 1.0))
    wrinkle = 1.0 + 0.03 * make_smooth_noise(path, 14.0, 3)
    return make_tube(path, radius * taper * wrinkle, 24)


def make_bloody_fingers(glove: TriangleMesh) -> FloatArray:
    """(V,) blood on the gloves, more towards the fingers."""
    noise = make_smooth_noise(glove.vertices_mm, 24.0, 8)
    reach = np.exp(-np.linalg.norm(glove.vertices_mm, axis=1) / 70.0)
    stains: FloatArray = np.clip(0.25 * noise + 1.1 * reach - 0.25, 0.0, 1.0)
    return stains


def across(axis: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Two unit vectors across an axis."""
    u = np.cross(axis, _ODD)
    u /= np.linalg.norm(u)
    return u, np.cross(axis, u)
