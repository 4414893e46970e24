"""A tool's guided calibration on poses that the test gives: phases, answers, commands."""

from datetime import date

import numpy as np
import pytest

from drivers.clock import ManualClock
from navapp.control.tool_calibration.calibrating import ToolCalibrating, ToolSettings
from navapp.control.tool_calibration.states import Again, Finish, Leave, ToolPhase, ToolSnapshot
from navapp.errors import DeviceLost
from navapp.geometry.transform import RigidTransform, rotation_from_vector
from navapp.tools.paper import count_parameters
from navapp.tools.plate import Plate
from navapp.tools.plate_fit import PlateFit
from navapp.tools.plate_meter import PlateMeter, PlatePose
from tests.control.fakes import FakeCamera, a_rig

PLATE = Plate()
TIP_MM, HOLE_MM = np.array([1.0, 78.0, 112.0]), np.array([0.0, 20.0, 450.0])
AXIS = np.array([0.0, 0.6, 0.8])


class GivenPoses:
    """Stands for what is measured of the plate, frame by frame."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.rng = np.random.default_rng(3)
        self.deeds: list[str] = []
        self.number = 0
        self.is_seen, self.lean_rad = True, 0.6
        monkeypatch.setattr(PlateMeter, "measure", self._measure)

    def begin(self, deed: str) -> None:
        """As a simulated hand is told."""
        self.deeds.append(deed)

    def _measure(self, pictures, boxes=(None, None)) -> PlatePose | str:
        self.number += 1
        if not self.is_seen:
            return "no marker is seen by both cameras"
        turn = self._pivot() if self.deeds[-1] == "pivot" else self._turn()
        shift = HOLE_MM - turn @ TIP_MM + 0.02 * self.rng.standard_normal(3)
        pose = RigidTransform.from_parts("left", "plate", turn, shift)
        return PlatePose(pose, np.diag([1e-4] * 3 + [1e-8] * 3), 0.9, a_fit(pose))

    def _pivot(self) -> np.ndarray:
        around = 0.35 * self.number
        lean = self.lean_rad * abs(np.sin(0.17 * around))
        return rotation_from_vector(lean * np.array([np.cos(around), np.sin(around), 0.0]))

    def _turn(self) -> np.ndarray:
        leaned = rotation_from_vector((0.15 * len(self.deeds), 0.0, 0.0))
        return leaned @ rotation_from_vector(np.sin(0.1 * self.number) * AXIS)


def a_fit(pose: RigidTransform) -> PlateFit:
    """Of paper that is as it was designed."""
    n = count_parameters(PLATE)
    return PlateFit(
        pose, np.eye(6), np.zeros(2), np.zeros(n), np.eye(n), np.zeros(n), np.zeros((6, n)),
        0.05, np.ones(4),
    )  # fmt: skip


@pytest.fixture
def given(monkeypatch: pytest.MonkeyPatch) -> GivenPoses:
    return GivenPoses(monkeypatch)


def calibrating(given: GivenPoses, *, has_axis: bool = False) -> ToolCalibrating:
    clock = ManualClock(10**9)
    camera = FakeCamera(clock)
    camera.open()
    return ToolCalibrating(camera, clock, a_rig(), PLATE, ToolSettings(has_axis), given)


def run(session: ToolCalibrating, n: int = 600) -> ToolSnapshot:
    for _ in range(n):
        if session.step().is_over:
            break
    return session.snapshot


def test_a_pointer_is_done_when_its_tip_is_known(given: GivenPoses) -> None:
    session = calibrating(given)
    snapshot = run(session)
    assert snapshot.phase is ToolPhase.DONE
    assert snapshot.bound_mm <= snapshot.stop_mm
    tool, pivot, axis = session.collected.solve(date(2026, 1, 2), "rig")
    np.testing.assert_allclose(tool.tip_mm, TIP_MM, atol=0.1)
    assert axis is None
    assert tool.axis is None
    assert (tool.made_on, tool.rig_id) == (date(2026, 1, 2), "rig")
    assert len(pivot.is_used) >= 60
    # What all poses have in common no residual shows.
    assert np.linalg.eigvalsh(tool.tip_covariance_mm2)[0] >= 0.02**2


def test_a_drill_is_turned_twice_about_itself(given: GivenPoses) -> None:
    session = calibrating(given, has_axis=True)
    snapshot = run(session)
    assert snapshot.phase is ToolPhase.DONE
    assert given.deeds == ["pivot", "turn", "turn"]
    tool, _, axis = session.collected.solve(date(2026, 1, 2), "rig")
    assert np.degrees(np.arccos(tool.axis @ AXIS)) < 0.3
    assert min(axis.swept_deg) >= 79.0


def test_a_tool_that_is_hardly_leaned_is_never_done(given: GivenPoses) -> None:
    given.lean_rad = 0.15
    session = calibrating(given)
    snapshot = run(session, 300)
    assert snapshot.phase is ToolPhase.PIVOT
    session.submit(Finish())
    session.step()
    assert session.snapshot.phase is ToolPhase.PIVOT


def test_what_is_missing_is_said(given: GivenPoses) -> None:
    given.is_seen = False
    snapshot = run(calibrating(given), 3)
    assert snapshot.missing == "no marker is seen by both cameras"
    assert snapshot.seen_share == 0.0
    assert snapshot.n_poses == 0


def test_a_tool_that_is_held_still_gives_one_pose(given: GivenPoses) -> None:
    given.lean_rad = 0.0
    assert run(calibrating(given), 20).n_poses == 1


def test_begun_anew_everything_is_forgotten(given: GivenPoses) -> None:
    session = calibrating(given)
    assert run(session, 40).n_poses > 10
    session.submit(Again())
    session.step()
    assert session.snapshot.n_poses == 0
    assert given.deeds == ["pivot", "pivot"]
    assert "begun anew" in session.snapshot.events[-1]


def test_left_it_is_over_and_not_done(given: GivenPoses) -> None:
    session = calibrating(given)
    session.submit(Leave())
    assert session.step().phase is ToolPhase.OVER
    assert session.snapshot.is_over


def test_a_lost_camera_ends_it(given: GivenPoses) -> None:
    session = calibrating(given)
    session._camera.error = DeviceLost("unplugged")
    with pytest.raises(DeviceLost):
        session.step()
