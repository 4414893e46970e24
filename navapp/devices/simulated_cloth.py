"""A cloth that hides a part of the bone from the simulated cameras."""

import numpy as np

from navapp.config import SimulationSection
from navapp.geometry import RigidTransform
from sim_devices.camera import Scene
from sim_devices.sheet import PrintedSheet, SheetInView
from sim_devices.world import World

_PX_PER_MM, _SIDE_MM, _ABOVE_MM = 3.0, 440.0, 25.0
# Grey levels of the cloth's weave: mean and standard deviation of its white share.
_WHITE, _WEAVE, _WEAVE_PX = 0.4, 0.05, 1.5
# It comes after the first picture, in which the bone is registered.
_FROM_NS = 1_000_000


def with_cloth(room: Scene, world: World, settings: SimulationSection) -> Scene:
    """The room, with a cloth over the configured share of the bone's side towards the cameras.

    It lies across the left picture up to an edge, hangs before the bone where it was at the start
    of the opening, and stays there.
    """
    if settings.covered <= 0.0:
        return room
    mesh, pose = world.surface("femur"), world.left_from_body("femur", 0)
    seen_mm = pose.apply(mesh.vertices_mm[mesh.visible_vertices(pose)])
    depth_mm = float(seen_mm[:, 2].min()) - _ABOVE_MM
    # Along the left camera's rays this share lies left of the edge.
    across_mm = seen_mm[:, 0] * depth_mm / seen_mm[:, 2]
    edge_mm = float(np.quantile(across_mm, settings.covered))
    left_from_cloth = RigidTransform.from_parts(
        "left", "cloth", np.eye(3), np.array([edge_mm, 0.0, depth_mm])
    )
    until_ns = np.iinfo(np.int64).max
    cloth = _weave(settings.seed)
    return SheetInView(room, cloth, lambda _: left_from_cloth, (_FROM_NS, int(until_ns)))


def _weave(seed: int) -> PrintedSheet:
    """Grey cloth whose right edge is at x = 0."""
    import cv2

    n = round(_SIDE_MM * _PX_PER_MM)
    noise = np.random.default_rng([seed, 91]).standard_normal((n, n)).astype(np.float32)
    weave = cv2.GaussianBlur(noise, (0, 0), _WEAVE_PX)
    white = 255.0 * (_WHITE + _WEAVE * weave / weave.std())
    grey = np.clip(np.rint(white), 0, 255).astype(np.uint8)
    return PrintedSheet(grey, _PX_PER_MM, -_SIDE_MM, -0.5 * _SIDE_MM)
