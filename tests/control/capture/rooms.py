"""A room without pictures: a hand that moves at once, and looks that are projected marks."""

import numpy as np

from drivers.clock import ManualClock
from drivers.frames import StereoFrame
from drivers.interfaces import CameraInfo
from navapp.control.capture.board_view import BoardView
from navapp.control.capture.capture import Capture
from navapp.control.capture.interfaces import CaptureSettings
from navapp.control.capture.states import Outcome
from navapp.control.executors import InlineExecutor
from navapp.geometry.camera import Camera
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import RigidTransform
from tests.calibration.marks import BOARD, HEIGHT, WIDTH, drawn_rig, seen_pair

PERIOD_NS = 200_000_000
DEPTH_MM = (350.0, 550.0)


def with_usual_lenses(rig: StereoRig) -> StereoRig:
    """Square pixels, and a focal length that somebody could guess to a tenth."""

    def usual(camera: Camera) -> Camera:
        matrix = np.array(camera.matrix)
        matrix[0, 0] = matrix[1, 1] = 1300.0 + 0.1 * matrix[0, 0]
        return Camera(matrix, camera.distortion, WIDTH, HEIGHT)

    return StereoRig(usual(rig.left), usual(rig.right), rig.right_from_left)


class Room:
    """Camera, hand and store at once; `look` stands in for the search in pictures."""

    def __init__(self, seed: int = 3, noise_px: float = 0.05) -> None:
        self.rng = np.random.default_rng(seed)
        self.rig, self.noise_px = with_usual_lenses(drawn_rig(self.rng)), noise_px
        self.clock = ManualClock()
        self.pose: RigidTransform | None = None
        self.off_mm = 2.0
        self.n_frames = 0
        self.kept: dict[int, int] = {}
        self.is_closed = False
        self.nudges: list[tuple[tuple[float, ...], tuple[float, ...]]] = []
        self.info = CameraInfo("sim:room", "fake", True, True, WIDTH, HEIGHT, ("A", "B"))

    def read(self, timeout_s: float) -> StereoFrame:
        self.clock.advance_ns(PERIOD_NS)
        self.n_frames += 1
        black = np.zeros((HEIGHT, WIDTH), np.uint8)
        now = self.clock.now_ns()
        return StereoFrame(black, black, now, now, 0, self.n_frames, "room")

    def close(self) -> None:
        self.is_closed = True

    def look(self, frame: StereoFrame, board: object) -> BoardView:
        if self.pose is None:
            return BoardView(frame, None, None)
        pair = seen_pair(0, self.rig, self.pose, self.rng, noise_px=self.noise_px)
        views = [view if len(view.ids) >= 6 else None for view in (pair.left, pair.right)]
        return BoardView(frame, *views)

    def move_to(self, left_from_body: RigidTransform) -> None:
        off = self.rng.normal(0.0, 1.0, 6) * np.repeat((self.off_mm, 0.02), 3)
        self.pose = left_from_body.move(off, left_from_body.apply(BOARD.points_mm.mean(axis=0)))

    def nudge(self, shift_mm: tuple[float, ...], turn_rad: tuple[float, ...]) -> None:
        self.nudges.append((shift_mm, turn_rad))

    def keep(self, index: int, frame: StereoFrame) -> None:
        self.kept[index] = frame.sequence

    def drop(self, index: int) -> None:
        del self.kept[index]


def capture_in(room: Room, solve=None, reopen=None, executor=None, **asked) -> Capture:
    settings = CaptureSettings(DEPTH_MM, **{"stop_mm": 0.15, **asked})
    return Capture(
        room, room.clock, BOARD, settings,
        executor=executor or InlineExecutor(),
        store=room,
        solve=solve or (lambda pairs, report: Outcome(True, ())),
        hand=room,
        reopen=reopen,
        # A test may change how the room is seen.
        detect=lambda frame, board: room.look(frame, board),
    )  # fmt: skip


def steps(capture: Capture, n: int = 1):
    for _ in range(n):
        capture.step()
    return capture.snapshot
