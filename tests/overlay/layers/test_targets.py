"""Targets, and points that only the error is judged by."""

import numpy as np
import pytest

from navapp.overlay.colours import TARGET
from tests.overlay.scenes import TARGET as POINT
from tests.overlay.scenes import draw, is_colour, pixels_of, scene, seen, words

BEFORE = POINT - (0.0, 0.0, 10.0)


@pytest.mark.parametrize("shape", [(3,), (1, 3)])
def test_a_target_of_one_point_is_a_cross_with_its_name(shape) -> None:
    given = seen(scene(targets={"femur/notch": BEFORE.reshape(shape)}))
    u, v = pixels_of(BEFORE)[0]
    drawn = is_colour(draw("targets", given), TARGET)
    assert drawn[v, u - 4 : u + 5].all()
    assert drawn[v - 4 : v + 5, u].all()
    assert drawn.sum() < 100
    assert words("targets", given) == ["notch"]


def test_a_group_of_points_is_not_drawn() -> None:
    points = BEFORE + np.array([[0.0, 0, 0], [12, 0, 0], [0, 12, 0]])
    given = seen(scene(targets={"femur/notch": points}))
    assert not draw("targets", given).any()
    assert words("targets", given) == []


def test_targets_of_another_bone_or_of_another_stage_are_not_drawn() -> None:
    targets = {"tibia/plateau": BEFORE, "femur/other": BEFORE}
    assert not draw("targets", seen(scene(targets=targets))).any()
