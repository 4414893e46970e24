"""The axis of a tool, from turns about itself."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from navapp.errors import ResultError
from navapp.geometry.transform import FloatArray

_FEWEST_POSES, _LEAST_SWEPT_DEG, _MOST_RMS_DEG = 10, 40.0, 1.5
_ROUNDS, _RARE = 30, 4.0


@dataclass(frozen=True, slots=True, eq=False)
class ToolAxis:
    """The direction in a tool's frame that stands still in the room while the tool turns."""

    axis: FloatArray  # (3,) unit
    sigma_rad: float  # standard deviation of each of its two components across
    swept_deg: tuple[float, ...]  # by how much each turn has turned it
    rms_deg: float  # of the axis in the room about its mean, over all turns


def solve_axis(turns: Sequence[FloatArray], towards: FloatArray) -> ToolAxis:
    """Find the axis about which a tool was turned, in each turn about another line of the room.

    The direction a for which R a scatters least about its mean in every turn; it scatters least
    where the sum of the lengths of those means is largest, which a few rounds of taking means find.

    Args:
        turns: each (N, 4, 4) tracker_from_tool.
        towards: (3,) in the tool's frame; of both directions the one that points there.

    Raises:
        ResultError: too few poses, or a turn that hardly turned the tool.
    """
    rotations = [np.asarray(one, dtype=np.float64)[:, :3, :3] for one in turns]
    if not rotations or min(len(one) for one in rotations) < _FEWEST_POSES:
        raise ResultError(
            "the turns have too few poses to find an axis",
            remedy=f"give turns of {_FEWEST_POSES} poses at least",
        )
    axis = _settle(rotations, np.asarray(towards, dtype=np.float64))
    rotations = [_without_outliers(one, axis) for one in rotations]
    axis = _settle(rotations, axis)
    swept_deg = tuple(_swept_deg(one, axis) for one in rotations)
    if min(swept_deg) < _LEAST_SWEPT_DEG:
        raise ResultError(
            f"a turn has turned the tool by {min(swept_deg):.0f} deg only",
            remedy=f"turn it by {_LEAST_SWEPT_DEG:.0f} degrees or more about itself",
        )
    rms_deg = float(
        np.degrees(np.sqrt(np.mean([np.mean(_off(one, axis) ** 2) for one in rotations])))
    )
    if rms_deg > _MOST_RMS_DEG:
        raise ResultError(
            f"the axis wandered by {rms_deg:.1f} deg while the tool was turned",
            remedy="turn it in a guide, or more slowly",
        )
    variance = float(np.mean([np.mean(_off(one, axis) ** 2) for one in rotations])) / 2.0
    information = sum(len(one) * (np.eye(3) - _mean(one).T @ _mean(one)) for one in rotations)
    weakest = float(np.linalg.eigvalsh(information)[1])
    # Poses of one turn follow each other: a tenth of them stands for itself.
    sigma_rad = float(np.sqrt(10.0 * variance / weakest))
    return ToolAxis(axis, sigma_rad, swept_deg, rms_deg)


def _settle(rotations: list[FloatArray], start: FloatArray) -> FloatArray:
    """The axis nearest to a direction that it is not at right angles to."""
    whole = sum(len(one) * _mean(one).T @ _mean(one) for one in rotations)
    axis = np.linalg.eigh(whole)[1][:, -1]
    axis = axis * (1.0 if axis @ start > 0.0 else -1.0)
    for _ in range(_ROUNDS):
        means = [_mean(one) @ axis for one in rotations]
        pulls = [
            len(one) * _mean(one).T @ (mean / np.linalg.norm(mean))
            for one, mean in zip(rotations, means, strict=True)
        ]
        axis = np.sum(pulls, axis=0)
        axis = axis / np.linalg.norm(axis)
    return np.asarray(axis)


def _mean(rotations: FloatArray) -> FloatArray:
    mean: FloatArray = rotations.mean(axis=0)
    return mean


def _off(rotations: FloatArray, axis: FloatArray) -> FloatArray:
    """(N,) rad, of the axis in the room from its mean."""
    seen = rotations @ axis
    mean = seen.mean(axis=0)
    return np.asarray(np.linalg.norm(np.cross(seen, mean / np.linalg.norm(mean)), axis=1))


def _without_outliers(rotations: FloatArray, axis: FloatArray) -> FloatArray:
    off = _off(rotations, axis)
    kept: FloatArray = rotations[off <= _RARE * max(float(np.median(off)), 1e-9)]
    return kept


def _swept_deg(rotations: FloatArray, axis: FloatArray) -> float:
    """Between the two poses that are turned furthest about the axis against each other."""
    across = np.linalg.svd(axis[None])[2][1:]
    seen = rotations @ across[0]
    normal = (rotations @ axis).mean(axis=0)
    normal /= np.linalg.norm(normal)
    first = seen[0] - (seen[0] @ normal) * normal
    first /= np.linalg.norm(first)
    other = np.cross(normal, first)
    angles = np.degrees(np.unwrap(np.arctan2(seen @ other, seen @ first)))
    return float(np.ptp(angles))
