"""Predicted error in mm of points that a rig triangulates, from the rig's covariance.

A point of the working volume is projected by the rig as solved and triangulated by a rig that is
off by what its covariance allows; how far the answer lies from the point is what a user has to
expect.
"""

import numpy as np

from calibration.rig.parameters import RigModel, unpack
from calibration.rig.projection import project
from navapp.geometry.transform import FloatArray

_COLUMNS, _ROWS, _DEPTHS = 7, 5, 3
_N_DRAWN, _SEED = 1024, 20
_FRACTION = 0.95


def make_working_points_mm(
    model: RigModel, shared: FloatArray, depth_mm: tuple[float, float], fineness: int = 1
) -> FloatArray:
    """(n, 3) points of a working volume in the left camera's frame.

    Args:
        model: of the rig.
        shared: its numbers.
        depth_mm: nearest and farthest surface; the volume is what both cameras see between them.
        fineness: so many times as many points along x and y.
    """
    rig = unpack(model, shared)
    n_x, n_y = fineness * _COLUMNS, fineness * _ROWS
    x, y = np.meshgrid(
        (np.arange(n_x) + 0.5) / n_x * model.width, (np.arange(n_y) + 0.5) / n_y * model.height
    )
    rays = rig.left.rays(np.column_stack([x.ravel(), y.ravel()]))
    points_mm = np.vstack([rays * z for z in np.linspace(*depth_mm, _DEPTHS)])
    pixels = rig.right.project(rig.right_from_left.apply(points_mm))
    is_seen = (pixels >= 0.0).all(axis=1) & (pixels < (model.width, model.height)).all(axis=1)
    seen: FloatArray = points_mm[is_seen]
    return seen


def compute_triangulation_slopes(
    model: RigModel, shared: FloatArray, points_mm: FloatArray
) -> FloatArray:
    """(n, 3, n_rig) how triangulated points move with the rig's numbers, their pixels held.

    The triangulated point minimises the distances in both pictures; at the solution its change is
    the pseudoinverse of the slopes by the point times the slopes by the rig.
    """
    by_rig, by_point = [], []
    for number in range(2):
        _, a, _, b = project(points_mm, np.zeros(6), model, shared, number)
        by_rig.append(a.reshape(-1, 2, model.n_rig))
        by_point.append(b.reshape(-1, 2, 3))
    rig, point = np.concatenate(by_rig, axis=1), np.concatenate(by_point, axis=1)
    slopes: FloatArray = -np.linalg.pinv(point) @ rig
    return slopes


def compute_bounds_mm(
    model: RigModel, shared: FloatArray, covariance: FloatArray, points_mm: FloatArray
) -> FloatArray:
    """(n,) distance that 95 % of the errors of triangulated points stay below.

    Args:
        model: of the rig.
        shared: its numbers.
        covariance: (n_rig, n_rig) of them.
        points_mm: (n, 3) in the left camera's frame.
    """
    slopes = compute_triangulation_slopes(model, shared, points_mm)
    spread = slopes @ covariance @ slopes.transpose(0, 2, 1)
    values, axes = np.linalg.eigh(spread)
    roots = axes * np.sqrt(np.maximum(values, 0.0))[:, None, :]
    drawn = np.random.default_rng(_SEED).standard_normal((3, _N_DRAWN))
    bounds: FloatArray = np.quantile(np.linalg.norm(roots @ drawn, axis=1), _FRACTION, axis=1)
    return bounds
