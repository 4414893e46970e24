"""Bones and clouds whose pose is known."""

from functools import cache

import numpy as np

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.rectification import RectifiedGeometry
from navapp.geometry.transform import RigidTransform
from navapp.geometry.zbuffer import render_rectified
from navapp.registration import RegistrationModel, Scene
from navapp.values import BoneModel, Origin, SurfaceCloud
from sim_devices.anatomy import KneeSpec, make_knee
from tests.views import find_unhidden_vertices, project_box

TRUE = RigidTransform.from_parts(
    "left_rect",
    "femur",
    np.array([[1.0, 0.0, 0.0], [0.0, 0.8660254, -0.5], [0.0, 0.5, 0.8660254]]),
    (-12.0, 5.0, 470.0),
)
GEOMETRY = RectifiedGeometry(
    1400.0, 640.0, 360.0, 80.0, 1280, 720, RigidTransform.identity("left_rect", "left")
)


@cache
def femur(seed: int = 1) -> BoneModel:
    mesh = make_knee(KneeSpec(seed)).bones["femur"]
    return BoneModel("femur", TriangleMesh(mesh.vertices_mm, mesh.faces), "right")


@cache
def femur_for_registration() -> RegistrationModel:
    return RegistrationModel(femur())


@cache
def seen_vertices(bone: BoneModel, pose: RigidTransform = TRUE) -> np.ndarray:
    """Indices of the vertices that the left camera sees."""
    box = project_box(bone.mesh, pose, GEOMETRY)
    view = render_rectified(bone.mesh, pose, GEOMETRY, box)
    shown = find_unhidden_vertices(bone.mesh, pose, GEOMETRY, view)
    return np.flatnonzero(shown & bone.mesh.visible_vertices(pose))


def as_cloud(points_mm: np.ndarray, sigma_mm: float) -> SurfaceCloud:
    n = len(points_mm)
    return SurfaceCloud(
        points_mm,
        np.full(n, sigma_mm),
        np.round(GEOMETRY.project(points_mm)).astype(np.int32),
        np.full(n, Origin.MATCHED, dtype=np.uint8),
    )


def seen_cloud(bone: BoneModel, n: int, sigma_mm: float, seed: int = 0) -> SurfaceCloud:
    """Points of what the camera sees of a bone at `TRUE`, with noise along the rays."""
    rng = np.random.default_rng(seed)
    seen = seen_vertices(bone)
    chosen = rng.choice(seen, min(n, len(seen)), replace=False)
    points = TRUE.apply(bone.mesh.vertices_mm[chosen])
    rays = points / np.linalg.norm(points, axis=1, keepdims=True)
    return as_cloud(points + rays * rng.normal(0.0, sigma_mm, (len(points), 1)), sigma_mm or 0.1)


def disturbed(model: RegistrationModel, deg: float, mm: float, seed: int) -> RigidTransform:
    """`TRUE`, turned and shifted in a random direction about the bone's centre."""
    turn, shift = np.random.default_rng(seed).standard_normal((2, 3))
    turn *= np.radians(deg) / np.linalg.norm(turn)
    shift *= mm / np.linalg.norm(shift)
    return TRUE.move(np.concatenate([shift, turn]), TRUE.apply(model.centre_mm))


def mean_error_mm(pose: RigidTransform, bone: BoneModel) -> float:
    """Mean error over the visible vertices."""
    points = bone.mesh.vertices_mm[bone.mesh.visible_vertices(TRUE)]
    return float(np.linalg.norm(pose.apply(points) - TRUE.apply(points), axis=1).mean())


def grid_mesh(height_of, half_mm: float = 40.0, step_mm: float = 2.0) -> TriangleMesh:
    """A height field z = height_of(x, y), seen from -z."""
    axis = np.arange(-half_mm, half_mm + 1e-9, step_mm)
    x, y = np.meshgrid(axis, axis)
    n = len(axis)
    index = np.arange(n * n).reshape(n, n)
    a, b, c, d = (
        index[:-1, :-1].ravel(), index[:-1, 1:].ravel(),
        index[1:, :-1].ravel(), index[1:, 1:].ravel(),
    )  # fmt: skip
    faces = np.concatenate([np.column_stack([a, c, b]), np.column_stack([b, c, d])])
    vertices = np.column_stack([x.ravel(), y.ravel(), height_of(x, y).ravel()])
    return TriangleMesh(vertices, faces.astype(np.int32))


def ball_mesh(radius_mm: float, n: int = 4000) -> TriangleMesh:
    """Vertices of a golden spiral on a sphere, closed by their hull."""
    from scipy.spatial import ConvexHull

    k = np.arange(n) + 0.5
    z, angle = 1.0 - 2.0 * k / n, np.pi * (1.0 + np.sqrt(5.0)) * k
    radius = np.sqrt(1.0 - z * z)
    points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), z])
    faces = ConvexHull(points).simplices
    a, b, c = points[faces].transpose(1, 0, 2)
    is_inward = (np.cross(b - a, c - a) * a).sum(axis=1) < 0.0
    faces[is_inward] = faces[is_inward][:, ::-1]
    return TriangleMesh(radius_mm * points, faces.astype(np.int32))


def blob_mesh(n: int = 1500) -> TriangleMesh:
    """A small closed surface of about 30 mm radius that no motion maps onto itself."""
    ball = ball_mesh(1.0, n)
    x, y, z = ball.vertices_mm.T
    height = 1.0 + 0.25 * x * y + 0.3 * y * z * z + 0.2 * np.sin(3.0 * x + 1.0) - 0.15 * z**3
    return TriangleMesh(30.0 * height[:, None] * ball.vertices_mm, ball.faces)


@cache
def blob(n: int = 1500) -> BoneModel:
    return BoneModel("femur", blob_mesh(n))


def tube_mesh(radius_mm: float, half_mm: float) -> TriangleMesh:
    """A tube along y, open at both ends."""
    n_round, n_along = 90, 41
    angle = 2.0 * np.pi * np.arange(n_round) / n_round
    y = np.linspace(-half_mm, half_mm, n_along)
    vertices = np.stack(
        [
            np.tile(radius_mm * np.cos(angle), n_along),
            np.repeat(y, n_round),
            np.tile(radius_mm * np.sin(angle), n_along),
        ],
        axis=1,
    )
    index = np.arange(n_round * n_along).reshape(n_along, n_round)
    a, b = index[:-1].ravel(), np.roll(index, -1, axis=1)[:-1].ravel()
    c, d = index[1:].ravel(), np.roll(index, -1, axis=1)[1:].ravel()
    faces = np.concatenate([np.column_stack([a, c, b]), np.column_stack([b, c, d])])
    return TriangleMesh(vertices, faces.astype(np.int32))


def facing_points(bone: BoneModel, pose: RigidTransform, least_cosine: float = 0.3) -> np.ndarray:
    """(N, 3) placed vertices that look at a camera at the origin."""
    points, normals = pose.apply(bone.mesh.vertices_mm), pose.rotate(bone.mesh.normals)
    cosine = -(points * normals).sum(axis=1) / np.linalg.norm(points, axis=1)
    return points[cosine > least_cosine]


def with_clutter(points_mm: np.ndarray, n: int, seed: int = 0) -> np.ndarray:
    """The points, and others that are spread around them."""
    box = np.random.default_rng(seed).uniform(-1.0, 1.0, (n, 3)) * (45.0, 45.0, 35.0)
    return np.concatenate([points_mm, points_mm.mean(axis=0) + box])


def seen_scene(n: int, sigma_mm: float, seed: int = 0, n_clutter: int = 0) -> Scene:
    """The femur at `TRUE` from the origin, with noise in all directions that nobody knows."""
    clean = seen_cloud(femur(), n, 0.0, seed).points_mm
    noise = np.random.default_rng(seed).normal(0.0, sigma_mm, clean.shape)
    return Scene(with_clutter(clean + noise, n_clutter, seed), np.zeros(3))


def scene_of(cloud: SurfaceCloud) -> Scene:
    """A cloud whose points have independent errors, from the origin."""
    return Scene(cloud.points_mm, np.zeros(3), cloud.sigma_ray_mm)
