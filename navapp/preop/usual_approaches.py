"""From where cameras usually see the bones of a knee that is operated on.

The knee is bent by a right angle and open in front, the cameras look down on it: they see the femur
from below and in front, the tibia from above and in front, and the patella, turned over, from
behind. A start for a first registration and nothing more: its answer is judged like every other.
"""

from collections.abc import Iterable
from types import MappingProxyType

import numpy as np

from navapp.geometry.directions import ViewCone

# In the plan's axes: x to the patient's left, y to the back, z up along the leg.
_USUAL = MappingProxyType(
    {"femur": (0.0, -0.5, -0.87), "tibia": (0.0, -0.9, 0.44), "patella": (0.0, 1.0, 0.0)}
)
# Knees are bent more or less, and tables turned.
_HALF_ANGLE_DEG = 40.0


def usual_approaches(bones: Iterable[str]) -> dict[str, ViewCone]:
    """Of those of the named bones for which there is a usual one."""
    return {
        bone: ViewCone(np.array(_USUAL[bone]), _HALF_ANGLE_DEG) for bone in bones if bone in _USUAL
    }
