"""A guided capture: one step a frame."""

from queue import Empty, SimpleQueue

from calibration.targets.boards import Board
from drivers.clock import Clock
from drivers.frames import StereoFrame
from drivers.interfaces import StereoCamera
from navapp.control.camera_link import CameraLink, Reopen
from navapp.control.capture.following import Following
from navapp.control.capture.interfaces import BoardHand, CaptureSettings, PairStore, Solve
from navapp.control.capture.kept import KeptPairs
from navapp.control.capture.looks import Look, Shutter, look_at
from navapp.control.capture.previews import previews
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
from navapp.control.capture.wishes import N_STARTING, Wish, measured_pose, next_wish
from navapp.control.capture.words import Way, way
from navapp.control.executors import Executor, Job
from navapp.control.states import Progress
from navapp.errors import DeviceError, NavappError
from navapp.geometry.transform import FloatArray

_WAIT_S = 0.1
_MOST_EVENTS = 30
# So many more pairs are asked for when a rig was not accepted.
_MORE_AFTER_REFUSAL = 4
# Poses measured with a guessed camera: the first views differ by more than this allows.
_SLACK_OF_GUESS = 3.0


class Capture:
    """Looks, keeps, asks for more, solves. `step` from one thread, the rest from any.

    Args:
        camera: opened; closed with the capture.
        clock: of its frames.
        board: that is shown.
        settings: when it is enough.
        executor: runs looks, wishes and the solve.
        store: of the raw pairs.
        solve: what `Finish` does with the pairs; runs in the executor.
        hand: that holds a simulated board, else None.
        reopen: opens a lost camera again; None: its loss is the end.
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
    ) -> None:
        info = camera.info
        self._name, self._size = info.name, (info.width, info.height)
        self._camera, self._clock = CameraLink(camera, clock, reopen), clock
        self._board, self._settings, self._executor = board, settings, executor
        self._solve, self._following = solve, Following(hand)
        self._middle_mm = board.points_mm.mean(axis=0)
        self._commands: SimpleQueue[CaptureCommand] = SimpleQueue()
        self._phase = CapturePhase.CAPTURING
        self._kept = KeptPairs(store, self._size)
        self._shutter, self._events = Shutter(), list[str]()
        self._frame: StereoFrame | None = None
        self._look: Look | None = None
        self._checks: tuple[Check, ...] = ()
        self._way: Way | None = None
        self._is_told_to_take = False
        self._avoid: list[FloatArray] = []
        self._wish = next_wish(board, [], self._size, settings.depth_mm)
        self._looking: Job[Look] | None = None
        self._wishing: Job[Wish] | None = None
        self._solving: Job[Outcome] | None = None
        self._outcome: Outcome | None = None
        self._n_least = settings.fewest_pairs if settings.n_pairs is None else settings.n_pairs
        self.snapshot = self._told()

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
            if self._looking is None and self._phase is CapturePhase.CAPTURING:
                self._looking = Job(lambda report: look_at(frame, self._board))
                self._executor.start(self._looking)
        self._take_wish()
        self._take_look()
        self._take_outcome()
        self._move_hand()
        self.snapshot = self._told()
        return self.snapshot

    def close(self) -> None:
        """Stop what runs; the camera is closed."""
        for job in (self._looking, self._wishing, self._solving):
            if job is not None:
                job.cancel()
        self._executor.close()
        self._camera.close()

    @property
    def is_enough(self) -> bool:
        """The limit is reached, by pairs that are all in the prediction."""
        n, bound, asked = len(self._kept), self._wish.bound_mm, self._settings
        if n < self._n_least:
            return False
        return asked.n_pairs is not None or (bound is not None and bound <= asked.stop_mm)

    def _next_frame(self) -> StereoFrame | None:
        if self._camera.is_down:
            if self._camera.wait_for_return(_WAIT_S):
                self._tell(f"camera {self._name} is back")
            return None
        try:
            return self._camera.take(_WAIT_S)
        except DeviceError as error:
            if not self._camera.can_return:
                raise
            # What was seen before says nothing of what is held there afterwards.
            if self._looking is not None:
                self._looking.cancel()
            self._looking = self._frame = self._look = self._way = None
            self._checks, self._is_told_to_take = (), False
            self._shutter.forget_last()
            self._tell(str(error))
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
                self._following.turn(is_on=is_on)
            case Nudge(shift_mm, turn_rad):
                self._following.nudge(shift_mm, turn_rad)
            case _ if self._phase is not CapturePhase.CAPTURING:
                pass
            case Take():
                self._is_told_to_take = not self._camera.is_down
            case DropLast():
                if (pair := self._kept.drop_last()) is not None:
                    self._tell(f"pair {pair.index} dropped")
                    self._ask()
            case Another() if self._wish.left_from_board is not None:
                self._avoid.append(self._wish.left_from_board.rotation)
                self._ask()
            case Finish() if len(self._kept) >= N_STARTING:
                pairs = self._kept.pairs
                self._solving = Job(lambda report: self._solve(pairs, report))
                self._phase = CapturePhase.SOLVING
                self._executor.start(self._solving)
            case Finish():
                self._tell(f"{len(self._kept)} pairs are too few to solve, {N_STARTING} are needed")

    def _take_look(self) -> None:
        job = self._looking
        if job is None or not job.is_finished:
            return
        self._looking = None
        if job.error is not None:
            raise job.error
        look = self._look = job.result
        if look is None or self._phase is not CapturePhase.CAPTURING:
            return
        self._checks = self._shutter.checks(look, self._kept.pairs)
        self._way = self._way_from(look)
        is_good = all(check.is_met for check in self._checks)
        is_there = self._way is not None and self._way.is_there
        # A wish that is being thought over is not one that a view can meet.
        is_due = is_good and is_there and self._wishing is None and not self.is_enough
        if self._is_told_to_take or is_due:
            self._keep(look)
        self._is_told_to_take = False

    def _keep(self, look: Look) -> None:
        pair = self._kept.add(look)
        if pair is None:
            self._tell("nothing was taken: the board is not seen by both cameras")
            return
        self._tell(f"pair {pair.index} kept: {len(pair.common()[0])} marks by both")
        self._ask()

    def _ask(self) -> None:
        """Think over what is wanted, with the pairs of now."""
        self._outcome = None
        if self._wishing is not None:
            self._wishing.cancel()
        pairs, last, avoid = self._kept.pairs, self._wish, list(self._avoid)
        self._wishing = Job(
            lambda report: next_wish(
                self._board, pairs, self._size, self._settings.depth_mm, last, avoid
            )
        )
        self._executor.start(self._wishing)

    def _take_wish(self) -> None:
        job = self._wishing
        if job is None or not job.is_finished:
            return
        self._wishing = None
        if job.error is not None:
            raise job.error
        if job.result is None:
            return
        known = {one.index for one in self._wish.misfits}
        for one in job.result.misfits:
            if one.index not in known:
                self._tell(f"pair {one.index} does not count: {one.reason}")
        was_enough = self.is_enough
        self._wish = job.result
        self._following.begin()
        if self.is_enough and not was_enough:
            self._tell("this is enough: finish, or take more")

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

    def _way_from(self, look: Look) -> Way | None:
        wanted = self._wish.left_from_board
        if look.left is None or wanted is None:
            return None
        now = measured_pose(self._board, look.left, self._wish.left)
        slack = 1.0 if self._wish.rig is not None else _SLACK_OF_GUESS
        return None if now is None else way(now, wanted, self._middle_mm, slack)

    def _move_hand(self) -> None:
        wanted, frame = self._wish.left_from_board, self._frame
        if wanted is None or frame is None or self._wishing is not None or self.is_enough:
            return
        if not self._following.step(wanted, frame.captured_ns):
            self._do(Another())

    def _tell(self, text: str) -> None:
        self._events = [*self._events, text][-_MOST_EVENTS:]

    def _told(self) -> CaptureSnapshot:
        look, wish = self._look, self._wish
        seen = [look.left, look.right] if look is not None else [None, None]
        counts = [0 if one is None else len(one.ids) for one in seen]
        job = self._solving
        return CaptureSnapshot(
            time_ns=self._clock.now_ns(),
            phase=self._phase,
            camera=self._name,
            trouble=self._trouble,
            has_hand=self._following.has_hand,
            is_following=self._following.is_on,
            pictures=previews(
                self._board, self._frame, look, None if self.is_enough else self._wish
            ),
            n_seen=(counts[0], counts[1], len(self._board.points_mm)),
            checks=self._checks,
            wish=self._wish_text(),
            n_kept=len(self._kept),
            bound_mm=wish.bound_mm,
            worst_mm=wish.worst_mm,
            stop_mm=self._settings.stop_mm,
            is_enough=self.is_enough,
            covered=self._kept.covered,
            progress=None if job is None else Progress("solving the rig", job.progress),
            events=tuple(self._events),
            outcome=self._outcome,
        )

    @property
    def _trouble(self) -> str:
        if self._camera.is_down:
            return f"{self._camera.trouble or 'the camera is lost'}; it is opened again, wait"
        return "the camera sends no picture: check its cable" if self._camera.is_silent else ""

    def _wish_text(self) -> str:
        if self._phase is CapturePhase.SOLVING:
            return "solving: this takes a while"
        if self.is_enough:
            return "nothing: this is enough"
        if self._wishing is not None:
            return "thinking about the next view"
        if self._way is None:
            return "show the board to both cameras, as the outline is drawn"
        return str(self._way)
