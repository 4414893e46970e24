"""Registration by paired landmarks: the way out when no surface leads to a pose."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from navapp.errors import InputError
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.registration.point_to_point import kabsch

_FEWEST = 3
# Points that lie nearer to a line than this share of its length leave a turn about it free.
_LEAST_WIDTH = 0.02
_REMEDY = "touch at least three landmarks that do not lie on one line"


@dataclass(frozen=True, slots=True, eq=False)
class Landmarks:
    """A pose from landmarks.

    Attributes:
        scene_from_bone: the pose.
        residual_mm: (N,) distance that is left between each pair.
    """

    scene_from_bone: RigidTransform
    residual_mm: FloatArray


def register_landmarks(
    bone_points_mm: ArrayLike,
    scene_points_mm: ArrayLike,
    frames: tuple[str, str] = ("left", "femur"),
) -> Landmarks:
    """The pose that lays landmarks of a bone on the same ones in the scene.

    Args:
        bone_points_mm: (N, 3) as planned, N >= 3.
        scene_points_mm: (N, 3) as touched or seen, in the same order.
        frames: the scene's and the bone's name.

    Raises:
        InputError: fewer than three pairs, unpaired or not finite points, points on one line.

    Source: Kabsch 1976, with the sign that forbids a reflection.
    """
    bone = np.asarray(bone_points_mm, dtype=np.float64)
    scene = np.asarray(scene_points_mm, dtype=np.float64)
    if bone.ndim != 2 or bone.shape[1:] != (3,) or bone.shape != scene.shape:
        raise InputError(
            f"landmarks of the bone {bone.shape} and of the scene {scene.shape} are no pairs",
            remedy="give as many positions (x, y, z) of the one as of the other",
        )
    if not (np.isfinite(bone).all() and np.isfinite(scene).all()):
        raise InputError("a landmark has a position that is not finite", remedy="touch it again")
    if len(bone) < _FEWEST:
        raise InputError(f"{len(bone)} pairs of landmarks fix no pose", remedy=_REMEDY)
    for name, points in (("bone", bone), ("scene", scene)):
        spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
        if spread[1] <= _LEAST_WIDTH * spread[0]:
            raise InputError(f"the landmarks of the {name} lie on one line", remedy=_REMEDY)
    start = RigidTransform.identity(*frames)
    pose = kabsch(scene, bone, np.ones(len(bone)), start)
    return Landmarks(pose, np.linalg.norm(pose.apply(bone) - scene, axis=1))
