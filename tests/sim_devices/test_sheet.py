"""A printed sheet in front of the simulated cameras: every mark where optics put it."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from calibration.targets.boards import parse_board
from calibration.targets.detection import find_board
from calibration.targets.drawing import make_drawing, rasterise
from navapp.geometry.transform import RigidTransform, rotation_from_vector
from sim_devices.rigs import make_default_rig
from sim_devices.sensor import SensorModel
from sim_devices.sheet import PrintedSheet, SheetInView, SheetScene
from sim_devices.sheet_kernels import draw_sheet
from tests.many import few_rows_of
from tests.reference.sheet_reference import sheet_reference

BOARD = parse_board(
    {
        "type": "charuco", "squares_x": 8, "squares_y": 6, "square_mm": 20.0,
        "marker_mm": 14.0, "dictionary": "DICT_4X4_100",
    }
)  # fmt: skip
MARGIN_MM = 8.0


def plain_picture(radiance: np.ndarray) -> np.ndarray:
    """A lens that blurs a little and a linear sensor without noise."""
    light = cv2.GaussianBlur(radiance[:, :, 0], (0, 0), 0.5)
    return np.rint(20.0 + 380.0 * light).clip(0, 255).astype(np.uint8)


def simulated_picture(radiance: np.ndarray) -> np.ndarray:
    """The simulated sensor with its tone curve, without noise."""
    sensor = replace(SensorModel(is_grey=True), full_well_e=1e12, read_noise_e=0.0)
    return sensor.picture(radiance, "left", 0)


def off_px(eye: str, pose: RigidTransform, take) -> np.ndarray:
    """(n, 2) marks found less marks projected by the rig."""
    seen = find_board(take(SheetScene(sheet_of(), lambda time_ns: pose).render(eye, 0)), BOARD)
    assert seen is not None
    assert len(seen.ids) == len(BOARD.points_mm)
    rig = make_default_rig()
    camera, in_camera = rig.left, pose
    if eye == "right":
        camera, in_camera = rig.right, rig.right_from_left @ pose
    return seen.pixels - camera.project(in_camera.apply(BOARD.points_mm[seen.ids]))


def sheet_of(board=BOARD, px_per_mm: float = 12.0) -> PrintedSheet:
    drawing = make_drawing(board)
    white = rasterise(drawing, px_per_mm, MARGIN_MM)
    left_mm, top_mm = drawing.low_mm - MARGIN_MM
    return PrintedSheet(white, px_per_mm, float(left_mm), float(top_mm))


def held(distance_mm: float, turn_rad: tuple[float, float, float]) -> RigidTransform:
    rotation = rotation_from_vector(turn_rad)
    place = np.array([35.0, 5.0, distance_mm]) - rotation @ BOARD.points_mm.mean(axis=0)
    return RigidTransform.from_parts("left", "sheet", rotation, place)


@pytest.mark.parametrize("eye", ["left", "right"])
@pytest.mark.parametrize(
    ("distance_mm", "turn_rad"),
    few_rows_of([(450.0, (0.0, 0.0, 0.05)), (360.0, (0.5, 0.2, -0.2)), (510.0, (-0.3, -0.4, 1.5))]),
)
def test_every_corner_is_where_the_optics_put_it(eye, distance_mm, turn_rad):
    pose = held(distance_mm, turn_rad)
    assert np.linalg.norm(off_px(eye, pose, plain_picture), axis=1).max() < 0.02
    # A tone curve makes dark squares smaller, not elsewhere; sharp pictures feel it a little.
    assert np.sqrt((off_px(eye, pose, simulated_picture) ** 2).mean()) < 0.02


@pytest.mark.kernel
def test_the_kernel_does_what_its_reference_does():
    rng = np.random.default_rng(3)
    y, x = np.mgrid[0:41, 0:61]
    rays = np.dstack([(x - 30) / 50.0 + 0.02 * (y / 40.0) ** 2, (y - 20) / 50.0])
    homography = np.array([[30.0, 4.0, 9.0], [-3.0, 28.0, 11.0], [0.2, -0.3, 1.0]])
    texture = rng.random((24, 32)).astype(np.float32)
    picture = np.zeros((40, 60), np.float32)
    draw_sheet(rays, homography, texture, 2, 0.1, 0.8, np.array([0, 40, 0, 60]), picture)
    expected = sheet_reference(rays, homography, texture, 2, 0.1, 0.8)
    assert np.abs(picture - expected).max() < 1e-5
    assert np.ptp(picture) > 0.3


def test_only_the_box_is_drawn_and_it_holds_the_whole_sheet():
    pose = held(400.0, (0.3, -0.4, 0.8))
    scene = SheetScene(sheet_of(px_per_mm=4.0), lambda time_ns: pose)
    picture = scene.render("left", 0)
    ground = picture[0, 0, 0]
    rows, columns = np.nonzero(picture[:, :, 0] != ground)
    corners = make_default_rig().left.project(pose.apply(sheet_of(px_per_mm=4.0).corners_mm))
    corners = np.clip(corners, 0, (1279, 719))
    assert columns.min() == pytest.approx(corners[:, 0].min(), abs=2.5)
    assert columns.max() == pytest.approx(corners[:, 0].max(), abs=2.5)
    assert rows.min() == pytest.approx(corners[:, 1].min(), abs=2.5)
    assert rows.max() == pytest.approx(corners[:, 1].max(), abs=2.5)


def test_nothing_is_printed_on_the_back_and_nothing_is_seen_behind_the_cameras():
    scene = SheetScene(sheet_of(px_per_mm=4.0), lambda time_ns: held(450.0, (0.0, np.pi, 0.0)))
    back = scene.render("left", 0)
    assert len(np.unique(np.round(back, 4))) < 40
    assert back.max() > 5 * back.min()
    behind = SheetScene(sheet_of(px_per_mm=4.0), lambda time_ns: held(-450.0, (0.0, 0.0, 0.0)))
    assert np.ptp(behind.render("left", 0)) == 0.0


def test_a_sheet_is_a_grey_picture_with_a_size():
    with pytest.raises(ValueError, match="grey picture"):
        PrintedSheet(np.zeros((4, 4, 3), np.uint8), 4.0, 0.0, 0.0)
    with pytest.raises(ValueError, match="grey picture"):
        PrintedSheet(np.zeros((4, 4), np.uint8), 0.0, 0.0, 0.0)


def test_a_sheet_hides_what_is_behind_it_while_it_is_held() -> None:
    class Bright:
        rig = make_default_rig()

        def render(self, eye, time_ns, *how) -> np.ndarray:
            return np.full((720, 1280, 3), 0.77, np.float32)

    pose = held(450.0, (0.1, 0.2, 0.0))
    scene = SheetInView(Bright(), sheet_of(), lambda time_ns: pose, (10, 20))
    alone = SheetScene(sheet_of(), lambda time_ns: pose).render("right", 0)
    for time_ns in (9, 20):
        assert (scene.render("right", time_ns) == np.float32(0.77)).all()
    shown = scene.render("right", 10)
    is_behind = shown == np.float32(0.77)
    assert 0.05 < np.mean(~is_behind) < 0.5
    assert np.array_equal(shown[~is_behind], alone[~is_behind])
    # Where the sheet ends is no more than a pixel's work.
    beside = cv2.erode(is_behind[:, :, 0].astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
    assert (alone[beside] == np.float32(0.08)).all()


def test_a_sheet_that_moves_is_told_with_what_is_behind_it() -> None:
    class Slow:
        rig = make_default_rig()

        def path_px(self, from_ns: int, until_ns: int) -> float:
            return 0.25

    def moving(time_ns: int) -> RigidTransform:
        return RigidTransform.from_parts("left", "sheet", np.eye(3), (1e-6 * time_ns, 0.0, 450.0))

    expected_px = Slow.rig.left.focal_px / 450.0
    sheet = SheetScene(sheet_of(), moving)
    assert sheet.path_px(0, 1_000_000) == pytest.approx(expected_px)
    moves = SheetInView(Slow(), sheet_of(), moving, (0, 20))
    assert moves.path_px(0, 1_000_000) == pytest.approx(expected_px)
    assert SheetInView(Slow(), sheet_of(), lambda t: moving(0), (0, 20)).path_px(0, 9) == 0.25
