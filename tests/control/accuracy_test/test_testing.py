"""An accuracy test on tips that the test gives."""

import numpy as np
import pytest

from drivers.clock import ManualClock
from navapp.control.accuracy_test.states import Back, Leave, Take
from navapp.control.accuracy_test.testing import N_LEANING, N_RESTING, AccuracyTesting
from navapp.geometry.transform import RigidTransform, rotation_from_vector
from navapp.tools.accuracy_tasks import Task
from navapp.tools.tool import SeenTool
from navapp.tools.tool_tracker import ToolTracker, Unseen
from tests.control.fakes import FakeCamera, a_rig
from tests.control.held_pointer import POINTER, TIP_MM

POINT, ROTATION = Task("centre", "point", 0, 4), Task("centre", "rotation", 1, 4)
PLACE_MM = np.array([3.0, 4.0, 450.0])


class Tips:
    """Stands for what is seen of the pointer."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.tip_mm, self.lean_rad, self.step_mm, self.step_rad = PLACE_MM, 0.0, 0.0, 0.0
        self.is_seen = True
        monkeypatch.setattr(ToolTracker, "track", self._track)

    def _track(self, pictures, captured_ns: int) -> SeenTool | Unseen:
        if not self.is_seen:
            return Unseen("no marker is seen by both cameras")
        self.tip_mm = self.tip_mm + np.array([self.step_mm, 0.0, 0.0])
        self.lean_rad += self.step_rad
        turn = rotation_from_vector((self.lean_rad, 0.0, 0.0))
        pose = RigidTransform.from_parts("left", "plate", turn, self.tip_mm - turn @ TIP_MM)
        return SeenTool(POINTER, pose, 1e-6 * np.eye(6), 1.0, captured_ns)


@pytest.fixture
def tips(monkeypatch: pytest.MonkeyPatch) -> Tips:
    return Tips(monkeypatch)


def started(*tasks: Task) -> AccuracyTesting:
    clock = ManualClock(10**9)
    camera = FakeCamera(clock)
    camera.open()
    return AccuracyTesting(camera, clock, a_rig(), POINTER, tasks)


def take(session: AccuracyTesting, n_frames: int) -> None:
    session.submit(Take())
    for _ in range(n_frames + 1):
        session.step()


def test_nothing_is_taken_before_somebody_says_so(tips: Tips) -> None:
    session = started(POINT)
    for _ in range(3 * N_RESTING):
        session.step()
    assert session.taken == []
    assert session.snapshot.bound_mm is not None


def test_a_resting_tip_is_taken_and_the_next_task_begins(tips: Tips) -> None:
    session = started(POINT, ROTATION)
    take(session, N_RESTING)
    assert [one.task for one in session.taken] == [POINT] * N_RESTING
    np.testing.assert_allclose(session.taken[0].tip_mm, PLACE_MM)
    assert session.snapshot.task == ROTATION
    assert not session.snapshot.is_taking
    assert session.snapshot.n_kept == 1


def test_a_moving_tip_is_not_taken(tips: Tips) -> None:
    tips.step_mm = 1.0
    session = started(POINT)
    take(session, 5 * N_RESTING)
    assert session.taken == []


def test_a_leaning_tool_gives_poses_that_differ(tips: Tips) -> None:
    session = started(ROTATION)
    take(session, 3 * N_LEANING)
    assert session.taken == []  # it is not leaned
    tips.step_rad = 0.03
    take(session, N_LEANING)
    assert len(session.taken) == N_LEANING
    assert session.snapshot.is_over


def test_the_last_task_is_done_again(tips: Tips) -> None:
    session = started(POINT, ROTATION)
    take(session, N_RESTING)
    session.submit(Back())
    session.step()
    assert session.taken == []
    assert session.snapshot.task == POINT


def test_left_it_keeps_what_was_taken(tips: Tips) -> None:
    session = started(POINT, ROTATION)
    take(session, N_RESTING)
    session.submit(Leave())
    assert session.step().is_over
    assert len(session.taken) == N_RESTING


def test_a_tool_that_is_not_seen_is_said(tips: Tips) -> None:
    tips.is_seen = False
    session = started(POINT)
    take(session, 2)
    assert session.snapshot.missing == "no marker is seen by both cameras"
    assert session.snapshot.bound_mm is None
