"""Bones and clouds whose pose is known."""

import numpy as np

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.rectification import RectifiedGeometry
from navapp.geometry.transform import RigidTransform
from navapp.geometry.zbuffer import projected_box, render_rectified, unhidden_vertices
from navapp.registration import RegistrationModel
from navapp.values import BoneModel, Origin, SurfaceCloud, visible_vertices
from sim_devices.anatomy import KneeSpec, make_knee

TRUE = RigidTransform.from_parts(
    "left_rect",
    "femur",
    np.array([[1.0, 0.0, 0.0], [0.0, 0.8660254, -0.5], [0.0, 0.5, 0.8660254]]),
    (-12.0, 5.0, 470.0),
)
GEOMETRY = RectifiedGeometry(
    1400.0, 640.0, 360.0, 80.0, 1280, 720, RigidTransform.identity("left_rect", "left")
)


def femur(seed: int = 1) -> BoneModel:
    mesh = make_knee(KneeSpec(seed)).bones["femur"]
    return BoneModel("femur", TriangleMesh(mesh.vertices_mm, mesh.faces), "right")


def seen_vertices(bone: BoneModel, pose: RigidTransform = TRUE) -> np.ndarray:
    """Indices of the vertices that the left camera sees."""
    box = projected_box(bone.mesh, pose, GEOMETRY)
    view = render_rectified(bone.mesh, pose, GEOMETRY, box)
    shown = unhidden_vertices(bone.mesh, pose, GEOMETRY, view)
    return np.flatnonzero(shown & visible_vertices(bone.mesh, pose))


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
    return TRUE.moved(np.concatenate([shift, turn]), TRUE.apply(model.centre_mm))


def mean_error_mm(pose: RigidTransform, bone: BoneModel) -> float:
    """Mean error over the visible vertices."""
    points = bone.mesh.vertices_mm[visible_vertices(bone.mesh, TRUE)]
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
