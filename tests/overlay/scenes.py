"""A bowl before a camera with distortion."""

import numpy as np

from navapp.geometry.camera import Camera
from navapp.geometry.transform import RigidTransform, rotation_from_vector
from navapp.overlay.layers import Scene
from navapp.values import BoneModel, Plan, StageSpec, SurgicalContent
from tests.registration.shapes import grid_mesh

WIDTH, HEIGHT = 640, 480
CAMERA = Camera(
    np.array([[700.0, 0, 319.5], [0, 705.0, 239.5], [0, 0, 1]]),
    np.array([-0.1, 0.05, 0.0004, -0.0003]), WIDTH, HEIGHT,
)  # fmt: skip
POSE = RigidTransform.from_parts(
    "left", "femur", rotation_from_vector((0.3, -0.2, 0.1)), (12.0, -8.0, 400.0)
)
MESH = grid_mesh(lambda x, y: 0.008 * (x * x + y * y), 45.0, 3.0)
TARGET = np.array([5.0, -10.0, 1.0])
BEHIND = np.column_stack([np.linspace(-80, 80, 33), np.full(33, 5.0), np.full(33, 60.0)])


def scene(
    *layers: str, is_candidate: bool = False, pose: RigidTransform = POSE, targets=None,
    curves=None, content=None,
) -> Scene:  # fmt: skip
    plan = Plan(
        {"femur": BoneModel("femur", MESH)},
        targets or {"femur/notch": TARGET, "tibia/plateau": TARGET + 20.0},
        curves or {"popliteal artery": BEHIND},
        content=content or SurgicalContent(),
    )
    stage = StageSpec(
        1, "opening", "femur", 2.0, 2.0, ("femur/notch", "tibia/plateau", "femur/unknown"),
        layers, (),
    )  # fmt: skip
    return Scene(plan, stage, MESH, pose, CAMERA, is_candidate)


def video(seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).integers(60, 120, (HEIGHT, WIDTH, 3)).astype(np.uint8)
