"""CTs of simple bodies, blurred by formula: exact on any lattice, oblique or leaning."""

from functools import lru_cache

import numpy as np
from scipy.special import erf, i0e, ndtr

from navapp.geometry.transform import rotation_from_vector
from navapp.preop.volume import CtVolume

SOFT_HU, CORTEX_HU, SPONGY_HU, MARROW_HU, AIR_HU = 50.0, 1200.0, 250.0, -50.0, -1000.0
OBLIQUE = rotation_from_vector([0.4, -0.3, 0.5])


def lattice(size, spacing_mm, axes=None, middle_mm=(0.0, 0.0, 0.0)):
    """(4, 4) lps_from_index whose middle voxel lies at a point; `axes` columns are directions."""
    matrix = np.eye(4)
    matrix[:3, :3] = (np.eye(3) if axes is None else axes) * np.asarray(spacing_mm, dtype=float)
    matrix[:3, 3] = middle_mm - matrix[:3, :3] @ ((np.array(size) - 1) / 2)
    return matrix


def leaning_axes(degrees=14.0):
    """The step from slice to slice leans, as with a tilted gantry."""
    axes = np.eye(3)
    axes[:, 2] = [0.0, np.sin(np.radians(degrees)), np.cos(np.radians(degrees))]
    return axes


def points_of(size, matrix):
    """(D, H, W, 3) LPS points of the voxels."""
    k, j, i = np.indices(size[::-1])
    return np.stack([i, j, k], axis=-1) @ matrix[:3, :3].T + matrix[:3, 3]


def ct_of(hu, matrix, noise_hu=0.0, seed=0):
    noise = np.random.default_rng(seed).normal(0.0, noise_hu, hu.shape) if noise_hu else 0.0
    voxels = np.rint(np.clip(hu + noise, -1024, 3071)).astype(np.int16)
    return CtVolume(voxels, matrix, np.linalg.norm(matrix[:3, :3], axis=0))


def ball(points, centre_mm, radius_mm, sigma_mm=0.5):
    """A ball of ones under a Gaussian."""
    r = np.maximum(np.linalg.norm(points - np.asarray(centre_mm), axis=-1), 1e-6)
    near, far = (radius_mm - r) / sigma_mm, (radius_mm + r) / sigma_mm
    tails = np.exp(-0.5 * near**2) - np.exp(-0.5 * far**2)
    edges = erf(near / np.sqrt(2)) + erf(far / np.sqrt(2))
    return 0.5 * edges - sigma_mm / (r * np.sqrt(2 * np.pi)) * tails


def box(points, lower_mm, upper_mm, sigma_mm=0.5):
    """A box of ones under a Gaussian."""
    lower, upper = (np.asarray(edge, dtype=float) for edge in (lower_mm, upper_mm))
    shares = ndtr((points - lower) / sigma_mm) - ndtr((points - upper) / sigma_mm)
    return shares.prod(axis=-1)


def cylinder(points, radius_mm, sigma_mm=0.5):
    """An endless cylinder of ones along z under a Gaussian."""
    r, share = _disc(radius_mm, sigma_mm)
    return np.interp(np.hypot(points[..., 0], points[..., 1]), r, share)


def hollow(shape, outer, inner, inside_hu=SPONGY_HU, cortex_hu=CORTEX_HU, around_hu=SOFT_HU):
    """What a body with a cortex adds to the tissue around: `shape` of `outer` and `inner` sizes."""
    return (cortex_hu - around_hu) * shape(*outer) + (inside_hu - cortex_hu) * shape(*inner)


def hollow_ball(points, centre_mm, radius_mm, cortex_mm=1.2, sigma_mm=0.5, **levels):
    return hollow(
        lambda radius: ball(points, centre_mm, radius, sigma_mm),
        (radius_mm,),
        (radius_mm - cortex_mm,),
        **levels,
    )


def hollow_box(points, lower_mm, upper_mm, cortex_mm=1.2, sigma_mm=0.5, **levels):
    lower, upper = np.array(lower_mm, dtype=float), np.array(upper_mm, dtype=float)
    return hollow(
        lambda a, b: box(points, a, b, sigma_mm),
        (lower, upper),
        (lower + cortex_mm, upper - cortex_mm),
        **levels,
    )


def hollow_cylinder(points, radius_mm, cortex_mm=3.0, sigma_mm=0.5, **levels):
    return hollow(
        lambda radius: cylinder(points, radius, sigma_mm),
        (radius_mm,),
        (radius_mm - cortex_mm,),
        **levels,
    )


@lru_cache
def _disc(radius_mm, sigma_mm):
    """Radii, and the blurred disc there: the density of the radius of a shifted Gaussian."""
    rho = np.linspace(0.0, radius_mm, 4001)
    r = np.linspace(0.0, radius_mm + 8.0 * sigma_mm, 1201)
    s2 = sigma_mm**2
    density = rho / s2 * np.exp(-0.5 * (r[:, None] - rho) ** 2 / s2) * i0e(r[:, None] * rho / s2)
    return np.append(r, 1e3), np.append(np.trapezoid(density, rho, axis=1), 0.0)
