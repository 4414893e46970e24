"""Colours that tell what is drawn."""

import numpy as np
import pytest

from navapp.overlay import colours


@pytest.mark.parametrize(
    ("name", "colour"),
    [
        ("popliteal_artery", colours.ARTERY),
        ("vein", colours.VEIN),
        ("tibial nerve", colours.NERVE),
        ("peroneus", colours.OTHER_RISK),
    ],
)
def test_a_risk_structure_has_the_colour_of_its_kind(name: str, colour: colours.Colour) -> None:
    assert colours.risk_colour(name) == colour


def test_more_bone_to_be_removed_is_brighter() -> None:
    """To be told without hues, and on paper."""
    luma = np.array(colours.REMOVAL_RAMP) @ (0.114, 0.587, 0.299)
    assert (np.diff(luma) > 5.0).all()
