"""The guided calibration of a tool: frame by frame, until tip and axis are known well enough."""

import threading
from collections import deque
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from drivers.clock import Clock
from drivers.frames import StereoFrame
from drivers.interfaces import StereoCamera
from navapp.control.recent_events import RecentEvents
from navapp.control.tool_calibration.collected import CollectedPoses
from navapp.control.tool_calibration.states import (
    Again,
    Finish,
    Leave,
    ToolCommand,
    ToolPhase,
    ToolSnapshot,
)
from navapp.errors import DeviceError, DeviceTimeout, ResultError
from navapp.geometry.rectification import luma
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import rotation_angle_deg, vector_from_rotation
from navapp.tools.plate import Plate
from navapp.tools.plate_meter import PlateMeter, PlatePose

# Two kept poses differ by this at least; the tip is solved for after so many new ones.
_APART_DEG, _SOLVE_EVERY = 2.0, 10
_FEWEST_POSES, _MOST_POSES, _LEAST_LEAN_DEG = 60, 400, 20.0
_TURN_DEG, _FEWEST_OF_TURN, _SETTLING_NS = 80.0, 12, 1_500_000_000
_TIMEOUT_S = 0.2
_INSTRUCTIONS = {
    ToolPhase.PIVOT: "stand the tip in a small hole and lean the tool slowly to all sides",
    ToolPhase.FIRST_TURN: "turn the tool to and fro about its own axis, without leaning it",
    ToolPhase.SECOND_TURN: "lean the tool to another side, and turn it about its axis once more",
    ToolPhase.DONE: "done",
    ToolPhase.OVER: "left",
}


class HoldsTool(Protocol):
    """A simulated hand that does what is asked for."""

    def begin(self, deed: Literal["pivot", "turn"]) -> None:
        """Do this from now on."""
        ...


@dataclass(frozen=True, slots=True)
class ToolSettings:
    """What is asked of a calibration."""

    has_axis: bool  # the axis is asked for, too
    stop_mm: float = 0.1  # a tip with a smaller 95 % bound is good enough


class ToolCalibrating:
    """Steps through a tool's calibration.

    Args:
        camera: opened.
        clock: of its frames.
        rig: of its pictures.
        plate: of the tool.
        settings: what is asked for.
        hand: holds a simulated tool; None: a person does.
    """

    def __init__(
        self,
        camera: StereoCamera,
        clock: Clock,
        rig: StereoRig,
        plate: Plate,
        settings: ToolSettings,
        hand: HoldsTool | None = None,
    ) -> None:
        self._camera, self._clock, self._rig, self._plate = camera, clock, rig, plate
        self._settings, self._hand = settings, hand
        self._meter = PlateMeter(plate, rig)
        self._queue: deque[ToolCommand] = deque()
        self._lock = threading.Lock()
        self._events = RecentEvents()
        self._phase, self._trouble = ToolPhase.PIVOT, ""
        self._frame: StereoFrame | None = None
        self._found: PlatePose | str = "no picture yet"
        self._begin()
        self.snapshot = self._make_snapshot()

    def _begin(self) -> None:
        self.collected = CollectedPoses(self._plate)
        self._phase = ToolPhase.PIVOT
        self._tip: tuple[tuple[float, float, float], float, float] | None = None
        self._n_solved, self._newest_ns, self._settled_ns = 0, 0, 0
        if self._hand is not None:
            self._hand.begin("pivot")

    def submit(self, command: ToolCommand) -> None:
        """Hand a command over; called from any thread."""
        with self._lock:
            self._queue.append(command)

    def step(self) -> ToolSnapshot:
        """Handle a command, or take a frame and what it shows."""
        with self._lock:
            command = self._queue.popleft() if self._queue else None
        if command is not None:
            self._handle(command)
        elif not self.snapshot.is_over:
            self._take()
        self.snapshot = self._make_snapshot()
        return self.snapshot

    def _handle(self, command: ToolCommand) -> None:
        match command:
            case Leave():
                self._phase = ToolPhase.OVER
            case Again():
                self._events.add("begun anew: all poses are forgotten")
                self._begin()
            case Finish():
                self._finish()

    def _finish(self) -> None:
        """End with what there is; told why not when it cannot be solved."""
        if self._settings.has_axis and len(self.collected.turns) < 2:
            self._events.add("not yet: a drill is turned about itself twice")
            return
        try:
            self.collected.check()
        except ResultError as error:
            self._events.add(f"not yet: {error.problem}")
            return
        self._phase = ToolPhase.DONE

    def _take(self) -> None:
        try:
            frame = self._camera.read(_TIMEOUT_S)
        except DeviceTimeout:
            return
        except DeviceError as error:
            self._trouble = str(error)
            raise
        self._frame, self._newest_ns = frame, frame.captured_ns
        self._found = self._meter.measure((luma(frame.left), luma(frame.right)))
        if isinstance(self._found, PlatePose):
            self._keep(self._found)

    def _keep(self, found: PlatePose) -> None:
        fits = self.collected.pivoting
        if self._phase is not ToolPhase.PIVOT:
            fits = self.collected.turns[-1]
        pose = found.left_from_plate
        if self._newest_ns < self._settled_ns:
            return
        if fits and rotation_angle_deg(fits[-1].left_from_plate, pose) < _APART_DEG:
            return
        fits.append(found.fit)
        if self._phase is ToolPhase.PIVOT:
            self._look_at_tip()
        elif self._swept_deg() >= _TURN_DEG and len(fits) >= _FEWEST_OF_TURN:
            self._end_turn()

    def _look_at_tip(self) -> None:
        """Solve for the tip now and then; go on when it is known well enough."""
        n = len(self.collected.pivoting)
        if n < self._n_solved + _SOLVE_EVERY:
            return
        self._n_solved = n
        if n >= _MOST_POSES:
            # Further ones say little more, and take ever longer.
            self._events.add(f"{n} poses did not do: they are forgotten; hold the tip still")
            self._begin()
            return
        try:
            _, pivot = self.collected.solve_tip()
        except ResultError:
            return
        x, y, z = (float(value) for value in pivot.robust.tip_mm)
        self._tip = (x, y, z), pivot.bound_mm, pivot.half_angle_deg
        is_good = pivot.bound_mm <= self._settings.stop_mm and n >= _FEWEST_POSES
        if is_good and pivot.half_angle_deg >= _LEAST_LEAN_DEG:
            self._events.add(f"the tip is known within {pivot.bound_mm:.3f} mm")
            self._go_on()

    def _end_turn(self) -> None:
        """To the next phase, unless the axis cannot be solved for: then the turn is made again."""
        try:
            self.collected.check()
        except ResultError as error:
            self._events.add(f"once more: {error.problem}")
            self.collected.turns[-1].clear()
            return
        self._go_on()

    def _go_on(self) -> None:
        """To the next phase."""
        if not self._settings.has_axis or self._phase is ToolPhase.SECOND_TURN:
            self._phase = ToolPhase.DONE
            return
        is_first = self._phase is ToolPhase.PIVOT
        self._phase = ToolPhase.FIRST_TURN if is_first else ToolPhase.SECOND_TURN
        self.collected.turns.append([])
        # Until then the tool is leaned to where it will be turned.
        self._settled_ns = self._newest_ns + _SETTLING_NS
        if self._hand is not None:
            self._hand.begin("turn")

    def _swept_deg(self) -> float:
        """How far this turn has turned the tool, about the axis that it turns about most."""
        turn = self.collected.turns[-1] if self.collected.turns else []
        if len(turn) < 3:
            return 0.0
        first = turn[0].left_from_plate.rotation
        turned = [vector_from_rotation(first.T @ fit.left_from_plate.rotation) for fit in turn]
        axis = np.linalg.svd(np.array(turned))[2][0]
        return float(np.degrees(np.ptp(np.array(turned) @ axis)))

    def _make_snapshot(self) -> ToolSnapshot:
        frame, found = self._frame, self._found
        tip = self._tip
        return ToolSnapshot(
            time_ns=self._clock.now_ns() if frame is None else frame.captured_ns,
            phase=self._phase,
            camera=self._camera.info.name,
            pictures=None if frame is None else (frame.left, frame.right),
            instruction=_INSTRUCTIONS[self._phase],
            missing="" if isinstance(found, PlatePose) else found,
            seen_share=found.seen_share if isinstance(found, PlatePose) else 0.0,
            n_kept=list(ToolPhase).index(self._phase),
            n_poses=len(self.collected.pivoting) + sum(map(len, self.collected.turns)),
            half_angle_deg=None if tip is None else tip[2],
            tip_mm=None if tip is None else tip[0],
            bound_mm=None if tip is None else tip[1],
            stop_mm=self._settings.stop_mm,
            swept_deg=self._swept_deg(),
            turn_deg=_TURN_DEG,
            events=self._events.texts,
            n_events=self._events.n_told,
            trouble=self._trouble,
        )
