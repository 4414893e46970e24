"""Going through the slices of a plan."""

import numpy as np

from navapp.preop import make_plan_view
from navapp.ui.slice_walk import SliceWalk
from navapp.values import BoneModel, Plan
from tests.geometry.shapes import sphere
from tests.ui import plans


def position_mm(walk: SliceWalk) -> float:
    return walk.plan.grid.position_mm(walk.direction, walk.index)


def test_a_walk_begins_in_the_middle_of_the_first_bone() -> None:
    walk = SliceWalk(plans.with_ct())
    for number in (1, 2, 3):
        walk.choose(number)
        assert position_mm(walk) == 0.0


def test_each_direction_keeps_its_slice_and_ends_at_the_first_and_the_last() -> None:
    walk = SliceWalk(plans.with_ct())
    walk.scroll(5)
    walk.turn(1)
    assert walk.direction.name == "coronal"
    walk.scroll(-1000)
    assert walk.index == 0
    walk.turn(-1)
    assert (walk.direction.name, position_mm(walk)) == ("axial", 5.0)
    walk.turn(-1)
    assert walk.direction.name == "sagittal"
    walk.scroll(1000)
    assert walk.index == walk.plan.grid.count_slices(walk.direction) - 1


def test_it_goes_from_landmark_to_landmark_and_round() -> None:
    walk = SliceWalk(plans.with_ct())
    found = []
    for _ in range(4):
        assert walk.go_to_point(1)
        found.append(position_mm(walk))
    assert found == [9.0, -18.0, -17.0, 9.0]
    assert walk.go_to_point(-1)
    assert position_mm(walk) == -17.0
    walk.scroll(1)
    assert walk.go_to_point(-1)
    assert position_mm(walk) == -17.0


def test_a_plan_without_points_has_none_to_go_to() -> None:
    walk = SliceWalk(make_plan_view(Plan({"femur": BoneModel("femur", sphere(9.0, 9))})))
    assert not walk.go_to_point(1)
    assert position_mm(walk) == 0.0


def test_the_densities_change_and_come_back() -> None:
    walk = SliceWalk(plans.with_ct())
    assert walk.window_hu is None
    walk.change_window()
    assert walk.window == "soft tissue"
    assert np.diff(walk.window_hu) == 400.0
    walk.change_window()
    assert walk.window_hu is None
