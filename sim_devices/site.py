"""The patient on the table before anything was done to the knee, and what will be done to it.

Everything is as for a right knee; a left one is the mirror image of the whole site.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import FloatArray, RigidTransform, rotation_from_vector
from sim_devices.anatomy import KneeAnatomy
from sim_devices.drilled_hole import find_entry_point
from sim_devices.layout import evert_patella, flex_knee
from sim_devices.misses import miss_cut, miss_line
from sim_devices.operation import STEPS
from sim_devices.planned_cuts import Cut, make_planned_cuts

_DRILL_TILT_DEG = -6.0


@dataclass(frozen=True, slots=True, eq=False)
class Site:
    """A right knee on the table."""

    knee: KneeAnatomy  # the bones as a CT shows them
    bones: Mapping[str, TriangleMesh]  # in their own frames, cartilage included
    worn: FloatArray  # (V,) of the femur: 1 where its cartilage is worn, 0 elsewhere
    is_covered: bool  # whether the bones carry cartilage
    seed: int  # of the tissue and the cloths
    table_from_femur: RigidTransform  # at the start
    femur_from_tibia: RigidTransform  # bent at rest, before a cut is made
    femur_from_patella: RigidTransform  # turned over
    planned: Mapping[str, Cut]  # all cuts of the operation
    made: Mapping[str, Cut]  # as the saw makes them
    # planned_hole, made_hole: where the drill enters the femur, and its unit direction.
    planned_hole: tuple[FloatArray, FloatArray]
    made_hole: tuple[FloatArray, FloatArray]


def make_site(
    knee: KneeAnatomy,
    bones: Mapping[str, TriangleMesh],
    worn: FloatArray,
    table_from_femur: RigidTransform,
    seed: int,
    *,
    is_covered: bool,
    misses: float = 1.0,
) -> Site:
    """A site; see `Site` for the arguments. What saw and drill miss is drawn from the seed."""
    planned = make_planned_cuts(knee)
    number = {step.name: k for k, step in enumerate(STEPS)}
    made = {
        name: miss_cut(cut, np.random.default_rng([seed, 61, number[name]]), misses)
        for name, cut in planned.items()
    }
    femur = bones["femur"]
    axis = rotation_from_vector((np.radians(_DRILL_TILT_DEG), 0.0, 0.0)) @ (0.0, 0.0, 1.0)
    notch = knee.landmarks["femur/notch"]
    made_hole = find_entry_point(femur, notch + np.array([0.0, -10.0, 0.0]), axis), axis
    # The hole is where the notch says, and it is the plan that is set off from it by the miss.
    rng = np.random.default_rng([seed, 61, number["femoral_guide"]])
    near_mm, direction = miss_line(*made_hole, rng, misses)
    return Site(
        knee=knee,
        bones=bones,
        worn=worn,
        is_covered=is_covered,
        seed=seed,
        table_from_femur=table_from_femur,
        femur_from_tibia=flex_knee(femur, bones["tibia"]),
        femur_from_patella=evert_patella(femur, bones["patella"]),
        planned=planned,
        made=made,
        planned_hole=(find_entry_point(femur, near_mm, direction), direction),
        made_hole=made_hole,
    )
