"""A caliper in a hand: how thick the bone is below a face that the saw left."""

import numpy as np
from scipy.interpolate import LinearNDInterpolator

from navapp.geometry.directions import perpendicular_axes
from navapp.geometry.transform import FloatArray
from sim_devices.world import World

# Standard deviations of a reading, and of the jaws' place, either way along the face.
READING_SD_MM, PLACE_SD_MM = 0.15, 1.0
# The opposite surface looks away from the face by at least this cosine.
_LEAST_COSINE = 0.3


class Caliper:
    """Reads thicknesses in a simulated room, each time anew.

    Args:
        world: of the room; its seed is that of the readings.
    """

    def __init__(self, world: World) -> None:
        self._world = world
        # Its own stream beside those of the room.
        self._rng = np.random.default_rng((world.scenario.seed, 5))

    def read(self, cut: str, points_mm: FloatArray, normal: FloatArray) -> FloatArray:
        """(N,) mm from the face that the saw leaves to the opposite surface of its bone, or NaN.

        Args:
            cut: name of the planned cut; its face is the one that the saw makes, shown or not.
            points_mm: (N, 3) where the person reads, in the bone's coordinates.
            normal: (3,) unit, along which the jaws lie, out of the bone that stays.
        """
        made_point_mm, made_normal = self._world.record.made_planes[cut]
        mesh = self._world.anatomy.bones[self._world.planned_cuts[cut].bone]
        axes = perpendicular_axes(normal[None])[0]
        is_opposite = mesh.normals @ normal < -_LEAST_COSINE
        opposite_mm = mesh.vertices_mm[is_opposite]
        height_mm = LinearNDInterpolator(opposite_mm @ axes.T, opposite_mm @ normal)
        n = len(points_mm)
        points_mm = points_mm + PLACE_SD_MM * self._rng.standard_normal((n, 2)) @ axes
        face_mm = (made_point_mm - points_mm) @ made_normal / (normal @ made_normal)
        below_mm = height_mm(points_mm @ axes.T) - points_mm @ normal
        read_mm: FloatArray = face_mm - below_mm + READING_SD_MM * self._rng.standard_normal(n)
        return read_mm
