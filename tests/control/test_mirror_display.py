"""A session whose display is seen in the mirror: lit after the check, dark otherwise."""

import argparse
from collections.abc import Callable
from dataclasses import replace
from datetime import date, timedelta

import numpy as np
import pytest

from drivers.fixed_mirror import FixedMirror
from drivers.interfaces import PowerState, ProjectorStatus
from navapp.cli.live_session import _read_display
from navapp.config import parse
from navapp.control.calibrated_display import CalibratedDisplay, Eyes
from navapp.control.check_points import LEAST_APART_MM, LocateCorners
from navapp.control.command_files import command_from_json, command_to_json
from navapp.control.commands import (
    Blank,
    CheckMirror,
    ConfirmCross,
    ConfirmStep,
    DistrustRig,
    EnterStage,
    NudgeCross,
    Show,
    ToggleLayer,
)
from navapp.control.device_handlers import ProjectorHandler
from navapp.control.pictures import banner
from navapp.control.states import MirrorCheck
from navapp.errors import ConfigurationError, DeviceLost
from navapp.geometry.display_model import DisplayModel, DisplayQuality
from navapp.geometry.display_model_files import write_display_model
from navapp.geometry.display_model_optics import VirtualScreen
from navapp.geometry.rectification import Rectifier
from navapp.overlay.colours import DRILL, GUIDE
from navapp.values import (
    DisparityMap,
    DrillAxis,
    Foreground,
    Origin,
    OverlayMode,
    Plan,
    Reason,
    Status,
    SurgicalContent,
    Surroundings,
    TrackedFrame,
)
from sim_devices.display import SimulatedDisplay
from tests.control.cuts import cut_plan
from tests.control.fakes import PERIOD_NS, Bench, a_plan, a_pose, a_rig, answer, navigating
from tests.control.test_late_pictures import SlowDisplay
from tests.overlay.scenes import is_colour

WIDTH, HEIGHT, PITCH_MM = 400, 300, 0.5
DEPTH_MM, EYE_MM = 300.0, np.array([20.0, -60.0, -150.0])
TODAY = date.today()
GOOD = DisplayQuality(
    True, error_mm=0.2, expires_on=TODAY + timedelta(days=1), covariance=1e-9 * np.eye(14)
)


def a_model(**changes: object) -> DisplayModel:
    """A screen in the plane of the bone's middle, its columns seen from right to left."""
    half = 0.5 * PITCH_MM * np.array([WIDTH - 1, HEIGHT - 1])
    screen = VirtualScreen(
        np.array([half[0], -half[1], DEPTH_MM]), np.array([-1.0, 0, 0]), np.array([0, 1.0, 0]),
        PITCH_MM, WIDTH, HEIGHT,
    )  # fmt: skip
    model = DisplayModel(screen, None, EYE_MM, True, False, quality=GOOD)
    return replace(model, **changes)


def measured_bone(half_px: int = 36) -> TrackedFrame:
    """An answer that has measured a square of the bone, a bowl."""
    geometry = Rectifier(a_rig()).geometry
    size = 2 * half_px
    x, y = round(geometry.centre_x_px) - half_px, round(geometry.centre_y_px) - half_px
    v, u = np.mgrid[y : y + size, x : x + size]
    rays = (u - geometry.centre_x_px) ** 2 + (v - geometry.centre_y_px) ** 2
    depth_mm = np.full((size, size), DEPTH_MM)
    for _ in range(20):
        depth_mm = DEPTH_MM + 0.01 * rays * (depth_mm / geometry.focal_px) ** 2
    disparity = geometry.disparity_map_px(depth_mm)
    matched = np.full(disparity.shape, Origin.MATCHED, np.uint8)
    found = DisparityMap(disparity, np.full_like(disparity, 0.1), matched, x, y)
    around = Surroundings(disparity, matched, found.box, False, matched)
    nothing = np.zeros(disparity.shape, dtype=bool)
    return replace(answer(), foreground=Foreground(around, found, nothing))


def a_bench(
    model: DisplayModel | None = None,
    make_display: Callable[..., SimulatedDisplay] = lambda clock, w, h: SimulatedDisplay(
        clock, WIDTH, HEIGHT
    ),
    delay_ms: float = 0.0,
    eyes: Eyes = "left",
    mirror: FixedMirror | None = None,
    plan: Plan | None = None,
    layers: tuple[str, ...] | None = None,
    locate_corners: LocateCorners | None = None,
) -> Bench:
    display = CalibratedDisplay(model or a_model(), check_minutes=1.0, eyes=eyes)
    bench = Bench(
        calibrated_display=display,
        make_display=make_display,
        display_delay_ms=delay_ms,
        mirror=mirror,
        plan=plan,
        layers=layers,
        locate_corners=locate_corners,
    )
    bench.script.tracked = measured_bone()
    return bench


def check(bench: Bench, *nudges: tuple[int, int]) -> None:
    """Begin the check and confirm its three crosses."""
    bench.do(CheckMirror())
    bench.frames()
    for number in range(3):
        if number < len(nudges):
            bench.do(NudgeCross(*nudges[number]))
            bench.frames()
        bench.do(ConfirmCross())
        bench.frames()


def guides(bench: Bench) -> np.ndarray:
    """What of the display is lit, but for the status at the bottom; (h, w)."""
    return bench.display.visible_image()[: round(0.93 * HEIGHT)].max(axis=2) > 0


def test_guides_are_lit_after_the_check_on_black_and_where_they_are() -> None:
    bench = a_bench()
    navigating(bench)
    bench.frames()
    assert bench.snapshot.reasons == (Reason.MIRROR_UNCHECKED,)
    assert not guides(bench).any()
    assert bench.display.visible_image().any()  # the status
    check(bench)
    assert bench.snapshot.reasons == ()
    lit = guides(bench)
    assert 0.01 < lit.mean() < 0.5
    assert bench.results[-1].picture.mode is OverlayMode.MIRROR
    # The bone's middle lies on the left camera's axis.
    u, v = a_model().project(np.array([[0.0, 0.0, DEPTH_MM]]))[0]
    rows, columns = np.nonzero(lit)
    assert abs(columns.mean() - u) < 12.0
    assert abs(rows.mean() - v) < 30.0


def test_the_cross_is_shown_where_its_point_is_seen_and_moves_with_the_keys() -> None:
    bench = a_bench()
    navigating(bench)
    bench.do(CheckMirror())
    bench.frames()
    assert bench.snapshot.cross_check is not None
    # The operator's screen marks the point as well: on black video nothing else is there.
    assert bench.snapshot.picture is not None
    assert bench.snapshot.picture[24:72].any()
    before = np.argwhere(guides(bench)).mean(axis=0)
    bench.do(NudgeCross(10, 4))
    bench.frames()
    moved = np.argwhere(guides(bench)).mean(axis=0) - before
    # The eye's right is the display's left: the columns are seen from right to left.
    np.testing.assert_allclose(moved, [4.0, -10.0], atol=0.2)
    assert not bench.snapshot.is_navigable


class Board:
    """Corners at the depth of the bone's rim, beside it."""

    ids = np.array([3, 5, 8, 11])

    def __init__(self) -> None:
        self.corners_mm: np.ndarray | None = np.array(
            [[-40.0, -30.0, 310.0], [30.0, -30.0, 310.0], [-5.0, 30.0, 312.0], [0.0, 0.0, 310.0]]
        )

    def __call__(self, left: np.ndarray, right: np.ndarray):
        return None if self.corners_mm is None else (self.ids, self.corners_mm.copy())


def test_corners_of_a_board_that_is_seen_are_checked_rather_than_the_bone() -> None:
    board = Board()
    bench = a_bench(locate_corners=board)
    navigating(bench)
    bench.do(CheckMirror())
    bench.frames()
    assert "corner of the board" in bench.events[-1].text
    shown = np.argwhere(guides(bench)).mean(axis=0)[::-1]
    view = a_model().view()
    places = view.to_display_px(view.camera.project(view.warp(board.corners_mm)))
    assert np.linalg.norm(places - shown, axis=1).min() < 1.0
    for _ in range(3):
        bench.do(ConfirmCross())
        bench.frames()
    assert bench.snapshot.is_navigable


def test_a_board_that_moves_or_is_hidden_confirms_nothing() -> None:
    board = Board()
    bench = a_bench(locate_corners=board)
    navigating(bench)
    bench.do(CheckMirror())
    bench.frames()
    at_rest = board.corners_mm
    for corners, why in ((at_rest + 0.4, "moved by 0.7 mm"), (None, "must see the board")):
        board.corners_mm = corners
        bench.do(ConfirmCross())
        assert why in bench.refused()
        assert bench.snapshot.cross_check.number == 0
    board.corners_mm = at_rest + 0.1
    bench.do(ConfirmCross())
    assert bench.snapshot.cross_check.number == 1


@pytest.mark.parametrize("board", [lambda left, right: None, lambda left, right: (
    np.array([1, 2, 3]), np.array([[0.0, 0.0, 300.0], [30.0, 0.0, 300.0], [0.0, 30.0, 300.0]])
)], ids=["not seen", "too small"])  # fmt: skip
def test_without_three_corners_the_bone_is_checked(board) -> None:
    bench = a_bench(locate_corners=board)
    navigating(bench)
    bench.do(CheckMirror())
    assert "place on the bone" in bench.events[-1].text


@pytest.mark.parametrize("what", ["camera", "rig"])
def test_in_a_fault_nothing_is_lit(what: str) -> None:
    bench = a_bench()
    navigating(bench)
    check(bench)
    assert guides(bench).any()
    if what == "camera":
        bench.camera.error = DeviceLost("gone")
    else:
        bench.do(DistrustRig("it was bumped"))
    bench.frames()
    assert bench.state == "fault"
    assert not bench.display.visible_image().any()


def test_a_check_that_is_off_keeps_the_display_dark() -> None:
    bench = a_bench()
    navigating(bench)
    check(bench, (0, 0), (3, 0))  # 3 px of 0.5 mm in the bone's plane
    assert bench.snapshot.reasons == (Reason.MIRROR_CHECK_FAILED,)
    assert not guides(bench).any()
    check(bench, (1, 0), (0, -1))
    assert bench.snapshot.reasons == ()


def test_a_cross_that_was_not_shown_cannot_be_confirmed() -> None:
    bench = a_bench()
    navigating(bench)
    for command in (CheckMirror(), ConfirmCross(), ConfirmCross(), ConfirmCross()):
        bench.do(command)
    assert "not shown" in bench.refused()
    assert bench.snapshot.cross_check is not None
    bench.frames()
    bench.do(NudgeCross(7, 0))
    bench.do(ConfirmCross())  # it has moved since it was shown
    assert bench.snapshot.cross_check.number == 0
    bench.do(Blank())
    bench.frames()
    bench.do(ConfirmCross())
    assert bench.snapshot.cross_check.number == 0
    assert not bench.display.visible_image().any()


def test_a_check_ends_with_its_bone_and_a_passed_one_with_a_device() -> None:
    bench = a_bench()
    navigating(bench)
    bench.do(CheckMirror())
    bench.frames()
    assert guides(bench).any()
    bench.do(EnterStage(5))
    assert not guides(bench).any()
    bench.frames()
    assert bench.snapshot.cross_check is None
    mirror = SlidingMirror()
    bench = a_bench(mirror=mirror)
    navigating(bench)
    check(bench)
    assert bench.snapshot.is_navigable
    mirror.angle_deg = 44.0
    bench.frames(2)
    mirror.angle_deg = 45.0
    bench.frames(2)
    assert bench.snapshot.reasons == (Reason.MIRROR_UNCHECKED,)


class SlidingMirror(FixedMirror):
    """One that is not driven, and is pushed."""

    def __init__(self) -> None:
        super().__init__(45.0)
        self.angle_deg = 45.0

    def position_deg(self) -> float:
        return self.angle_deg


def test_nothing_is_lit_of_a_bone_that_moves_too_fast() -> None:
    bench = a_bench(delay_ms=PERIOD_NS / 1e6)
    navigating(bench)
    check(bench)
    for x_mm in (8.0, 16.0, 24.0):
        told = measured_bone()
        moved = replace(told.estimate, camera_from_bone=a_pose(x_mm=x_mm))
        bench.script.tracked = replace(told, estimate=moved)
        bench.frames()
    assert not guides(bench).any()


def test_a_check_grows_old() -> None:
    bench = a_bench()
    navigating(bench)
    check(bench)
    assert bench.snapshot.is_navigable
    bench.clock.advance_ns(round(61e9))
    bench.frames()
    assert bench.snapshot.reasons == (Reason.MIRROR_CHECK_OLD,)
    assert not guides(bench).any()


def test_a_check_that_is_begun_again_or_given_up_counts_no_more() -> None:
    bench = a_bench()
    navigating(bench)
    check(bench)
    bench.do(CheckMirror())
    bench.frames()
    bench.do(CheckMirror())
    bench.frames()
    assert bench.snapshot.cross_check is None
    assert bench.snapshot.reasons == (Reason.MIRROR_UNCHECKED,)


def test_the_check_needs_a_pose_points_and_a_mirror() -> None:
    bench = a_bench()
    bench.do(CheckMirror())
    assert "refused" in bench.events[-1].text
    navigating(bench)
    bench.script.tracked = measured_bone(half_px=8)
    bench.frames()
    bench.do(CheckMirror())
    assert f"{LEAST_APART_MM:.0f} mm apart" in bench.events[-1].text
    bench.do(ConfirmCross())
    assert "no check" in bench.events[-1].text
    video = Bench()
    navigating(video)
    video.do(CheckMirror())
    assert "not seen in a mirror" in video.events[-1].text


DIFFERENT = {
    "another size": (a_model(), {"width": WIDTH + 1}, Reason.DISPLAY_DIFFERS),
    "another flip": (a_model(), {"flips_horizontally": True}, Reason.DISPLAY_DIFFERS),
    "another name": (a_model(display_name="monitor 7"), {}, Reason.DISPLAY_DIFFERS),
    "expired": (
        a_model(quality=replace(GOOD, expires_on=TODAY - timedelta(days=1))), {},
        Reason.DISPLAY_EXPIRED,
    ),
    "not accepted": (
        a_model(quality=replace(GOOD, is_accepted=False)), {}, Reason.DISPLAY_NOT_ACCEPTED,
    ),
    "no record": (a_model(quality=None), {}, Reason.DISPLAY_NOT_ACCEPTED),
    "mirror turned": (a_model(mirror_deg=44.0), {}, Reason.MIRROR_AWAY),
}  # fmt: skip


@pytest.mark.parametrize("what", DIFFERENT)
def test_the_display_stays_dark_when_it_is_not_what_was_calibrated(what: str) -> None:
    model, changes, reason = DIFFERENT[what]
    given = {"width": WIDTH, "height": HEIGHT, **changes}
    bench = a_bench(model, lambda clock, w, h: SimulatedDisplay(clock, **given))
    navigating(bench)
    check(bench)
    assert reason in bench.snapshot.reasons
    assert not bench.display.visible_image().any()


def test_what_the_operator_blanks_stays_dark() -> None:
    bench = a_bench()
    navigating(bench)
    check(bench)
    bench.do(Blank())
    bench.frames()
    assert not bench.display.visible_image().any()
    bench.do(Show())
    bench.frames()
    assert guides(bench).any()


def test_guides_go_out_with_the_bone_and_when_no_picture_follows() -> None:
    bench = a_bench()
    navigating(bench)
    check(bench)
    bench.script.tracked = answer(Status.LOST, Reason.NO_SURFACE, has_pose=False)
    bench.frames()
    assert bench.state == "suspended"
    assert not guides(bench).any()
    bench.script.tracked = measured_bone()
    bench.frames()
    assert guides(bench).any()
    bench.clock.advance_ns(501_000_000)
    assert not bench.display.visible_image().any()


def test_a_hand_in_front_takes_the_light_away() -> None:
    bench = a_bench()
    navigating(bench)
    check(bench)
    n_lit = guides(bench).sum()
    told = measured_bone()
    assert told.foreground is not None
    hand = np.zeros_like(told.foreground.is_in_front)
    hand[:, : hand.shape[1] // 2] = True
    bench.script.tracked = replace(told, foreground=replace(told.foreground, is_in_front=hand))
    bench.frames()
    assert guides(bench).sum() < 0.7 * n_lit


def test_nothing_is_lit_where_the_depth_is_a_guess() -> None:
    bench = a_bench()
    navigating(bench)
    check(bench)
    told = measured_bone()
    assert told.foreground is not None
    around = told.foreground.surroundings
    guessed = np.full_like(around.origin, Origin.FILLED_BORDER)
    unmatched = replace(told.foreground.measured, origin=np.zeros_like(guessed))
    foreground = Foreground(replace(around, origin=guessed), unmatched, told.foreground.is_in_front)
    bench.script.tracked = replace(told, foreground=foreground)
    bench.frames()
    bone = guides(bench)[60:240, 60:340]
    assert bone.mean() < 0.01


def test_guides_are_where_the_bone_will_be_when_their_light_is_seen() -> None:
    """A bone that moves by 1 mm a frame, and a display that is 66 ms late: one frame."""
    middles = []
    for delay_ms in (0.0, PERIOD_NS / 1e6):
        bench = a_bench(delay_ms=delay_ms)
        navigating(bench)
        check(bench)
        for x_mm in (1.0, 2.0, 3.0):
            told = measured_bone()
            moved = replace(told.estimate, camera_from_bone=a_pose(x_mm=x_mm))
            bench.script.tracked = replace(told, estimate=moved)
            bench.frames()
        middles.append(np.argwhere(guides(bench)).mean(axis=0)[1])
    # The eye's columns rise to the left: 0.7 mm (damped) of 0.5 mm a pixel.
    assert middles[1] - middles[0] == pytest.approx(-0.7 / PITCH_MM, abs=0.4)


def status(bench: Bench) -> str:
    return banner(bench.snapshot)


def test_two_eyes_are_refused_where_all_guides_are_off_for_the_other() -> None:
    """The bone reaches from the screen's plane to 32 mm behind it, 450 mm from the eye."""
    bench = a_bench(eyes="both")
    navigating(bench)
    assert bench.snapshot.reasons[0] is Reason.OTHER_EYE
    error = bench.snapshot.mirror_error
    assert error is not None
    assert error.other_eye_mm is not None
    assert 2.0 < error.other_eye_mm < 6.0
    assert 5.0 < error.screen_shift_mm < 32.0
    assert f"bring the picture {error.screen_shift_mm:.0f} mm away" in status(bench)
    assert not guides(bench).any()


def test_a_covered_eye_is_named_with_the_error_of_the_one_that_looks() -> None:
    bench = a_bench(eyes="left")
    navigating(bench)
    check(bench)
    assert bench.snapshot.is_navigable
    error = bench.snapshot.mirror_error
    assert error is not None
    assert error.other_eye_mm is None
    assert f"error <= {error.bound_mm:.1f} mm, right eye covered" in status(bench)


def test_a_cut_that_is_made_needs_no_guides_and_is_not_judged() -> None:
    """The bone is a bowl, cut off below its rim."""
    bench = a_bench(eyes="both", plan=cut_plan(), layers=("planes",))
    navigating(bench)
    assert bench.snapshot.mirror_error is not None
    for name in ("top", "side"):
        bench.do(ConfirmStep(name))
    bench.frames(1)
    assert bench.snapshot.mirror_error is None


def test_layers_that_are_off_for_the_other_eye_are_not_lit_and_named() -> None:
    """A hole along the screen's plane, and a bone whose rim is 32 mm behind it."""
    drill = DrillAxis("femur", np.zeros(3), np.array([1.0, 0.0, 0.0]), 10.0, 4.0)
    plan = replace(a_plan(), content=SurgicalContent(drills={"guide": drill}))
    bench = a_bench(eyes="both", plan=plan, layers=("bone", "drills"))
    navigating(bench)
    error = bench.snapshot.mirror_error
    assert error is not None
    assert error.off_layers == ("bone",)
    check(bench)
    assert bench.snapshot.is_navigable
    assert "not shown, off for the other eye: bone (bring the picture" in status(bench)
    lit = bench.display.visible_image()[: round(0.93 * HEIGHT)]
    assert is_colour(lit, DRILL).sum() > 5
    assert not is_colour(lit, GUIDE).any()
    bench.do(ToggleLayer("drills"))
    bench.frames()
    assert bench.snapshot.reasons[0] is Reason.OTHER_EYE


def test_layers_that_may_be_too_far_off_are_not_lit_and_named() -> None:
    """An axis that stands 30 mm out of the bone, and a pose that may be turned."""
    drill = DrillAxis("femur", np.zeros(3), np.array([1.0, 0.0, 0.0]), 10.0, 4.0)
    plan = replace(a_plan(), content=SurgicalContent(drills={"guide": drill}))
    bench = a_bench(plan=plan, layers=("bone", "drills"))
    navigating(bench)
    check(bench)
    told = measured_bone()
    assert told.estimate is not None
    # About the bone's middle: its rim, 40 mm away, moves further than the axis.
    covariance = np.diag([1e-4] * 3 + [6e-4] * 3)
    bench.script.tracked = replace(told, estimate=replace(told.estimate, covariance=covariance))
    bench.frames()
    error = bench.snapshot.mirror_error
    assert error is not None
    assert error.inexact_layers == ("bone",)
    assert error.bound_mm <= bench.snapshot.stage.tolerance_mm
    assert bench.snapshot.is_navigable
    assert "not shown, perhaps too far off: bone" in status(bench)
    assert not is_colour(bench.display.visible_image(), GUIDE)[: round(0.93 * HEIGHT)].any()
    assert guides(bench).any()


def test_a_calibration_that_does_not_know_its_error_lights_no_guide() -> None:
    bench = a_bench(a_model(quality=replace(GOOD, covariance=None)))
    navigating(bench)
    assert Reason.MIRROR_INEXACT in bench.snapshot.reasons


def test_a_pose_that_becomes_uncertain_is_judged_in_its_own_frame() -> None:
    bench = a_bench()
    navigating(bench)
    check(bench)
    told = measured_bone()
    assert told.estimate is not None
    estimate = replace(told.estimate, covariance=np.diag([2.0] * 3 + [1e-8] * 3))
    bench.script.tracked = replace(told, estimate=estimate)
    bench.frames(1)
    assert not guides(bench).any()


def test_a_cross_whose_picture_came_too_late_cannot_be_confirmed() -> None:
    """Its display drops what has expired, without a word."""
    bench = a_bench(make_display=lambda clock, w, h: SlowDisplay(clock, WIDTH, HEIGHT))
    navigating(bench)
    bench.display.delay_ns = 600_000_000
    bench.do(CheckMirror())
    bench.frames()
    assert not bench.display.visible_image().any()
    bench.do(ConfirmCross())
    assert "not shown" in bench.refused()


def test_guides_that_may_be_off_by_more_than_the_stage_allows_are_not_lit() -> None:
    """A pose that is certain to 1 mm, and a stage that allows 2."""
    bench = a_bench()
    navigating(bench)
    check(bench)
    told = measured_bone()
    assert told.estimate is not None
    for sd_mm, is_lit in ((0.3, True), (1.5, False)):
        covariance = np.diag([sd_mm**2] * 3 + [1e-8] * 3)
        estimate = replace(told.estimate, covariance=covariance)
        bench.script.tracked = replace(told, estimate=estimate)
        bench.frames(12)
        error = bench.snapshot.mirror_error
        assert error is not None
        assert error.bound_mm > 1.9 * sd_mm
        assert (Reason.MIRROR_INEXACT in bench.snapshot.reasons) == (not is_lit)
        assert guides(bench).any() == is_lit


class KeystoneProjector:
    name = "fake projector"

    def __init__(self, status: ProjectorStatus) -> None:
        self._status = status

    def status(self) -> ProjectorStatus:
        return self._status


@pytest.mark.parametrize(
    ("status", "is_refused"),
    [
        (ProjectorStatus(PowerState.ON, keystone=(0, 0)), False),
        (ProjectorStatus(PowerState.ON, keystone=(0, 3)), True),
        (ProjectorStatus(PowerState.ON, keystone=(0, 0), flips_horizontally=True), True),
    ],
)
def test_a_projector_with_keystone_or_another_flip_is_refused(status, is_refused: bool) -> None:
    report = ProjectorHandler(KeystoneProjector(status), a_model()).report()
    assert (report.reason is Reason.PROJECTOR_ALTERS) is is_refused
    turned = ProjectorHandler(KeystoneProjector(status), a_model(projector_flips=(True, False)))
    assert (turned.report().reason is None) is (status.flips_horizontally is True)


def test_a_projector_that_was_calibrated_must_answer() -> None:
    absent = KeystoneProjector(ProjectorStatus(PowerState.ABSENT))
    with_flips = ProjectorHandler(absent, a_model(projector_flips=(True, False)))
    assert with_flips.report().reason is Reason.PROJECTOR_LOST
    assert ProjectorHandler(absent, a_model()).report().reason is None


@pytest.mark.parametrize("residual_mm", [np.nan, np.inf, -1.0, 1.01])
def test_a_check_is_not_passed_by_what_is_no_small_distance(residual_mm: float) -> None:
    display = CalibratedDisplay(a_model())
    found = display.find_check_reason(MirrorCheck(0, residual_mm), 1)
    assert found is Reason.MIRROR_CHECK_FAILED
    assert display.find_check_reason(MirrorCheck(0, 1.0), 1) is None


def test_a_hand_is_no_place_for_a_cross() -> None:
    bench = a_bench()
    navigating(bench)
    told = measured_bone()
    assert told.foreground is not None
    # All that was matched lies 20 mm before the bone.
    nearer = Rectifier(a_rig()).geometry
    depth_mm = nearer.focal_px * nearer.baseline_mm / told.foreground.measured.disparity_px
    hand = replace(told.foreground.measured, disparity_px=nearer.disparity_map_px(depth_mm - 20.0))
    bench.script.tracked = replace(told, foreground=replace(told.foreground, measured=hand))
    bench.frames()
    bench.do(CheckMirror())
    assert "mm apart" in bench.refused()


@pytest.mark.parametrize(
    ("eye", "eyes", "is_refused"),
    [("right", "left", True), ("right", "right", False), ("right", "both", False),
     ("camera", "left", False)],
)  # fmt: skip
def test_the_eye_that_looks_is_the_calibrated_one(tmp_path, eye, eyes, is_refused) -> None:
    path = tmp_path / "display.yml"
    write_display_model(path, a_model(viewing_eye=eye))
    content = {"display": {"model": str(path)}, "mirror": {"eyes": eyes}}
    given = parse(content, "x"), argparse.Namespace(allow_unaccepted=False)
    if is_refused:
        with pytest.raises(ConfigurationError, match="calibrated for the right eye"):
            _read_display(*given)
    else:
        assert _read_display(*given).eyes == eyes


@pytest.mark.parametrize("command", [CheckMirror(), NudgeCross(-3, 7), ConfirmCross()])
def test_the_commands_of_the_check_are_recorded(command) -> None:
    assert command_from_json(command_to_json(command)) == command
