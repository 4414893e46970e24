"""How fast things move in a camera's picture."""

from collections.abc import Callable

import numpy as np

from navapp.geometry.camera import Camera
from navapp.geometry.transform import FloatArray, RigidTransform

# Parts of an interval: what swings to and fro within it moves although it comes back.
_PARTS = 4
# Points beyond the picture's edge by this fraction of the picture still count.
_MARGIN = 0.1


def compute_path_px(
    camera: Camera,
    points_mm: FloatArray,
    camera_from_body: Callable[[int], RigidTransform],
    from_ns: int,
    until_ns: int,
) -> float:
    """The longest way, in px, that one of a body's points goes in the picture.

    Without the lens's distortion; points that are never in view do not count.

    Args:
        camera: that looks.
        points_mm: (N, 3) in the body's frame.
        camera_from_body: at a time in ns.
        from_ns: beginning of the interval.
        until_ns: its end.
    """
    times_ns = [round(t) for t in np.linspace(from_ns, until_ns, _PARTS + 1)]
    points = np.stack([camera_from_body(t).apply(points_mm) for t in times_ns])
    is_before = (points[..., 2] > 1.0).all(axis=0)
    seen = points[:, is_before]
    pixels = camera.focal_px * seen[..., :2] / seen[..., 2:]
    half_px = (0.5 + _MARGIN) * np.array([camera.width, camera.height])
    is_in_view = (np.abs(pixels) < half_px).all(axis=2).any(axis=0)
    steps = np.linalg.norm(np.diff(pixels[:, is_in_view], axis=0), axis=2)
    return float(steps.sum(axis=0).max(initial=0.0))
