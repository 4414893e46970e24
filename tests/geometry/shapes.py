"""Meshes with known answers, and a rig that is anything but ideal."""

import numpy as np

from navapp.geometry.camera import Camera
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import RigidTransform, rotation_from_vector

STRONG = np.array([-0.32, 0.14, 1.1e-3, -8e-4, -0.03, 0.06, 0.02, 0.01, 1e-3, -2e-3, 2e-3, 1e-3])


def cube(size_mm: float = 2.0, centre_mm=(0.0, 0.0, 0.0)) -> TriangleMesh:
    """Twelve triangles, outward."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
    faces = np.array(
        [
            [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
            [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
        ]
    )  # fmt: skip
    return TriangleMesh(corners * 0.5 * size_mm + np.asarray(centre_mm), faces)


def sphere(radius_mm: float = 20.0, n: int = 24, centre_mm=(0.0, 0.0, 0.0)) -> TriangleMesh:
    """A closed sphere of longitudes and latitudes, outward."""
    latitude = np.linspace(0, np.pi, n + 1)[1:-1]
    longitude = np.linspace(0, 2 * np.pi, 2 * n, endpoint=False)
    rings = np.stack(
        [
            np.outer(np.sin(latitude), np.cos(longitude)),
            np.outer(np.sin(latitude), np.sin(longitude)),
            np.outer(np.cos(latitude), np.ones(2 * n)),
        ],
        axis=-1,
    ).reshape(-1, 3)
    vertices = np.vstack([rings, [[0, 0, 1], [0, 0, -1]]]) * radius_mm + np.asarray(centre_mm)
    top, bottom = len(rings), len(rings) + 1
    faces = []
    for i in range(n - 1):
        for j in range(2 * n):
            a, b = i * 2 * n + j, i * 2 * n + (j + 1) % (2 * n)
            if i == 0:
                faces.append((top, a, b))
            if i == n - 2:
                faces.append((bottom, b, a))
            else:
                faces += [(a, a + 2 * n, b), (b, a + 2 * n, b + 2 * n)]
    return TriangleMesh(vertices, np.array(faces))


def camera(distortion=(), width: int = 640, height: int = 480, focal_px: float = 700.0) -> Camera:
    matrix = np.array([[focal_px, 0.0, 321.5], [0.0, focal_px * 1.01, 236.25], [0.0, 0.0, 1.0]])
    return Camera(matrix, np.asarray(distortion, dtype=float), width, height)


def assert_same_rig(after: StereoRig, before: StereoRig) -> None:
    """Asserts that a rig came back from a file: cameras to the bit, place to its last digits."""
    np.testing.assert_allclose(
        after.right_from_left.matrix, before.right_from_left.matrix, rtol=0, atol=1e-9
    )
    for a, b in ((after.left, before.left), (after.right, before.right)):
        np.testing.assert_array_equal(a.matrix, b.matrix)
        np.testing.assert_array_equal(a.distortion, b.distortion)
    assert (after.width, after.height) == (before.width, before.height)


def toed_in_rig() -> StereoRig:
    """Distorted, turned towards each other, with different intrinsics."""
    left = camera((-0.21, 0.09, 8e-4, -6e-4, 0.01))
    right = camera((-0.18, 0.05, -5e-4, 7e-4, 0.02), focal_px=712.0)
    rotation = rotation_from_vector([0.011, -0.09, 0.02])
    return StereoRig(
        left,
        right,
        RigidTransform.from_parts("right", "left", rotation, [-61.3, 1.7, 4.1]),
        ("L-1", "R-2"),
        name="bench",
    )
