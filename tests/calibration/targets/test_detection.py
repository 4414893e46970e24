import cv2
import numpy as np
import pytest

from calibration.targets.boards import parse_board
from calibration.targets.detection import find_board
from navapp.geometry.camera import Camera
from tests.calibration.pictures import facing, picture_of
from tests.many import few_of

# The search for circles takes seconds to compile: all its tests run in one worker.
pytestmark = pytest.mark.xdist_group("boards")

CAMERA = Camera(
    np.array([[900.0, 0.0, 322.3], [0.0, 903.0, 236.8], [0.0, 0.0, 1.0]]),
    np.array([-0.1, 0.05, 0.0005, -0.0004]),
    640,
    480,
)
BOARDS = {
    "charuco": parse_board(
        {
            "type": "charuco", "squares_x": 8, "squares_y": 6, "square_mm": 20.0,
            "marker_mm": 14.0, "dictionary": "DICT_4X4_100",
        }
    ),
    "legacy": parse_board(
        {
            "type": "charuco", "squares_x": 8, "squares_y": 6, "square_mm": 20.0,
            "marker_mm": 14.0, "dictionary": "DICT_4X4_100", "legacy_pattern": True,
        }
    ),
    "chessboard": parse_board(
        {"type": "chessboard", "squares_x": 9, "squares_y": 6, "square_mm": 18.0}
    ),
    "circles": parse_board(
        {"type": "circles", "circles_x": 8, "circles_y": 5, "spacing_mm": 20.0}
    ),
    "circles_asymmetric": parse_board(
        {"type": "circles_asymmetric", "circles_x": 4, "circles_y": 9, "spacing_mm": 14.0}
    ),
}  # fmt: skip
TURNS = ((0.45, 0.1, -0.1), (0.0, 0.0, 0.05), (-0.2, -0.5, 0.2))


def seen_and_true(name, turn, **kwargs):
    board = BOARDS[name]
    pose = facing(board, 380.0, np.array(turn))
    seen = find_board(picture_of(board, CAMERA, pose, **kwargs), board)
    assert seen is not None
    return seen, CAMERA.project(pose.apply(board.points_mm[seen.ids]))


@pytest.mark.kernel
@pytest.mark.parametrize("turn", few_of(TURNS))
@pytest.mark.parametrize("name", BOARDS)
def test_every_mark_is_found_to_a_fiftieth_of_a_pixel(name, turn):
    seen, true_px = seen_and_true(name, turn)
    assert len(seen.ids) == len(BOARDS[name].points_mm)
    off_px = seen.pixels - true_px
    assert np.sqrt((off_px**2).mean()) < 0.02
    assert np.abs(off_px.mean(axis=0)).max() < 0.01


@pytest.mark.parametrize("name", few_of(["charuco", "circles"]))
def test_standard_errors_are_those_of_the_noise(name):
    ratios = []
    for seed in range(4):
        seen, true_px = seen_and_true(name, TURNS[1], noise=4.0, seed=seed)
        ratios.append((seen.pixels - true_px) / seen.sigma_px[:, None])
    assert 0.7 < np.sqrt(np.mean(np.square(ratios))) < 1.5


def test_blur_is_told():
    blurs = [seen_and_true("charuco", TURNS[0], blur_px=blur)[0].blur_px for blur in (0.6, 1.8)]
    # A pixel's own width adds 0.29 px.
    assert blurs == pytest.approx([np.hypot(0.6, 0.29), np.hypot(1.8, 0.29)], rel=0.1)


def test_a_part_of_a_charuco_board_is_enough():
    board, pose = BOARDS["charuco"], facing(BOARDS["charuco"], 380.0, np.array(TURNS[0]))
    picture = picture_of(board, CAMERA, pose)
    picture[:, 330:] = 90
    seen = find_board(picture, board)
    assert seen is not None
    assert 6 <= len(seen.ids) < len(board.points_mm)
    true_px = CAMERA.project(pose.apply(board.points_mm[seen.ids]))
    assert np.abs(seen.pixels - true_px).max() < 0.1


def test_a_chessboard_begins_at_its_black_square_however_it_is_held():
    board = BOARDS["chessboard"]
    for angle in (0.0, np.pi):
        pose = facing(board, 380.0, np.array([0.0, 0.0, angle]))
        seen = find_board(picture_of(board, CAMERA, pose), board)
        assert seen is not None
        true_px = CAMERA.project(pose.apply(board.points_mm))
        assert np.abs(seen.pixels - true_px).max() < 0.2


def test_corners_beyond_the_picture_are_no_answer_and_no_crash(monkeypatch):
    """OpenCV finds a part of a larger chessboard, and continues it as far as it was asked for."""
    board = BOARDS["chessboard"]
    picture = picture_of(board, CAMERA, facing(board, 380.0, np.array(TURNS[0])))
    corners = np.reshape(cv2.findChessboardCorners(picture, (8, 5))[1], (-1, 2))
    assert find_board(picture, board) is not None
    beyond = corners + np.array([0.0, 480.5 - corners[-1, 1]], np.float32)
    monkeypatch.setattr(cv2, "findChessboardCorners", lambda *_, **__: (True, beyond))
    assert find_board(picture, board) is None


def test_no_board_is_no_answer():
    noise = np.random.default_rng(1).integers(0, 255, (240, 320), dtype=np.uint8)
    for board in BOARDS.values():
        assert find_board(np.full((240, 320), 128, dtype=np.uint8), board) is None
        assert find_board(noise, board) is None
