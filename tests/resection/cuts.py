"""A block of bone that a saw has cut, and pictures of it."""

from dataclasses import dataclass, replace
from functools import lru_cache

import cv2
import numpy as np

from navapp.geometry.camera import Camera
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import RigidTransform, rotation_from_vector
from navapp.values import BoneModel, PoseEstimate, ResectionPlane
from tests.geometry.shapes import sphere

WIDTH, HEIGHT, FOCAL_PX, BASELINE_MM = 320, 200, 900.0, 80.0
PLANNED = ResectionPlane("femur", np.array([0.0, 0.0, 12.0]), np.array([0.0, 0.0, 1.0]))
# The saw went 0.7 mm too far, and was tilted by 1.3 deg.
MADE = replace(
    PLANNED,
    point_mm=np.array([0.0, 0.0, 11.3]),
    normal=rotation_from_vector(np.radians([1.2, -0.5, 0.0])) @ PLANNED.normal,
)
POSE_SD = 0.05, 0.001  # mm, rad
BONE_COLOUR = np.array([0.5, 0.75, 1.0])  # blue, green, red, in the pictures' tone curve
# By how much a glint on the face lies elsewhere for the other eye.
GLINT_SHIFT_MM = np.array([0.2, 0.0, 0.0])


def bone() -> BoneModel:
    """A ball of 30 mm, fine enough for a cut."""
    return BoneModel("femur", sphere(30.0, 60))


def rig() -> StereoRig:
    """Two ideal cameras side by side."""
    matrix = np.array(
        [[FOCAL_PX, 0.0, 0.5 * (WIDTH - 1)], [0.0, FOCAL_PX, 0.5 * (HEIGHT - 1)], [0.0, 0.0, 1.0]]
    )
    camera = Camera(matrix, np.empty(0), WIDTH, HEIGHT)
    apart = RigidTransform.from_parts("right", "left", np.eye(3), (-BASELINE_MM, 0.0, 0.0))
    return StereoRig(camera, camera, apart, ("a", "b"))


def pose(tilt_deg: float = 20.0) -> RigidTransform:
    """The bone 450 mm before the left camera, its planned face turned towards it."""
    turned = rotation_from_vector(np.radians([180.0 - tilt_deg, 8.0, 0.0]))
    return RigidTransform.from_parts("left", "femur", turned, (40.0, 0.0, 450.0))


def estimate(left_from_bone: RigidTransform) -> PoseEstimate:
    """That pose, known as well as `POSE_SD`."""
    covariance = np.diag([POSE_SD[0] ** 2] * 3 + [POSE_SD[1] ** 2] * 3)
    return PoseEstimate(left_from_bone, covariance, 1000, 1.0, 0.1, 0.1, 3, True)


@dataclass(frozen=True)
class Cover:
    """Something 6 mm above the face that hides a part of it: where x of the bone is below this."""

    x_mm: float = -100.0


@lru_cache(maxsize=16)
def pictures(
    left_from_bone: RigidTransform,
    made: ResectionPlane = MADE,
    cover: Cover = Cover(),
    seed: int = 0,
    glint: float = 0.0,
    lamp: tuple[float, float, float] = (1.0, 1.0, 1.0),
) -> tuple[np.ndarray, np.ndarray]:
    """Left and right picture (BGR) of the cut ball: its face, what covers it, and a far wall.

    So much linear light of a lamp (blue, green, red) is mirrored by the face at most, by other
    places for each eye.
    """
    views = []
    noise = np.random.default_rng(seed)
    for eye_x in (0.0, BASELINE_MM):
        depth, value, mirrored = _ray_cast(left_from_bone, made, cover, eye_x)
        grey = np.clip(np.where(np.isfinite(depth), value, 90.0), 0.0, 255.0)
        light = (grey[..., None] * BONE_COLOUR / 255.0) ** 2.2 + glint * np.multiply(
            mirrored[..., None], lamp
        )
        seen = 255.0 * light ** (1.0 / 2.2) + noise.normal(0.0, 1.5, light.shape)
        views.append(np.clip(seen, 0, 255).astype(np.uint8))
    return views[0], views[1]


def _ray_cast(left_from_bone, made, cover, eye_x) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(H, W) depth of what is nearest, its grey value, and how much of a lamp it mirrors, 0 to 1.

    Three samples a pixel each way.
    """
    n = 3
    u = (np.arange(n * WIDTH) + 0.5) / n - 0.5
    v = (np.arange(n * HEIGHT) + 0.5) / n - 0.5
    x = (u - 0.5 * (WIDTH - 1)) / FOCAL_PX
    y = (v - 0.5 * (HEIGHT - 1)) / FOCAL_PX
    rays = np.stack([*np.meshgrid(x, y), np.ones((len(v), len(u)))], axis=-1)
    eye = np.array([eye_x, 0.0, 0.0])
    bone_from_left = left_from_bone.inverse()
    start, along = bone_from_left.apply(eye[None])[0], rays @ bone_from_left.rotation.T
    depth = np.full(rays.shape[:2], np.inf)
    value = np.full(rays.shape[:2], 90.0)

    def hit(distance: np.ndarray, is_there: np.ndarray, seed: int) -> None:
        points = start + distance[..., None] * along
        is_new = is_there(points) & (distance > 0.0) & (distance < depth)
        depth[is_new] = distance[is_new]
        value[is_new] = _texture(points[is_new], seed)

    def to_plane(plane: ResectionPlane, above_mm: float = 0.0) -> np.ndarray:
        point = plane.point_mm + above_mm * plane.normal
        return ((point - start) @ plane.normal) / (along @ plane.normal)

    def in_ball(points: np.ndarray) -> np.ndarray:
        return np.linalg.norm(points, axis=-1) < 30.0

    hit(to_plane(made), in_ball, 1)
    places = start + to_plane(made)[..., None] * along + (eye_x > 0.0) * GLINT_SHIFT_MM
    is_face, mirrored = np.isfinite(depth), np.zeros(depth.shape)
    mirrored[is_face] = np.clip((_texture(places[is_face], 9) - 100.0) / 100.0, 0, 1)
    hit(to_plane(made, 6.0), lambda p: in_ball(p) & (p[..., 0] < cover.x_mm), 2)
    half_b, squared = (along @ start), (along**2).sum(-1)
    root = half_b**2 - squared * (start @ start - 30.0**2)
    ball = np.where(root > 0.0, (-half_b - np.sqrt(np.maximum(root, 0.0))) / squared, np.inf)
    ball = np.where(np.isfinite(ball), ball, -1.0)
    hit(ball, lambda p: (p - made.point_mm) @ made.normal < 0.0, 3)
    hit(to_plane(PLANNED, -60.0), lambda p: np.ones(p.shape[:-1], bool), 4)
    small, lit = (
        cv2.resize(one, (WIDTH, HEIGHT), interpolation=cv2.INTER_AREA) for one in (value, mirrored)
    )
    return cv2.resize(depth, (WIDTH, HEIGHT), interpolation=cv2.INTER_NEAREST), small, lit


def _texture(points: np.ndarray, seed: int) -> np.ndarray:
    """Grey value of places in the bone: smooth in space, the same for both eyes."""
    rng = np.random.default_rng(seed)
    value = np.zeros(points.shape[:-1])
    for _ in range(10):
        wave = rng.normal(0.0, 1.3, 3)
        value += np.sin(points @ wave + rng.uniform(0.0, 6.28))
    return 125.0 + 17.0 * value
