"""The alignment of crosses with the corners of a board: one step for each frame."""

from collections.abc import Callable
from queue import Empty, SimpleQueue

import numpy as np

from calibration.mirror.alignment_fit import Alignments
from calibration.mirror.alignment_start import AlignedDisplay
from calibration.mirror.alignments import FEWEST_ALIGNMENTS, solve_alignments
from calibration.targets.boards import Board
from drivers.clock import Clock
from drivers.frames import StereoFrame
from drivers.interfaces import Display, StereoCamera
from navapp.control.camera_link import CameraLink, Reopen
from navapp.control.capture.board_view import BoardView, detect_board
from navapp.control.commands import NudgeCross
from navapp.control.executors import Executor, Job
from navapp.control.mirror_alignment.aimed_corner import AimedCorner
from navapp.control.mirror_alignment.board_place import BoardLooks, BoardPlace, locate_board
from navapp.control.mirror_alignment.first_crosses import guess_pixel, light_beside
from navapp.control.mirror_alignment.guidance import Goal, Guide
from navapp.control.mirror_alignment.interfaces import (
    AlignmentSettings,
    MovingHand,
    Solve,
    Store,
)
from navapp.control.mirror_alignment.kept_crosses import KeptCross, KeptCrosses
from navapp.control.mirror_alignment.shown_cross import ShownCross
from navapp.control.mirror_alignment.snapshots import Parts, make_snapshot, name_corner
from navapp.control.mirror_alignment.solution import DisplaySolution
from navapp.control.mirror_alignment.states import (
    AlignmentCommand,
    AlignmentPhase,
    AlignmentSnapshot,
    Another,
    Confirm,
    Follow,
    Leave,
    MoveHand,
    Save,
    TurnArrows,
    Undo,
)
from navapp.control.recent_events import RecentEvents
from navapp.errors import DeviceError, InputError
from navapp.geometry.rig import StereoRig
from navapp.values.pictures import EyeLook

_WAIT_S = 0.1
_NO_TURN = (0.0, 0.0, 0.0)


class MirrorAlignment:
    """Locates the board, lights crosses, keeps what is confirmed, solves, says what is next.

    `step` is called from one thread, `submit` and `snapshot` from any.

    Args:
        camera: opened; closed with the alignment.
        display: opened; dark when the alignment is closed.
        clock: of both.
        board: that lies at the site.
        rig: of the camera.
        settings: of the display and the eye.
        executor: runs detection and solves.
        hand: that holds a simulated board, else None.
        eye: what a simulated eye sees, for practice; None: somebody's own.
        reopen: opens a lost camera again; None: its loss is the end.
        detect: finds the board in the pictures of a frame.
        solve: the display from alignments.
        store: takes all alignments whenever one was made or forgotten.
    """

    def __init__(
        self,
        camera: StereoCamera,
        display: Display,
        clock: Clock,
        board: Board,
        rig: StereoRig,
        settings: AlignmentSettings,
        *,
        executor: Executor,
        hand: MovingHand | None = None,
        eye: EyeLook | None = None,
        reopen: Reopen | None = None,
        detect: Callable[[StereoFrame, Board], BoardView] = detect_board,
        solve: Solve = solve_alignments,
        store: Store | None = None,
    ) -> None:
        self._names = camera.info.name, display.info.name
        self._camera, self._clock = CameraLink(camera, clock, reopen), clock
        self._board, self._rig, self._settings, self._executor = board, rig, settings, executor
        self._hand, self._eye, self._detect, self._store = hand, eye, detect, store
        self._is_following = hand is not None
        self._cross = ShownCross(display, clock, settings.valid_ms)
        self._solution = DisplaySolution(settings.display, executor, solve)
        self._guide = Guide(settings.display, board, rig)
        self._kept, self._looks, self._events = KeptCrosses(), BoardLooks(), RecentEvents()
        self._commands: SimpleQueue[AlignmentCommand] = SimpleQueue()
        self._is_over = False
        self._question = ""  # what was asked before leaving; empty: nothing
        self._frame: StereoFrame | None = None
        self._view: BoardView | None = None
        self._detection: Job[BoardView] | None = None
        self._rng = np.random.default_rng(settings.seed)
        # At most one of them: where the board is wanted, or the corner under a cross.
        self._goal: Goal | None = None
        self._aimed: AimedCorner | None = None
        self.snapshot = self._make_snapshot()

    @property
    def made(self) -> tuple[AlignedDisplay, Alignments]:
        """The display with what the arrows told of it, and the alignments."""
        return self._solution.display, self._kept.alignments

    def submit(self, command: AlignmentCommand) -> None:
        """Hand a command over; what became of it is in a later snapshot."""
        self._commands.put(command)

    def step(self) -> AlignmentSnapshot:
        """Take a frame, do what is due, and tell.

        Raises:
            DeviceError: a camera that nobody opens again; EndOfSequence: a finite source.
        """
        while (command := self._next_command()) is not None:
            self._do(command)
        frame = self._next_frame()
        if frame is not None:
            self._frame = frame
            if self._detection is None:
                self._detection = Job(lambda report: self._detect(frame, self._board))
                self._executor.start(self._detection)
        self._take_view()
        self._take_solution()
        self._choose()
        self._cross.renew()
        self.snapshot = self._make_snapshot()
        return self.snapshot

    def close(self) -> None:
        """Dark, then stop what runs; the camera is closed."""
        self._cross.close()
        if self._detection is not None:
            self._detection.cancel()
        self._solution.cancel()
        self._executor.close()
        self._camera.close()

    def _next_command(self) -> AlignmentCommand | None:
        try:
            return self._commands.get_nowait()
        except Empty:
            return None

    def _next_frame(self) -> StereoFrame | None:
        if self._camera.is_down:
            if self._camera.wait_for_return(_WAIT_S):
                self._events.add(f"camera {self._names[0]} is back")
            return None
        try:
            return self._camera.take(_WAIT_S)
        except DeviceError as error:
            if not self._camera.can_return:
                raise
            if self._detection is not None:
                self._detection.cancel()
            self._detection = self._frame = self._view = None
            self._looks.forget()
            self._give_up_aim()
            self._events.add(str(error))
            return None

    def _do(self, command: AlignmentCommand) -> None:
        if not isinstance(command, Leave):
            self._question = ""
        match command:
            case NudgeCross(right_px, down_px) if self._aimed is not None:
                self._cross.nudge(right_px, down_px, self._solution.flips)
                if (right_px, down_px) != (0, 0):
                    self._aimed.note_nudge()
            case Confirm() if self._aimed is not None:
                self._confirm(self._aimed)
            case Undo():
                self._undo()
            case Another():
                self._skip()
            case TurnArrows(columns, rows):
                self._turn(columns=columns, rows=rows)
            case Follow(is_on):
                self._is_following = is_on and self._hand is not None
            case MoveHand(shift_mm) if self._hand is not None:
                self._is_following = False
                self._hand.nudge(shift_mm, _NO_TURN)
            case Save():
                self._save()
            case Leave():
                self._leave()

    def _confirm(self, aimed: AimedCorner) -> None:
        if aimed.is_moved:
            aimed.confirm(self._clock.now_ns())
            return
        self._events.add("not kept: move the cross onto the corner first")

    def _turn(self, *, columns: bool, rows: bool) -> None:
        solution = self._solution
        if solution.found is not None or solution.is_under_way:
            # Two lines on a small screen, newest first.
            self._events.add(f"u to fewer than {FEWEST_ALIGNMENTS} frees them, or begin anew")
            self._events.add("the arrows stay: the display is solved with them")
            return
        solution.turn(self._kept, columns=columns, rows=rows)
        if len(self._kept) > 0:
            self._write()
        self._events.add(f"arrows exchanged; the eye reads text {solution.display.reading}")

    def _undo(self) -> None:
        dropped = self._kept.drop_last()
        if dropped is None:
            return
        self._events.add(f"alignment {len(self._kept) + 1} is forgotten")
        self._give_up_aim()
        self._goal = None
        self._write()
        self._solution.begin(self._kept)

    def _skip(self) -> None:
        if self._aimed is not None:
            self._guide.skip_corner(self._aimed.corner)
        elif self._goal is not None:
            self._guide.skip_goal(self._goal)
        self._give_up_aim()
        self._goal = None

    def _save(self) -> None:
        verdict = self._solution.verdict
        if verdict is not None and verdict.is_accepted:
            self._is_over = True
            return
        missing = FEWEST_ALIGNMENTS - len(self._kept)
        why = f"{missing} alignments are missing" if missing > 0 else "it is not accepted yet"
        self._events.add(f"nothing is saved: {why}")

    def _leave(self) -> None:
        n, settings, verdict = len(self._kept), self._settings, self._solution.verdict
        question = ""
        if 0 < n < FEWEST_ALIGNMENTS and not settings.keeps_few:
            question = f"{n} alignments make no display: leave again to end without one"
        elif verdict is not None and verdict.is_accepted and settings.replaces:
            question = f"{settings.replaces} will be replaced: leave again, or ctrl+c keeps it"
        if question and not self._question:
            self._question = question
            self._events.add(question)
            return
        self._is_over = True

    def _write(self) -> None:
        """What was made so far: a crash must not cost it."""
        if self._store is None:
            return
        try:
            self._store(*self.made)
        except InputError as error:
            self._events.add(str(error))

    def _take_view(self) -> None:
        job = self._detection
        if job is None or not job.is_finished:
            return
        self._detection = None
        if job.error is not None:
            raise job.error
        view = self._view = job.result
        if view is None:
            return
        place = locate_board(view, self._board, self._rig)
        self._looks.add(place)
        if self._aimed is None:
            return
        self._aimed.follow(place)
        self._keep_if_due(self._aimed, view.frame.captured_ns)
        if place is not None and self._aimed is not None and self._aimed.is_elsewhere(place):
            self._events.add("the board was moved: another corner is chosen")
            self._guide.forget_corners()
            self._give_up_aim()

    def _keep_if_due(self, aimed: AimedCorner, now_ns: int) -> None:
        """What was confirmed, with its place in that moment."""
        against = aimed.judge(self._looks, now_ns)
        if against is None:
            return
        place, pixel = self._looks.newest, self._cross.pixel
        told = self._looks.average(aimed.corner, aimed.since_ns())
        if against or place is None or pixel is None or told is None:
            self._events.add(f"nothing is kept: {against or 'the corner is not seen'}")
            return
        point_mm, sd_mm = told
        middle_mm = self._guide.middle_of(place)
        self._kept.add(KeptCross(aimed.corner, pixel, point_mm, sd_mm, middle_mm))
        name = name_corner(self._board, aimed.corner)
        self._events.add(f"alignment {len(self._kept)} is kept: {name}")
        self._guide.forget_corners()
        self._give_up_aim()
        self._write()
        self._solution.begin(self._kept)

    def _take_solution(self) -> None:
        strays_before = self._strays()
        if not self._solution.take():
            return
        if self._solution.trouble:
            self._events.add(f"not solved: {self._solution.trouble}")
        for number in sorted(self._strays() - strays_before):
            name = name_corner(self._board, self._kept.corners[number])
            self._events.add(f"alignment {number + 1} does not agree, it is left out: {name}")
        verdict = self._solution.verdict
        if verdict is not None and verdict.is_accepted:
            self._events.add(f"{len(self._kept)} alignments are enough: save, or make more")

    def _strays(self) -> set[int]:
        verdict = self._solution.verdict
        return set() if verdict is None else set(verdict.strays)

    def _choose(self) -> None:
        """Where the board is wanted next, or the corner that a cross is lit for."""
        place = self._looks.steady
        if self._is_over or self._aimed is not None or self._solution.is_under_way:
            return
        if place is None or not self._looks.is_still:
            return
        if self._goal is not None:
            if not self._goal.is_reached(self._guide.middle_of(place)):
                return
            self._goal = None
        known = self._solution.know(self._kept)
        chosen = self._guide.choose(known, place)
        if isinstance(chosen, Goal):
            self._begin_goal(chosen, place)
        elif chosen is not None:
            self._begin_aim(chosen, place)

    def _begin_goal(self, goal: Goal, place: BoardPlace) -> None:
        self._goal = goal
        if self._hand is not None and self._is_following:
            self._hand.nudge(goal.middle_mm - self._guide.middle_of(place), _NO_TURN)

    def _begin_aim(self, corner: int, place: BoardPlace) -> None:
        point_mm = place.point_of(corner)
        if point_mm is None:
            return
        known = self._solution.know(self._kept)
        display = self._solution.display
        expected = guess_pixel(display, self._kept.alignments, known.model, point_mm)
        self._cross.put(light_beside(display, expected, self._rng))
        self._aimed = AimedCorner(corner, place)

    def _give_up_aim(self) -> None:
        self._aimed = None
        self._cross.put(None)

    @property
    def _phase(self) -> AlignmentPhase:
        if self._is_over:
            return AlignmentPhase.OVER
        if self._solution.is_under_way:
            return AlignmentPhase.SOLVING
        if self._aimed is not None:
            return AlignmentPhase.ALIGNING
        return AlignmentPhase.SEEKING if self._goal is None else AlignmentPhase.MOVING

    @property
    def _trouble(self) -> str:
        if self._camera.is_down:
            return f"{self._camera.trouble or 'the camera is lost'}; it is opened again, wait"
        if self._camera.is_silent:
            return "the camera sends no picture: check its cable"
        return self._cross.trouble

    def _make_snapshot(self) -> AlignmentSnapshot:
        return make_snapshot(
            Parts(
                self._clock.now_ns(), self._phase, self._names, self._board, self._frame,
                self._view, self._eye, self._hand is not None, self._is_following,
                self._looks, self._guide, self._goal, self._aimed, self._cross.pixel,
                self._solution, self._kept, self._events.texts, self._events.n_told, self._trouble,
                self._question,
            )
        )  # fmt: skip
