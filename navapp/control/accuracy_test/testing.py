"""Steps through an accuracy test: task by task, tips of pairs of pictures are taken."""

import threading
from collections import deque
from collections.abc import Sequence
from typing import Protocol

import numpy as np

from drivers.clock import Clock
from drivers.frames import StereoFrame
from drivers.interfaces import StereoCamera
from navapp.control.accuracy_test.states import (
    AccuracyCommand,
    AccuracySnapshot,
    Back,
    Leave,
    Take,
    TakenTip,
)
from navapp.control.recent_events import RecentEvents
from navapp.errors import DeviceTimeout
from navapp.geometry.rectification import luma
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import RigidTransform, rotation_angle_deg
from navapp.tools.accuracy_tasks import Task
from navapp.tools.tool import SeenTool, Tool
from navapp.tools.tool_tracker import ToolTracker

_TIMEOUT_S = 0.2
# Pairs of a task in which the tip rests, and of one in which the tool is leaned.
N_RESTING, N_LEANING = 8, 15
# A resting tip moves less than this from pair to pair; poses of a leaning tool differ by more.
_REST_MM, _APART_DEG = 0.4, 1.5


class DoesTasks(Protocol):
    """A simulated hand."""

    def begin(self, task: Task) -> None:
        """Go there and do it."""
        ...

    @property
    def is_there(self) -> bool:
        """It does it, in the newest picture."""
        ...


class AccuracyTesting:
    """An accuracy test.

    Args:
        camera: opened.
        clock: of its frames.
        rig: of its pictures.
        tool: the pointer.
        tasks: in order.
        hand: a simulated one; None: a person holds the pointer, and says when.

    Attributes:
        taken: tips of all tasks that are done.
    """

    def __init__(
        self,
        camera: StereoCamera,
        clock: Clock,
        rig: StereoRig,
        tool: Tool,
        tasks: Sequence[Task],
        hand: DoesTasks | None = None,
    ) -> None:
        self._camera, self._clock, self._tasks, self._hand = camera, clock, tuple(tasks), hand
        self._tracker = ToolTracker(tool, rig)
        self._queue: deque[AccuracyCommand] = deque()
        self._lock = threading.Lock()
        self._events = RecentEvents()
        self._number, self._is_taking, self._was_left = 0, False, False
        self._poses: list[RigidTransform] = []
        self._task_tips: list[TakenTip] = []
        self._frame: StereoFrame | None = None
        self._missing = "no picture yet"
        self._bound_mm: float | None = None
        self.taken: list[TakenTip] = []
        self._begin_task()
        self.snapshot = self._make_snapshot()

    def submit(self, command: AccuracyCommand) -> None:
        """Hand a command over; called from any thread."""
        with self._lock:
            self._queue.append(command)

    def step(self) -> AccuracySnapshot:
        """Handle a command, or take a frame."""
        with self._lock:
            command = self._queue.popleft() if self._queue else None
        if command is not None:
            self._handle(command)
        elif not self.snapshot.is_over:
            self._take_frame()
        self.snapshot = self._make_snapshot()
        return self.snapshot

    @property
    def _task(self) -> Task | None:
        return self._tasks[self._number] if self._number < len(self._tasks) else None

    def _begin_task(self) -> None:
        self._poses, self._task_tips, self._is_taking = [], [], False
        if self._hand is not None and self._task is not None:
            self._hand.begin(self._task)

    def _handle(self, command: AccuracyCommand) -> None:
        match command:
            case Take():
                self._begin_task()
                self._is_taking = True
            case Back():
                self._number = max(self._number - 1, 0)
                again = self._task
                self.taken = [one for one in self.taken if one.task != again]
                self._begin_task()
            case Leave():
                self._was_left = True

    def _take_frame(self) -> None:
        try:
            frame = self._camera.read(_TIMEOUT_S)
        except DeviceTimeout:
            return
        self._frame = frame
        if self._hand is not None:
            self._is_taking = self._hand.is_there
        found = self._tracker.track((luma(frame.left), luma(frame.right)), frame.captured_ns)
        if isinstance(found, SeenTool):
            self._missing, self._bound_mm = "", found.tip_bound_mm
            if self._is_taking:
                self._add(found)
        else:
            self._missing, self._bound_mm = found.why, None

    def _add(self, seen: SeenTool) -> None:
        """One more tip of the task, unless it moves, or is leaned as it was."""
        task = self._task
        if task is None:
            return
        last = self._poses[-1] if self._poses else None
        if task.kind == "rotation":
            is_new = last is None or rotation_angle_deg(last, seen.left_from_plate) >= _APART_DEG
            if not is_new:
                return
        elif last is not None:
            moved_mm = np.linalg.norm(last.apply(seen.tool.tip_mm) - seen.tip_mm)
            if moved_mm > _REST_MM:
                self._poses, self._task_tips = [], []
        self._poses.append(seen.left_from_plate)
        self._task_tips.append(TakenTip(task, seen.tip_mm, seen.tip_bound_mm, seen.captured_ns))
        if len(self._task_tips) == self._needed(task):
            self._end_task(task)

    @staticmethod
    def _needed(task: Task) -> int:
        return N_LEANING if task.kind == "rotation" else N_RESTING

    def _end_task(self, task: Task) -> None:
        self.taken += self._task_tips
        self._events.add(f"done: {task.instruction}")
        self._number += 1
        self._begin_task()

    def _make_snapshot(self) -> AccuracySnapshot:
        frame, task = self._frame, self._task
        share = 0.0 if task is None else len(self._task_tips) / self._needed(task)
        return AccuracySnapshot(
            time_ns=self._clock.now_ns() if frame is None else frame.captured_ns,
            camera=self._camera.info.name,
            pictures=None if frame is None else (frame.left, frame.right),
            task=task,
            n_kept=self._number,
            n_tasks=len(self._tasks),
            share=share,
            is_taking=self._is_taking,
            missing=self._missing,
            bound_mm=self._bound_mm,
            events=self._events.texts,
            n_events=self._events.n_told,
            was_left=self._was_left,
        )
