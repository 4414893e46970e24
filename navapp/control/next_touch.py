"""Where the check on the patient asks for the next touch, and in which words."""

from collections.abc import Mapping, Sequence

import numpy as np

from navapp.control.touches import add_touch_sigma
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.tools.patient_check import Touched, find_next_place

# Places that it is chosen from; those that face the camera so much can be reached.
_N_PLACES, _LEAST_FACING = 1200, 0.35
# What is laid bare: so far around the targets and what was touched.
_BARE_MM = 15.0
# Of a tip, as far as it matters for a choice.
_TIP_SIGMA_MM = 0.1


def choose_next_touch(
    touches: Sequence[Touched],
    targets_mm: FloatArray,
    surface: TriangleMesh,
    left_from_bone: RigidTransform,
) -> FloatArray | None:
    """(3,) the place in bone coordinates at which a touch tells most; None: none can be reached.

    Args:
        touches: so far.
        targets_mm: (N, 3).
        surface: of the bone.
        left_from_bone: its pose.
    """
    used = np.unique(surface.faces)
    some = used[:: max(1, len(used) // _N_PLACES)]
    places, normals = surface.vertices_mm[some], surface.normals[some]
    in_left = left_from_bone.apply(places)
    facing = -np.einsum("nj,nj->n", left_from_bone.rotate(normals), in_left)
    is_reached = facing > _LEAST_FACING * np.linalg.norm(in_left, axis=1)
    bare = np.concatenate([targets_mm, [one.point_mm for one in touches]])
    low, high = bare.min(axis=0) - _BARE_MM, bare.max(axis=0) + _BARE_MM
    is_reached &= ((places >= low) & (places <= high)).all(axis=1)
    if not is_reached.any():
        return None
    places, normals = places[is_reached], normals[is_reached]
    sigma_mm = add_touch_sigma(_TIP_SIGMA_MM)
    place: FloatArray = places[find_next_place(touches, targets_mm, places, normals, sigma_mm)]
    return place


def name_place(place_mm: FloatArray, landmarks: Mapping[str, FloatArray]) -> str:
    """For people: by the nearest landmark."""
    if not landmarks:
        return "at the cross in the picture"
    name = min(landmarks, key=lambda one: float(np.linalg.norm(landmarks[one] - place_mm)))
    away_mm = float(np.linalg.norm(landmarks[name] - place_mm))
    return f"at the cross, {away_mm:.0f} mm from {name.split('/')[-1].replace('_', ' ')}"
