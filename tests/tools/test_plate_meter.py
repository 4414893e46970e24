"""Plates in simulated pictures: measured where they are, and refused where they are not seen."""

from dataclasses import replace
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from navapp.geometry.transform import RigidTransform, rotation_angle_deg
from navapp.tools.marker_finder import MarkerFinder
from navapp.tools.plate import Plate
from navapp.tools.plate_meter import PlateMeter, PlatePose
from sim_devices.held_tool import Cover
from sim_devices.printed_plate import PlateLayout
from sim_devices.rigs import make_default_rig
from sim_devices.tool_shapes import make_tool
from tests.tools.plates_in_view import Pictures, held, pictures_of, shape_of

RIG = make_default_rig()
FLAT = Plate(first_id=0)
FOLDED = Plate(first_id=20, faces=3, fold_deg=50.0)
POSES = {
    "facing": held(),
    "leaned": held((35.0, -20.0, -80.0), (-30.0, 25.0, 450.0)),
    "far": held((-25.0, 30.0, 140.0), (45.0, -20.0, 540.0)),
    "flat": held((50.0, 0.0, 20.0), (0.0, 10.0, 350.0)),
}


@pytest.fixture(scope="module")
def meter() -> PlateMeter:
    return PlateMeter(FLAT, RIG)


@pytest.fixture(scope="module")
def facing() -> Pictures:
    return pictures_of(shape_of(FLAT), POSES["facing"])


def measured(meter: PlateMeter, pictures: Pictures) -> PlatePose:
    found = meter.measure(pictures)
    assert isinstance(found, PlatePose), found
    return found


def assert_there(found: PlatePose, pose: RigidTransform, mm: float = 0.1, deg: float = 0.2) -> None:
    off = found.left_from_plate.translation_mm - pose.translation_mm
    assert np.linalg.norm(off) < mm
    assert rotation_angle_deg(found.left_from_plate, pose) < deg


@pytest.mark.parametrize("name", POSES)
def test_a_plate_in_both_pictures_is_found_where_it_is(name: str, meter: PlateMeter) -> None:
    found = measured(meter, pictures_of(shape_of(FLAT), POSES[name]))
    assert_there(found, POSES[name])
    assert found.seen_share > 0.8


@pytest.mark.release
def test_faces_that_are_folded_away_are_measured_too() -> None:
    meter = PlateMeter(FOLDED, RIG)
    shape = shape_of(FOLDED)
    # Only the second face, then the third, is turned to the cameras.
    for turn_deg in ((0.0, 55.0, 0.0), (10.0, 100.0, 0.0)):
        pose = held(turn_deg, (0.0, 0.0, 430.0))
        assert_there(measured(meter, pictures_of(shape, pose)), pose, 0.4, 0.5)


@pytest.mark.release
def test_errors_are_as_large_as_the_covariance_says(meter: PlateMeter) -> None:
    rng = np.random.default_rng(8)
    shape = shape_of(FLAT, seed=5, errors=1.0)
    squares = []
    for number in range(12):
        pose = held(
            rng.uniform(-35.0, 35.0, 3), rng.uniform(-30.0, 30.0, 3) + np.array([0.0, 0.0, 440.0])
        ).rename("left", "plate")
        found = measured(meter, pictures_of(shape, pose.rename("left", "tool"), None, number))
        off = found.left_from_plate.twist_to(pose, np.zeros(3))
        squares.append(off @ np.linalg.solve(found.covariance, off))
    # Of six; one paper stands for all, so that its luck is in all of them.
    assert 1.0 < np.mean(squares) < 15.0


@pytest.mark.parametrize("direction_rad", [0.3, 1.9, 3.4, 5.0])
def test_a_plate_that_is_half_covered_is_still_found(
    direction_rad: float, meter: PlateMeter
) -> None:
    pose = POSES["leaned"]
    found = measured(meter, pictures_of(shape_of(FLAT), pose, Cover(direction_rad, 0.0)))
    assert_there(found, pose, 0.25, 0.5)
    assert 0.2 < found.seen_share < 0.8


def test_what_is_covered_makes_the_pose_less_certain(meter: PlateMeter, facing: Pictures) -> None:
    whole = measured(meter, facing)
    half = measured(meter, pictures_of(shape_of(FLAT), POSES["facing"], Cover(0.3, 0.0)))
    ratio = np.linalg.det(half.covariance) / np.linalg.det(whole.covariance)
    assert ratio > 4.0


def test_a_plate_out_of_view_is_a_word(meter: PlateMeter, facing: Pictures) -> None:
    nothing = "no marker is seen by both cameras"
    assert meter.measure(pictures_of(shape_of(FLAT), None)) == nothing
    blank = np.full_like(facing[0], 60)
    assert meter.measure((facing[0], blank)) == nothing
    assert meter.measure((blank, facing[1])) == nothing


def test_another_plates_markers_are_not_this_plate(facing: Pictures) -> None:
    other = PlateMeter(Plate(first_id=4), RIG)
    assert other.measure(facing) == "no marker is seen by both cameras"


@pytest.mark.parametrize("plate", [FLAT, Plate(columns=1, rows=1)], ids=["four", "one"])
@pytest.mark.parametrize("first_id", [8, 40, 61])
def test_markers_with_another_inside_are_refused(first_id: int, plate: Plate) -> None:
    """Borders are where they should be, but what is inside of them is another marker's."""
    printed = replace(plate, first_id=first_id)
    pictures = pictures_of(shape_of(printed), held((20.0, 10.0, 0.0), (5.0, 0.0, 400.0)))
    meter = PlateMeter(plate, RIG)
    # A detector that takes the one for the other.
    meter._finder = MarkerFinder(printed)
    assert meter.measure(pictures) == "no marker is seen whole"
    assert isinstance(PlateMeter(printed, RIG).measure(pictures), PlatePose)


def test_one_right_marker_beside_three_wrong_ones_is_another_plate(meter: PlateMeter) -> None:
    layout = PlateLayout("DICT_4X4_100", (0, 41, 52, 63), 2, 20.0, 16.0)
    shape = make_tool("pointer", (layout,), np.eye(4)[None], 1, errors=0.0)
    pose = held((20.0, 10.0, 0.0), (5.0, 0.0, 400.0))
    assert meter.measure(pictures_of(shape, pose)) == "another plate's markers"


def test_a_plate_that_is_not_flat_is_refused(meter: PlateMeter, facing: Pictures) -> None:
    y, x = np.mgrid[0:720, 0:1280].astype(np.float32)
    waves = 1.3 * np.sin(x / 6.0 + y / 9.0)
    left, right = (
        np.asarray(cv2.remap(one, x + waves, y - waves, cv2.INTER_LINEAR), dtype=np.uint8)
        for one in facing
    )
    assert meter.measure((left, right)) == "edges do not agree"


def test_markers_are_looked_for_in_the_box_alone(meter: PlateMeter, facing: Pictures) -> None:
    whole = measured(meter, facing)
    middle = [
        camera.project(pose.apply(np.zeros((1, 3))))[0].astype(int)
        for camera, pose in (
            (RIG.left, POSES["facing"]),
            (RIG.right, RIG.right_from_left @ POSES["facing"]),
        )
    ]
    left, right = ((int(x) - 120, int(y) - 120, 240, 240) for x, y in middle)
    found = meter.measure(facing, (left, right))
    assert isinstance(found, PlatePose)
    off = found.left_from_plate.twist_to(whole.left_from_plate, np.zeros(3))
    np.testing.assert_allclose(off, np.zeros(6), atol=0.02)
    assert isinstance(meter.measure(facing, (left, (0, 0, 200, 200))), str)


def test_a_marker_beside_its_place_is_not_the_plate(meter: PlateMeter, facing: Pictures) -> None:
    """Two pictures of different poses belong to no pose."""
    elsewhere = pictures_of(shape_of(FLAT), held((0.0, 25.0, 30.0), (14.0, 12.0, 460.0)))
    assert isinstance(meter.measure((facing[0], elsewhere[1])), str)


def test_swapped_pictures_give_a_word(meter: PlateMeter, facing: Pictures) -> None:
    """Everything would lie behind the cameras."""
    assert isinstance(meter.measure((facing[1], facing[0])), str)


def test_markers_that_are_there_twice_are_nobodys(meter: PlateMeter, facing: Pictures) -> None:
    """A spare print lies on the table: no pair of left and right copies makes a pose."""
    doubled = []
    for picture in facing:
        shown = picture.copy()
        rows, columns = np.nonzero(picture > 120)
        part = picture[rows.min() : rows.max(), columns.min() : columns.max()]
        shown[: part.shape[0], -part.shape[1] :] = part
        doubled.append(shown)
    assert isinstance(meter.measure((doubled[0], doubled[1])), str)


@pytest.mark.filterwarnings("error")
def test_a_plate_of_which_no_border_is_in_sight_is_judged_by_its_insides(meter: PlateMeter) -> None:
    inside = np.flatnonzero(~meter._edges.is_border)
    located = SimpleNamespace(kept=inside, shown=inside)
    assert meter._judge_eye(located, np.ones(len(inside), dtype=bool)) == 1.0
