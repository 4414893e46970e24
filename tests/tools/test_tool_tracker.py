"""Following a tool: where it is looked for, and what is not believed."""

from typing import Any

import numpy as np
import pytest

from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.tools.marker_finder import Box
from navapp.tools.plate_meter import PlatePose
from navapp.tools.tool import SeenTool
from navapp.tools.tool_tracker import ToolTracker, Unseen
from sim_devices.rigs import make_default_rig
from tests.tools.plates_in_view import held, pictures_of, shape_of
from tests.tools.seen_tools import TIP_MM, tool_of

RIG = make_default_rig()
BLANK = (np.zeros((720, 1280), np.uint8), np.zeros((720, 1280), np.uint8))
CERTAIN = np.diag([1e-4] * 3 + [1e-8] * 3)
MS = 1_000_000


class ScriptedMeter:
    """Sees the plate where it is told, and remembers where it was sent to look."""

    def __init__(self) -> None:
        self.pose: RigidTransform | str = held().rename("left", "plate")
        self.covariance: FloatArray = CERTAIN
        self.boxes: list[tuple[Box | None, Box | None]] = []

    def measure(self, pictures: Any, boxes: tuple[Box | None, Box | None]) -> PlatePose | str:
        self.boxes.append(boxes)
        if isinstance(self.pose, str):
            return self.pose
        fit: Any = None
        return PlatePose(self.pose, self.covariance, 0.9, fit)


@pytest.fixture
def meter() -> ScriptedMeter:
    return ScriptedMeter()


@pytest.fixture
def tracker(meter: ScriptedMeter) -> ToolTracker:
    tracker = ToolTracker(tool_of(), RIG)
    tracker._meter = meter  # type: ignore[assignment]
    return tracker


def test_a_tool_in_pictures_is_followed_by_its_tip() -> None:
    tracker = ToolTracker(tool_of(), RIG)
    for number, place in enumerate(((0.0, 0.0, 430.0), (6.0, -3.0, 428.0))):
        pose = held((20.0, -15.0, -80.0), place)
        seen = tracker.track(pictures_of(shape_of(tool_of().plate), pose), 66 * MS * number)
        assert isinstance(seen, SeenTool)
        assert seen.captured_ns == 66 * MS * number
        assert np.linalg.norm(seen.tip_mm - pose.apply(TIP_MM)) < 0.5
        assert seen.tip_bound_mm < 1.0


def test_after_the_first_sight_it_is_looked_for_in_a_box(
    tracker: ToolTracker, meter: ScriptedMeter
) -> None:
    tracker.track(BLANK, 0)
    tracker.track(BLANK, 66 * MS)
    assert meter.boxes[0] == (None, None)
    # At 100 mm/s to any side it is in the box of either eye.
    for way in np.vstack([np.eye(3), -np.eye(3)]):
        moved = held().move((*(6.6 * way), 0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
        corners = moved.apply(tool_of().plate.corners_mm.reshape(-1, 3))
        eyes = (RIG.left.project(corners), RIG.right.project(RIG.right_from_left.apply(corners)))
        for box, pixels in zip(meter.boxes[1], eyes, strict=True):
            assert box is not None
            x, y, width, height = box
            assert (pixels >= (x, y)).all()
            assert (pixels < (x + width, y + height)).all()
            assert width * height < 0.5 * 1280 * 720


def test_the_box_grows_with_time_and_stays_in_the_picture(
    tracker: ToolTracker, meter: ScriptedMeter
) -> None:
    meter.pose = held(place_mm=(-110.0, -60.0, 430.0)).rename("left", "plate")
    tracker.track(BLANK, 0)
    meter.pose = "no marker is seen by both cameras"
    tracker.track(BLANK, 50 * MS)
    tracker.track(BLANK, 400 * MS)
    early, late = meter.boxes[1][0], meter.boxes[2][0]
    assert early is not None
    assert late is not None
    assert late[2] > early[2]
    for x, y, width, height in (early, late):
        assert x >= 0
        assert y >= 0
        assert x + width <= 1280
        assert y + height <= 720


def test_after_half_a_second_the_whole_picture_is_looked_at(
    tracker: ToolTracker, meter: ScriptedMeter
) -> None:
    tracker.track(BLANK, 1000 * MS)
    meter.pose = "no marker is seen by both cameras"
    assert tracker.track(BLANK, 1500 * MS) == Unseen("no marker is seen by both cameras")
    tracker.track(BLANK, 1501 * MS)
    # A clock that went back tells nothing.
    tracker.track(BLANK, 999 * MS)
    assert None not in meter.boxes[1]
    assert meter.boxes[2:] == [(None, None), (None, None)]


def test_an_uncertain_tip_is_not_believed_and_not_followed(
    tracker: ToolTracker, meter: ScriptedMeter
) -> None:
    # By the angle alone: the tip lies 137 mm from the plate.
    meter.covariance = np.diag([1e-4] * 3 + [(0.4 / 137.0) ** 2] * 3)
    found = tracker.track(BLANK, 0)
    assert found == Unseen("the plate is seen, but the tip is not known within a millimetre")
    tracker.track(BLANK, 10 * MS)
    assert meter.boxes[1] == (None, None)
    meter.covariance = np.diag([1e-4] * 3 + [(0.3 / 137.0) ** 2] * 3)
    assert isinstance(tracker.track(BLANK, 20 * MS), SeenTool)


def test_a_badly_calibrated_tip_is_not_believed(meter: ScriptedMeter) -> None:
    tracker = ToolTracker(tool_of(tip_sigma_mm=0.4), RIG)
    tracker._meter = meter  # type: ignore[assignment]
    assert isinstance(tracker.track(BLANK, 0), Unseen)
