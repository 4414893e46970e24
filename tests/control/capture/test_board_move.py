import numpy as np
import pytest

from navapp.control.capture.board_move import find_move
from navapp.geometry.transform import RigidTransform, rotation_from_vector

MIDDLE_MM = np.array([80.0, 60.0, 0.0])


def held(middle_mm=(0.0, 0.0, 450.0), turn_deg=(0.0, 0.0, 0.0)) -> RigidTransform:
    rotation = rotation_from_vector(np.radians(turn_deg))
    place = np.asarray(middle_mm) - rotation @ MIDDLE_MM
    return RigidTransform.from_parts("left", "board", rotation, place)


@pytest.mark.parametrize(
    ("wanted", "text"),
    [
        (held((-40.0, 0.0, 390.0)), "move it 40 mm to the left, 60 mm nearer"),
        (held((0.0, 30.0, 500.0)), "move it 30 mm down, 50 mm farther away"),
        (held(turn_deg=(-20.0, 0.0, 0.0)), "tilt its top away by 20 deg"),
        (held(turn_deg=(0.0, 25.0, 0.0)), "turn its left side away by 25 deg"),
        (held(turn_deg=(0.0, 0.0, -90.0)), "turn it counter-clockwise by 90 deg"),
        (held((4.0, 3.0, 452.0), (2.0, 0.0, 0.0)), "hold it still"),
    ],
)
def test_the_way_is_said_in_words(wanted, text):
    found = find_move(held(), wanted, MIDDLE_MM)
    assert text in str(found)
    assert found.is_there is (text == "hold it still")


def test_the_words_are_true():
    """A corner at the top of the picture is farther away after 'tilt its top away'."""
    top = MIDDLE_MM + np.array([0.0, -50.0, 0.0])
    left = MIDDLE_MM + np.array([-50.0, 0.0, 0.0])
    assert held(turn_deg=(-20.0, 0.0, 0.0)).apply(top)[2] > held().apply(top)[2] + 10.0
    assert held(turn_deg=(0.0, 25.0, 0.0)).apply(left)[2] > held().apply(left)[2] + 10.0
    turned = held(turn_deg=(0.0, 0.0, -30.0)).apply(top)
    assert turned[0] < held().apply(top)[0] - 10.0  # what was at the top goes to the left


def test_only_the_largest_three_parts_are_said():
    text = str(find_move(held(), held((100.0, 80.0, 500.0), (28.0, 30.0, 20.0)), MIDDLE_MM))
    assert len(text.replace(";", ",").split(",")) == 3
