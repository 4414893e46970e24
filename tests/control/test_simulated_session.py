"""Sessions in the simulated room, with the real line."""

from collections.abc import Callable
from contextlib import ExitStack

import pytest

from drivers.clock import ManualClock, SystemClock
from drivers.fixed_mirror import FixedMirror
from drivers.interfaces import DeviceSet
from drivers.no_projector import NoProjector
from navapp.control.board_watch import BoardWatch
from navapp.control.commands import (
    Accept,
    ConfirmCondition,
    Propose,
    Register,
    Reject,
)
from navapp.control.controller import SessionController
from navapp.control.event_log import SessionHooks
from navapp.control.executors import InlineExecutor, ThreadExecutor
from navapp.control.runner import SessionRunner, run_headless
from navapp.control.scripted_operator import ScriptedOperator
from navapp.control.specification import SessionSpecification
from navapp.errors import WrongDevice
from navapp.values import Plan, Status
from sim_devices.camera import Scene, SimulatedCamera
from sim_devices.display import SimulatedDisplay
from sim_devices.faults import Fault, FaultKind, FaultScript
from sim_devices.scenario import Scenario
from sim_devices.sensor import SensorModel
from sim_devices.truth import TruthOracle
from sim_devices.world import World
from tests.control.fakes import wait_for
from tests.knees import femur_of, nominal_prior

SEED = 5


class SimulatedRoom:
    """A controller on the simulated room; the truth stays with the test."""

    def __init__(
        self, undo: ExitStack, *, scale: float = 1.0, is_live: bool = False,
        faults: FaultScript | None = None, n_frames: int | None = None, rate_hz: float = 15.0,
        seen: Callable[[World], Scene] = lambda world: world,
        board_watch: BoardWatch | None = None,
    ) -> None:  # fmt: skip
        world = self.world = World(Scenario(seed=SEED, motion="still"))
        self.clock = SystemClock() if is_live else ManualClock()
        self.camera = SimulatedCamera(
            seen(world), self.clock, is_stepped=not is_live, scale=scale, n_frames=n_frames,
            sensor=SensorModel(seed=SEED), faults=faults, rate_hz=rate_hz,
        )  # fmt: skip
        self.camera.open()
        rig = world.rig if scale == 1.0 else world.rig.scale(scale)
        self.display = SimulatedDisplay(self.clock, rig.width, rig.height)
        self.display.open()
        self.oracle = TruthOracle(world, self.camera.world_time_ns)
        self.results = []
        self.commands = []
        self.controller = SessionController(
            DeviceSet(self.camera, self.display, NoProjector(), FixedMirror(45.0), self.clock),
            SessionSpecification(rig, Plan({"femur": femur_of(world)}), nominal_prior(world)),
            executor=ThreadExecutor() if is_live else InlineExecutor(),
            board_watch=board_watch,
            hooks=SessionHooks(
                on_frame=(self.results.append,),
                on_command=(lambda command, sequence: self.commands.append(command),),
                reopen_camera=self._reopen,
            ),
        )
        undo.callback(self.controller.close)

    def _reopen(self) -> SimulatedCamera:
        self.camera.open()
        if self.camera.info.serials[0] != "SIM-L":
            self.camera.close()
            raise WrongDevice("the camera has other serial numbers than the rig")
        return self.camera

    @property
    def state(self) -> str:
        return self.controller.snapshot.state.value

    def states(self) -> list[str]:
        return [result.state.value for result in self.results]

    def frames(self, n: int) -> None:
        for _ in range(n):
            self.controller.step()


def is_confirmed(command) -> bool:
    return isinstance(command, ConfirmCondition)


@pytest.mark.slow
@pytest.mark.release
def test_the_scripted_session_refuses_the_turned_pose_and_navigates_on_the_right_one(undo) -> None:
    room = SimulatedRoom(undo, n_frames=11)
    run_headless(room.controller, ScriptedOperator())
    assert [type(command) for command in room.commands if not is_confirmed(command)] == [
        Register, Reject, Propose, Reject, Register, Accept,
    ]  # fmt: skip
    refused = next(
        r for r in room.results
        if r.state.value == "review" and r.tracked.verdict.status is Status.LOST
    )  # fmt: skip
    assert not refused.is_navigable
    assert room.states()[-1] == "navigating"
    for result in room.results:
        if result.is_navigable:
            true = room.oracle.left_from_body("femur", result.frame.captured_ns)
            centre = femur_of(room.world).mesh.vertices_mm.mean(axis=0)
            shift = result.tracked.left_from_bone.apply(centre) - true.apply(centre)
            assert (shift**2).sum() ** 0.5 < 2.0
    assert any(result.is_navigable for result in room.results)


@pytest.mark.release
@pytest.mark.slow
def test_an_unplugged_camera_that_comes_back_is_navigated_on(undo) -> None:
    faults = FaultScript(
        (Fault(FaultKind.UNPLUG, 0.3, 2.0), Fault(FaultKind.WRONG_SERIAL, 2.3, 1.2))
    )
    room = SimulatedRoom(undo, faults=faults)
    room.frames(1)
    room.controller.submit(Register())
    room.frames(2)
    room.controller.submit(Accept(None))
    room.frames(2)
    assert room.state == "navigating"
    while room.state == "navigating":
        room.frames(1)
    assert room.state == "fault"
    assert not room.display.visible_image().any()
    troubles = set()
    while room.state == "fault":
        room.frames(1)
        troubles.add(room.controller.snapshot.devices[0].detail)
        assert not room.display.visible_image().any()
    assert any("unplugged" in trouble for trouble in troubles)
    assert any("other serial numbers" in trouble for trouble in troubles)
    assert room.state == "suspended"
    room.frames(1)
    assert room.state == "navigating"
    assert room.display.visible_image().any()


@pytest.mark.release
@pytest.mark.slow
def test_a_blackout_suspends_and_light_resumes(undo) -> None:
    faults = FaultScript((Fault(FaultKind.BLACKOUT_RIGHT, 0.25, 0.2),))
    room = SimulatedRoom(undo, faults=faults, n_frames=9)
    room.frames(1)
    room.controller.submit(Register())
    room.frames(2)
    room.controller.submit(Accept(None))
    room.frames(8)
    assert room.states()[2:4] == ["navigating", "navigating"]
    assert room.states()[4:7] == ["suspended"] * 3
    assert room.states()[7:] == ["navigating"] * 2


@pytest.mark.release
@pytest.mark.slow
def test_a_live_session_gets_to_review_and_navigation(undo) -> None:
    """Free-running camera, reader thread, worker: a proposed pose makes small pictures enough."""
    room = SimulatedRoom(undo, scale=0.3, is_live=True, rate_hz=5.0)
    runner = SessionRunner(room.controller)
    undo.callback(runner.stop)
    runner.start()
    wait_for(lambda: room.state == "ready", "pictures")
    runner.submit(Propose(room.oracle.left_from_body("femur", room.results[0].frame.captured_ns)))
    wait_for(
        lambda: room.state == "review" and runner.snapshot().verdict is not None, "the judge's word"
    )
    assert runner.snapshot().verdict.status is not Status.LOST
    assert runner.snapshot().rates.latency_ms > 0.0
    runner.submit(Accept(None))
    wait_for(lambda: room.state == "navigating", "navigation")
    runner.submit(Register())
    wait_for(lambda: room.state == "registering", "the search")
    # Where nothing is found, everything is tried.
    wait_for(lambda: room.state != "registering", "the end of the search", 60.0)
    runner.stop()
    assert runner.error is None
    assert not room.display.visible_image().any()
