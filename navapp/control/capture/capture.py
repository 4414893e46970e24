"""A guided capture of calibration pairs: one step for each frame."""

from collections.abc import Callable
from queue import Empty, SimpleQueue

from calibration.targets.boards import Board
from drivers.clock import Clock
from drivers.frames import StereoFrame
from drivers.interfaces import StereoCamera
from navapp.control.camera_link import CameraLink, Reopen
from navapp.control.capture.board_move import BoardMove, find_move
from navapp.control.capture.board_view import BoardView, detect_board
from navapp.control.capture.hand_control import HandControl
from navapp.control.capture.interfaces import BoardHand, CaptureSettings, PairStore, Solve
from navapp.control.capture.kept_pairs import KeptPairs
from navapp.control.capture.next_view import N_STARTING, NextView, measure_pose, plan_next_view
from navapp.control.capture.previews import make_previews
from navapp.control.capture.shutter import Shutter
from navapp.control.capture.states import (
    Another,
    CaptureCommand,
    CapturePhase,
    CaptureSnapshot,
    Check,
    DropLast,
    Finish,
    Follow,
    Leave,
    Nudge,
    Outcome,
    Take,
)
from navapp.control.executors import Executor, Job
from navapp.control.recent_events import RecentEvents
from navapp.control.states import Progress
from navapp.errors import DeviceError, NavappError
from navapp.geometry.transform import FloatArray

_WAIT_S = 0.1
# So many more pairs are asked for when a rig was not accepted.
_MORE_AFTER_REFUSAL = 4
# Poses measured with a guessed camera: the first views differ by more than this allows.
_SLACK_OF_GUESS = 3.0


class Capture:
    """Detects the board, keeps pairs, asks for the next view, solves.

    `step` is called from one thread, `submit` and `snapshot` from any.


    Args:
        camera: opened; closed with the capture.
        clock: of its frames.
        board: that is shown.
        settings: when it is enough.
        executor: runs detection, planning and the solve.
        store: of the raw pairs.
        solve: what `Finish` does with the pairs; runs in the executor.
        hand: that holds a simulated board, else None.
        reopen: opens a lost camera again; None: its loss is the end.
        detect: finds the board in the pictures of a frame.
    """

    def __init__(
        self,
        camera: StereoCamera,
        clock: Clock,
        board: Board,
        settings: CaptureSettings,
        *,
        executor: Executor,
        store: PairStore,
        solve: Solve,
        hand: BoardHand | None = None,
        reopen: Reopen | None = None,
        detect: Callable[[StereoFrame, Board], BoardView] = detect_board,
    ) -> None:
        info = camera.info
        self._name, self._size = info.name, (info.width, info.height)
        self._camera, self._clock = CameraLink(camera, clock, reopen), clock
        self._board, self._settings, self._executor = board, settings, executor
        self._solve, self._detect, self._hand = solve, detect, HandControl(hand)
        self._middle_mm = board.points_mm.mean(axis=0)
        self._commands: SimpleQueue[CaptureCommand] = SimpleQueue()
        self._phase = CapturePhase.CAPTURING
        self._kept = KeptPairs(store, self._size)
        self._shutter, self._events = Shutter(), RecentEvents()
        self._frame: StereoFrame | None = None
        self._board_view: BoardView | None = None
        self._checks: tuple[Check, ...] = ()
        self._move: BoardMove | None = None
        self._is_told_to_take = False
        self._avoid: list[FloatArray] = []
        self._next_view = plan_next_view(board, [], self._size, settings.depth_mm)
        self._detection: Job[BoardView] | None = None
        self._planning: Job[NextView] | None = None
        self._solving: Job[Outcome] | None = None
        self._outcome: Outcome | None = None
        self._n_least = settings.fewest_pairs if settings.n_pairs is None else settings.n_pairs
        self.snapshot = self._make_snapshot()

    def submit(self, command: CaptureCommand) -> None:
        """Hand a command over; what became of it is in a later snapshot."""
        self._commands.put(command)

    def step(self) -> CaptureSnapshot:
        """Take a frame, do what is due, and tell.

        Raises:
            DeviceError: a camera that nobody opens again; InputError: the folder; EndOfSequence: a
                finite source.
        """
        while (command := self._next_command()) is not None:
            self._do(command)
        frame = self._next_frame()
        if frame is not None:
            self._frame = frame
            if self._detection is None and self._phase is CapturePhase.CAPTURING:
                self._detection = Job(lambda report: self._detect(frame, self._board))
                self._executor.start(self._detection)
        self._take_next_view()
        self._take_board_view()
        self._take_outcome()
        self._move_hand()
        self.snapshot = self._make_snapshot()
        return self.snapshot

    def close(self) -> None:
        """Stop what runs; the camera is closed."""
        for job in (self._detection, self._planning, self._solving):
            if job is not None:
                job.cancel()
        self._executor.close()
        self._camera.close()

    @property
    def is_enough(self) -> bool:
        """The limit is reached, by pairs that are all in the prediction."""
        n, bound, asked = len(self._kept), self._next_view.bound_mm, self._settings
        if n < self._n_least:
            return False
        return asked.n_pairs is not None or (bound is not None and bound <= asked.stop_mm)

    def _next_frame(self) -> StereoFrame | None:
        if self._camera.is_down:
            if self._camera.wait_for_return(_WAIT_S):
                self._events.add(f"camera {self._name} is back")
            return None
        try:
            return self._camera.take(_WAIT_S)
        except DeviceError as error:
            if not self._camera.can_return:
                raise
            # What was seen before says nothing of what is held there afterwards.
            if self._detection is not None:
                self._detection.cancel()
            self._detection = self._frame = self._board_view = self._move = None
            self._checks, self._is_told_to_take = (), False
            self._shutter.forget_last()
            self._events.add(str(error))
            return None

    def _next_command(self) -> CaptureCommand | None:
        try:
            return self._commands.get_nowait()
        except Empty:
            return None

    def _do(self, command: CaptureCommand) -> None:
        match command:
            case Leave():
                self._phase = CapturePhase.OVER
            case Follow(is_on):
                self._hand.switch(is_on=is_on)
            case Nudge(shift_mm, turn_rad):
                self._hand.nudge(shift_mm, turn_rad)
            case _ if self._phase is not CapturePhase.CAPTURING:
                pass
            case Take():
                self._is_told_to_take = not self._camera.is_down
            case DropLast():
                if (pair := self._kept.drop_last()) is not None:
                    self._events.add(f"pair {pair.index} dropped")
                    self._begin_planning()
            case Another() if self._next_view.left_from_board is not None:
                self._avoid.append(self._next_view.left_from_board.rotation)
                self._begin_planning()
            case Finish() if len(self._kept) >= N_STARTING:
                pairs = self._kept.pairs
                self._solving = Job(lambda report: self._solve(pairs, report))
                self._phase = CapturePhase.SOLVING
                self._executor.start(self._solving)
            case Finish():
                self._events.add(
                    f"{len(self._kept)} pairs are too few to solve, {N_STARTING} are needed"
                )

    def _take_board_view(self) -> None:
        job = self._detection
        if job is None or not job.is_finished:
            return
        self._detection = None
        if job.error is not None:
            raise job.error
        seen = self._board_view = job.result
        if seen is None or self._phase is not CapturePhase.CAPTURING:
            return
        self._checks = self._shutter.check(seen, self._kept.pairs)
        self._move = self._find_move(seen)
        is_good = all(check.is_met for check in self._checks)
        is_there = self._move is not None and self._move.is_there
        # While the next view is being planned, no view can be the wanted one.
        is_due = is_good and is_there and self._planning is None and not self.is_enough
        if self._is_told_to_take or is_due:
            self._keep(seen)
        self._is_told_to_take = False

    def _keep(self, seen: BoardView) -> None:
        pair = self._kept.add(seen)
        if pair is None:
            self._events.add("nothing was taken: the board is not seen by both cameras")
            return
        self._events.add(f"pair {pair.index} kept: {len(pair.common()[0])} marks by both")
        self._begin_planning()

    def _begin_planning(self) -> None:
        """Plan the next view with the pairs that are kept now."""
        self._outcome = None
        if self._planning is not None:
            self._planning.cancel()
        pairs, last, avoid = self._kept.pairs, self._next_view, list(self._avoid)
        self._planning = Job(
            lambda report: plan_next_view(
                self._board, pairs, self._size, self._settings.depth_mm, last, avoid
            )
        )
        self._executor.start(self._planning)

    def _take_next_view(self) -> None:
        job = self._planning
        if job is None or not job.is_finished:
            return
        self._planning = None
        if job.error is not None:
            raise job.error
        if job.result is None:
            return
        known = {one.index for one in self._next_view.misfits}
        for one in job.result.misfits:
            if one.index not in known:
                self._events.add(f"pair {one.index} does not count: {one.reason}")
        was_enough = self.is_enough
        self._next_view = job.result
        self._hand.begin()
        if self.is_enough and not was_enough:
            self._events.add("this is enough: finish, or take more")

    def _take_outcome(self) -> None:
        job = self._solving
        if job is None or not job.is_finished:
            return
        self._solving = None
        if self._phase is CapturePhase.SOLVING:
            self._phase = CapturePhase.CAPTURING
        if isinstance(job.error, NavappError):
            self._outcome = Outcome(is_accepted=False, sentences=(str(job.error),))
        elif job.error is not None:
            raise job.error
        else:
            self._outcome = job.result
        if self._outcome is not None and not self._outcome.is_accepted:
            self._n_least = len(self._kept) + _MORE_AFTER_REFUSAL

    def _find_move(self, seen: BoardView) -> BoardMove | None:
        wanted = self._next_view.left_from_board
        if seen.left is None or wanted is None:
            return None
        now = measure_pose(self._board, seen.left, self._next_view.left)
        slack = 1.0 if self._next_view.rig is not None else _SLACK_OF_GUESS
        return None if now is None else find_move(now, wanted, self._middle_mm, slack)

    def _move_hand(self) -> None:
        wanted, frame = self._next_view.left_from_board, self._frame
        if wanted is None or frame is None or self._planning is not None or self.is_enough:
            return
        if not self._hand.step(wanted, frame.captured_ns):
            self._do(Another())

    def _make_snapshot(self) -> CaptureSnapshot:
        seen, next_view = self._board_view, self._next_view
        sides = [seen.left, seen.right] if seen is not None else [None, None]
        counts = [0 if side is None else len(side.ids) for side in sides]
        job = self._solving
        return CaptureSnapshot(
            time_ns=self._clock.now_ns(),
            phase=self._phase,
            camera=self._name,
            trouble=self._trouble,
            has_hand=self._hand.has_hand,
            is_following=self._hand.is_on,
            pictures=make_previews(
                self._board, self._frame, seen, None if self.is_enough else self._next_view
            ),
            n_seen=(counts[0], counts[1], len(self._board.points_mm)),
            checks=self._checks,
            instruction=self._instruction(),
            n_kept=len(self._kept),
            bound_mm=next_view.bound_mm,
            worst_mm=next_view.worst_mm,
            stop_mm=self._settings.stop_mm,
            is_enough=self.is_enough,
            covered=self._kept.covered,
            progress=None if job is None else Progress("solving the rig", job.progress),
            events=self._events.texts,
            n_events=self._events.n_told,
            outcome=self._outcome,
        )

    @property
    def _trouble(self) -> str:
        if self._camera.is_down:
            return f"{self._camera.trouble or 'the camera is lost'}; it is opened again, wait"
        return "the camera sends no picture: check its cable" if self._camera.is_silent else ""

    def _instruction(self) -> str:
        if self._phase is CapturePhase.SOLVING:
            return "solving: this takes a while"
        if self.is_enough:
            return "nothing: this is enough"
        if self._planning is not None:
            return "thinking about the next view"
        if self._move is None:
            return "show the board to both cameras, as the outline is drawn"
        return str(self._move)
