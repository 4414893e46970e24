"""A room without pictures: a board in a hand, a display in a mirror, an eye that aligns."""

import numpy as np

from calibration.mirror.alignment_start import AlignedDisplay
from calibration.mirror.alignments import AlignedCalibration
from drivers.clock import ManualClock
from drivers.frames import StereoFrame
from drivers.interfaces import CameraInfo
from navapp.control.capture.board_view import BoardView
from navapp.control.commands import NudgeCross
from navapp.control.executors import InlineExecutor
from navapp.control.mirror_alignment.alignment import MirrorAlignment
from navapp.control.mirror_alignment.interfaces import AlignmentSettings
from navapp.control.mirror_alignment.states import AlignmentSnapshot, Confirm
from navapp.devices.simulated_mirror import true_display
from navapp.geometry.display_model import DisplayQuality
from navapp.geometry.transform import RigidTransform
from sim_devices.aligning_eye import AligningEye
from sim_devices.display import SimulatedDisplay
from sim_devices.mirror_setups import HEIGHT_PX, PITCH_MM, WIDTH_PX, draw_setup
from sim_devices.rigs import make_default_rig
from tests.calibration.marks import BOARD, HEIGHT, WIDTH, seen_pair

PERIOD_NS = 200_000_000
MIDDLE_MM = BOARD.points_mm.mean(axis=0)


class MirrorRoom:
    """Camera and hand at once; `look` stands in for the search in pictures."""

    def __init__(self, seed: int = 1, noise_px: float = 0.02) -> None:
        self.seed, self.rng = seed, np.random.default_rng(seed)
        self.rig, self.noise_px, self.clock = make_default_rig(), noise_px, ManualClock()
        self.setup = draw_setup(self.rng)
        self.eye, self.true = AligningEye(self.setup, seed, 0.5), true_display(self.setup)
        self.display = SimulatedDisplay(self.clock, WIDTH_PX, HEIGHT_PX)
        self.display.open()
        place = np.array([0.0, 0.0, 450.0]) - MIDDLE_MM
        self.pose: RigidTransform = RigidTransform.from_parts("left", "board", np.eye(3), place)
        self.is_hidden = self.is_closed = False
        self.hidden_corners: set[int] = set()
        self.n_frames = 0
        self.info = CameraInfo("sim:room", "fake", True, True, WIDTH, HEIGHT, ("A", "B"))

    def read(self, timeout_s: float) -> StereoFrame:
        self.clock.advance_ns(PERIOD_NS)
        self.n_frames += 1
        black = np.zeros((HEIGHT, WIDTH), np.uint8)
        now = self.clock.now_ns()
        return StereoFrame(black, black, now, now, 0, self.n_frames, "room")

    def close(self) -> None:
        self.is_closed = True

    def look(self, frame: StereoFrame) -> BoardView:
        if self.is_hidden:
            return BoardView(frame, None, None)
        pair = seen_pair(0, self.rig, self.pose, self.rng, noise_px=self.noise_px)
        left = pair.left
        kept = ~np.isin(left.ids, list(self.hidden_corners))
        left = type(left)(left.ids[kept], left.pixels[kept], left.sigma_px[kept], left.blur_px)
        return BoardView(frame, left, pair.right)

    def nudge(self, shift_mm, turn_rad) -> None:
        twist = np.concatenate([np.asarray(shift_mm, float), np.asarray(turn_rad, float)])
        self.pose = self.pose.move(twist, self.pose.apply(MIDDLE_MM))

    def point_mm(self, corner: int) -> np.ndarray:
        return self.pose.apply(BOARD.points_mm[corner])

    @property
    def display_told(self) -> AlignedDisplay:
        upside_down = self.setup.reads_upside_down
        return AlignedDisplay(WIDTH_PX, HEIGHT_PX, PITCH_MM, reads_upside_down=upside_down)

    def solve_as(self, *reasons: str, strays: tuple[int, ...] = ()):
        """Stands in for a solve: the true display, and a verdict."""

        def solve(display: AlignedDisplay, made) -> AlignedCalibration:
            n = len(made.pixels)
            quality = DisplayQuality(
                not reasons, reasons, 0.7 if reasons else 0.4, covariance=1e-4 * np.eye(14)
            )
            is_used = ~np.isin(np.arange(n), strays)
            model = type(self.true)(
                self.true.screen, self.true.glass, self.true.eye_mm, self.true.flips_columns,
                self.true.flips_rows, quality=quality,
            )  # fmt: skip
            return AlignedCalibration(
                model, is_used, np.zeros((n, 2)), 0.5, 1.0, made.points_mm, np.full(n, 0.4)
            )

        return solve


def alignment_in(room: MirrorRoom, *, has_hand: bool = True, solve=None, **more) -> MirrorAlignment:
    keeps_few, replaces = more.pop("keeps_few", False), more.pop("replaces", "")
    return MirrorAlignment(
        room, room.display, room.clock, BOARD, room.rig,
        AlignmentSettings(
            room.display_told, keeps_few=keeps_few, replaces=replaces, seed=room.seed
        ),
        executor=InlineExecutor(),
        hand=room if has_hand else None,
        detect=lambda frame, board: room.look(frame),
        solve=solve or room.solve_as(),
        **more,
    )  # fmt: skip


def steps(session: MirrorAlignment, n: int = 1) -> AlignmentSnapshot:
    for _ in range(n):
        session.step()
    return session.snapshot


def until_aimed(session: MirrorAlignment, most: int = 12) -> AlignmentSnapshot:
    """Step until a cross is lit."""
    for _ in range(most):
        if session.snapshot.corner is not None:
            break
        session.step()
    assert session.snapshot.corner is not None, session.snapshot.instruction
    return session.snapshot


def align(room: MirrorRoom, session: MirrorAlignment, n: int = 1) -> AlignmentSnapshot:
    """What an operator does with a cross, n times."""
    for _ in range(n):
        asked = until_aimed(session)
        aim = room.eye.aim_px(room.point_mm(asked.corner), asked.n_kept)
        across, down = np.rint(aim - asked.cross_px).astype(int).tolist()
        session.submit(
            NudgeCross(-across if asked.flips[0] else across, -down if asked.flips[1] else down)
        )
        session.submit(Confirm())
        steps(session)
        assert session.snapshot.n_kept == asked.n_kept + 1, session.snapshot.events
    return session.snapshot
