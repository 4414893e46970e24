"""By how much saw and drill miss their plan."""

from dataclasses import replace

import numpy as np

from navapp.geometry.directions import perpendicular_axes
from navapp.geometry.transform import FloatArray, rotation_from_vector
from sim_devices.planned_cuts import Cut

OFFSET_SD_MM = 1.0
TILT_SD_DEG = 1.5
# Share of the cuts that are made twice.
REPEATED = 0.1


def miss_cut(planned: Cut, rng: np.random.Generator, times: float = 1.0) -> Cut:
    """The cut as the saw makes it.

    One cut in ten is made a second time: tilted as then, and no higher than the first time, because
    no bone comes back. A saw misses by so many `times` as much as usual.
    """
    is_repeated = rng.uniform() < REPEATED
    first, second = (miss_plane(planned.point_mm, planned.normal, rng, times) for _ in range(2))
    point_mm, normal = second if is_repeated else first
    if is_repeated and (first[0] - second[0]) @ planned.normal < 0.0:
        point_mm = first[0]
    return replace(planned, point_mm=point_mm, normal=normal)


def miss_plane(
    point_mm: FloatArray, normal: FloatArray, rng: np.random.Generator, times: float = 1.0
) -> tuple[FloatArray, FloatArray]:
    """Point and normal of a plane, set off along the normal and tilted about the point."""
    offset_mm = times * OFFSET_SD_MM * float(rng.standard_normal())
    return point_mm + offset_mm * normal, _tilt(normal, rng, times)


def miss_line(
    entry_mm: FloatArray, axis: FloatArray, rng: np.random.Generator, times: float = 1.0
) -> tuple[FloatArray, FloatArray]:
    """A point and the direction of a line, set off across itself and tilted about the point."""
    offset_mm = times * OFFSET_SD_MM * float(rng.standard_normal())
    return entry_mm + offset_mm * _draw_across(axis, rng), _tilt(axis, rng, times)


def _tilt(direction: FloatArray, rng: np.random.Generator, times: float) -> FloatArray:
    angle_rad = np.radians(times * TILT_SD_DEG * float(rng.standard_normal()))
    tilted: FloatArray = rotation_from_vector(angle_rad * _draw_across(direction, rng)) @ direction
    return tilted


def _draw_across(direction: FloatArray, rng: np.random.Generator) -> FloatArray:
    """A unit vector across a direction."""
    angle_rad = float(rng.uniform(0.0, 2.0 * np.pi))
    across: FloatArray = (np.cos(angle_rad), np.sin(angle_rad)) @ perpendicular_axes(
        direction[None]
    )[0]
    return across
