"""Colours of the guides, BGR: told apart also by eyes that do not tell red from green.

Source: Okabe and Ito 2008, lightened for a picture of tissue.
"""

import numpy as np
from numpy.typing import NDArray

Colour = tuple[int, int, int]

# The bone's outline: navigable, or a candidate that nobody has accepted.
GUIDE: Colour = (120, 230, 60)
CANDIDATE: Colour = (40, 180, 255)

PLANE: Colour = (240, 190, 80)  # sky blue
DRILL: Colour = (210, 140, 235)  # pink
PART: Colour = (235, 235, 235)  # near white
TARGET: Colour = (255, 240, 80)  # cyan
DEFECT: Colour = (60, 60, 235)  # red
SCALE: Colour = (235, 235, 235)
# What keeps away from risk structures: the bone within their safety distance.
SAFETY: Colour = (0, 110, 240)  # vermilion

ARTERY: Colour = (60, 60, 235)
VEIN: Colour = (220, 90, 60)
NERVE: Colour = (60, 220, 250)
OTHER_RISK: Colour = (0, 150, 250)

_RISKS = {"artery": ARTERY, "vein": VEIN, "nerve": NERVE}

# Bone that is still to be removed: little is dark blue, much is yellow; both eyes and printers
# tell its lightness.
REMOVAL_RAMP: tuple[Colour, ...] = (
    (110, 60, 40),
    (130, 100, 60),
    (125, 125, 125),
    (90, 165, 165),
    (60, 200, 225),
    (70, 235, 255),
)


def risk_colour(name: str) -> Colour:
    """Of a vessel or a nerve, by its name."""
    return next((colour for key, colour in _RISKS.items() if key in name), OTHER_RISK)


def one_colour(colour: Colour) -> NDArray[np.float32]:
    """(1, 3) for all triangles of a mesh."""
    return np.array([colour], dtype=np.float32)
