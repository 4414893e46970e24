"""The drawing of `sim_devices.sheet_kernels`, written for reading."""

import numpy as np
from scipy.ndimage import map_coordinates


def sheet_reference(
    rays: np.ndarray,
    texture_from_ray: np.ndarray,
    texture: np.ndarray,
    n_samples: int,
    ground: float,
    shade: float,
) -> np.ndarray:
    """Same arguments as `draw_sheet`, the whole picture returned."""
    height, width = texture.shape
    total = np.zeros((rays.shape[0] - 1, rays.shape[1] - 1))
    at_corners = np.dstack([rays, np.ones(rays.shape[:2])]) @ texture_from_ray.T
    at_corners = at_corners[..., :2] / at_corners[..., 2:]
    for v in (np.arange(n_samples) + 0.5) / n_samples:
        for u in (np.arange(n_samples) + 0.5) / n_samples:
            upper = (1 - u) * at_corners[:-1, :-1] + u * at_corners[:-1, 1:]
            lower = (1 - u) * at_corners[1:, :-1] + u * at_corners[1:, 1:]
            s, t = np.moveaxis((1 - v) * upper + v * lower, -1, 0)
            is_on = (s > -0.5) & (s < width - 0.5) & (t > -0.5) & (t < height - 0.5)
            grey = map_coordinates(texture.astype(float), [t, s], order=1, mode="nearest")
            total += np.where(is_on, shade * grey, ground)
    return total / n_samples**2
