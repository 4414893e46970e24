"""What is shown of a plan: contours, and the points near a slice."""

import numpy as np
import pytest

from navapp.preop import PlanOrigin, make_plan_view
from navapp.preop.plan_view import name_points
from navapp.preop.slice_volume import SliceVolume
from navapp.preop.slices import DIRECTIONS, SliceGrid
from navapp.values import BoneModel, Landmark, Plan, SurgicalContent
from tests.geometry.shapes import sphere

AXIAL = DIRECTIONS[0]
RADIUS_MM = 12.0
CONTENT = SurgicalContent(
    landmarks={
        "femur/notch": Landmark(np.array([1.0, 2.0, 3.2]), None, "contents"),
        "femur/hip": Landmark(np.array([0.0, 0.0, 400.0]), None, "contents"),
    }
)


def make_plan(**changes) -> Plan:
    targets = {
        "femur/entry": np.array([4.0, 5.0, 3.0]),
        "femur/rim": np.array([[0.0, 0.0, 2.4], [0.0, 0.0, 3.6], [1.0, 0.0, 2.5]]),
        "femur/notch": np.array([[9.0, 9.0, 9.0]]),
        "femur/none": np.empty((0, 3)),
    }
    given = {"targets": targets, "content": CONTENT, **changes}
    return Plan({"femur": BoneModel("femur", sphere(RADIUS_MM, 40), "left")}, **given)


def test_points_of_one_name_are_counted_and_a_landmark_goes_before_a_target_of_its_name() -> None:
    named = name_points(make_plan())
    assert set(named) == {
        "femur/notch", "femur/hip", "femur/entry", "femur/rim 1", "femur/rim 2", "femur/rim 3"
    }  # fmt: skip
    assert named["femur/notch"].tolist() == [1.0, 2.0, 3.2]


def test_a_slice_shows_what_lies_within_half_a_step_of_it() -> None:
    view = make_plan_view(make_plan())
    (index,) = view.grid.find_slices(AXIAL, np.array([[0.0, 0.0, 3.0]]))
    assert view.grid.position_mm(AXIAL, int(index)) == 3.0
    points = view.find_points(AXIAL, int(index))
    assert list(points) == ["femur/notch", "femur/entry", "femur/rim 3"]
    expected = view.grid.find_pixels(AXIAL, np.array([4.0, 5.0, 3.0]))
    np.testing.assert_array_equal(points["femur/entry"], expected)
    assert list(view.find_points(AXIAL, int(index) - 1)) == ["femur/rim 1"]
    assert view.find_points(AXIAL, 0) == {}


def test_slices_with_points_are_known_and_what_lies_beyond_the_grid_is_not_among_them() -> None:
    view = make_plan_view(make_plan())
    positions = [view.grid.position_mm(AXIAL, int(k)) for k in view.list_pointed(AXIAL)]
    assert positions == [2.0, 3.0, 4.0]
    coronal = DIRECTIONS[1]
    (index,) = view.grid.find_slices(coronal, np.zeros((1, 3)))
    assert "femur/hip" not in view.find_points(coronal, int(index))
    assert view.points_beyond == ("femur/hip",)
    bare = make_plan_view(make_plan(targets={}, content=SurgicalContent()))
    assert len(bare.list_pointed(AXIAL)) == 0
    assert bare.find_points(AXIAL, 5) == {}


@pytest.mark.parametrize("direction", DIRECTIONS, ids=lambda one: one.name)
def test_a_contour_surrounds_its_bone_in_the_slice_s_pixels(direction) -> None:
    view = make_plan_view(make_plan())
    middle = int(view.grid.find_slices(direction, np.zeros((1, 3)))[0])
    segments = view.find_contours(direction, middle + 4)["femur"]
    centre = view.grid.find_pixels(direction, np.zeros(3))
    radius = np.linalg.norm(segments - centre, axis=2)
    np.testing.assert_allclose(radius, np.sqrt(RADIUS_MM**2 - 16.0), atol=0.1)
    assert view.find_contours(direction, 0) == {}


def test_it_is_said_what_the_slices_are_of() -> None:
    grid = SliceGrid((0.0, 0.0, 0.0), 1.0, (2, 2, 2))
    grey = np.zeros((2, 2, 2), np.uint8)
    plan = make_plan()
    ct, labels = PlanOrigin("CT"), PlanOrigin("labels")
    said = [
        make_plan_view(plan).slices_words,
        make_plan_view(plan, ct).slices_words,
        make_plan_view(plan, ct, SliceVolume(grid, grey, (-200.0, 1400.0))).slices_words,
        make_plan_view(plan, labels, SliceVolume(grid, grey)).slices_words,
    ]
    assert "without a CT" in said[0]
    assert "made without slices" in said[1]
    assert "of the CT" in said[2]
    assert "of the segmentation" in said[3]
