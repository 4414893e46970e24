from dataclasses import replace

import numpy as np
import pytest

from navapp.tracking.box_guide import BoxGuide
from navapp.tracking.box_tracker import BoxState
from navapp.tracking.picture_box import PictureBox
from navapp.values import LineTimings, PoseEstimate, Status, TrackedFrame, Verdict
from tests.tracking.rooms import room


def guide() -> BoxGuide:
    a = room()
    return BoxGuide(a.rig, a.line.model)


@pytest.mark.parametrize("shift", [(60.0, -20.0, 0.0), (-90.0, 25.0, 0.0), (30.0, 10.0, -120.0)])
def test_a_box_moves_the_pose_to_where_it_was_made(shift) -> None:
    """Depth follows the size of the box only when it changed clearly."""
    a = room()
    truth = a.truth(a.frames[0])
    centre_mm = truth.apply(a.line.centre_mm)
    elsewhere = truth.moved((*shift, 0, 0, 0), centre_mm)
    found = guide().moved(truth, guide().projected(elsewhere))
    off_mm = found.apply(a.line.centre_mm) - elsewhere.apply(a.line.centre_mm)
    np.testing.assert_allclose(off_mm[:2], 0.0, atol=4.0)
    assert abs(off_mm[2]) < 20.0
    np.testing.assert_array_equal(found.rotation, truth.rotation)
    assert found.name == truth.name


def test_a_box_a_few_percent_larger_leaves_the_depth() -> None:
    a = room()
    truth = a.truth(a.frames[0])
    box = guide().projected(truth).moved(np.array([40.0, 0.0]), 1.06)
    found = guide().moved(truth, box)
    assert found.translation_mm[2] == pytest.approx(truth.translation_mm[2], abs=2.0)
    assert found.translation_mm[0] - truth.translation_mm[0] == pytest.approx(13.0, abs=2.0)


def test_a_search_starts_from_the_box_and_from_where_it_was() -> None:
    truth = room().truth(room().frames[0])
    box = guide().projected(truth)
    picture = np.zeros((180, 320), np.uint8)
    assert guide().starts(truth, None) == [truth]
    assert guide().starts(truth, BoxState(picture, None)) == [truth]
    assert guide().starts(truth, BoxState(picture, box.resized(0.25))) == [truth]
    far = box.moved(np.array([200.0, 0.0]))
    first, second = guide().starts(truth, BoxState(picture, far.resized(0.25)))
    assert second is truth
    assert guide().projected(first).overlap(far) > 0.9


def test_only_an_ok_frame_teaches() -> None:
    a = room()
    truth, left = a.truth(a.frames[0]), a.frames[0].left
    estimate = PoseEstimate(truth, np.eye(6), 500, 1.0, 0.2, 0.2, 3, True)
    ok = TrackedFrame("femur", estimate, Verdict(Status.OK), LineTimings())
    doubted = replace(ok, verdict=Verdict(Status.DEGRADED))
    lost = replace(ok, verdict=Verdict(Status.LOST))
    assert guide().placed(None, left, ok).memory is not None
    state = guide().placed(None, left, doubted)
    assert state.memory is None
    assert isinstance(state.box, PictureBox)
    assert guide().placed(state, left, lost) is state


def test_a_pose_behind_the_camera_has_no_box() -> None:
    truth = room().truth(room().frames[0])
    behind = truth.moved((0, 0, -2000.0, 0, 0, 0), np.zeros(3))
    assert guide().projected(behind) is None
