"""A tool before the simulated cameras: drawn where its pose says, hidden where it is hidden."""

import cv2
import numpy as np
import pytest
from numpy.typing import ArrayLike

from navapp.geometry.camera import Camera
from navapp.geometry.transform import FloatArray, RigidTransform, rotation_from_vector
from sim_devices.held_tool import Cover, ToolInView
from sim_devices.printed_plate import PlateLayout
from sim_devices.rigs import NO_TURN, Turn, make_default_rig
from sim_devices.sensor import Eye
from sim_devices.tool_shapes import ToolShape, make_tool

GROUND = np.float32(0.08)
LAYOUTS = (
    PlateLayout("DICT_4X4_100", (0, 1, 2, 3), 2, 20.0, 16.0),
    PlateLayout("DICT_4X4_100", (4, 5, 6, 7), 2, 20.0, 16.0),
)
RIG = make_default_rig()


class Room:
    rig = RIG

    def render(
        self,
        eye: str,
        time_ns: int,
        scale: float = 1.0,
        turn_rad: Turn = NO_TURN,
        rows: tuple[int, int] | None = None,
    ) -> np.ndarray:
        return np.full((720, 1280, 3), GROUND, np.float32)

    def path_px(self, from_ns: int, until_ns: int) -> float:
        return 0.25


def pose_of(
    turn_rad: ArrayLike = (0.0, 0.0, 0.0), place_mm: ArrayLike = (20.0, -5.0, 430.0)
) -> RigidTransform:
    return RigidTransform.from_parts("left", "tool", rotation_from_vector(turn_rad), place_mm)


@pytest.fixture(scope="module")
def shape() -> ToolShape:
    """Two faces, the second folded back by a right angle; nothing went wrong in making it."""
    second = np.eye(4)
    second[:3, :3] = rotation_from_vector((0.0, -0.5 * np.pi, 0.0))
    second[:3, 3] = (20.0, 0.0, 20.0)
    return make_tool("pointer", LAYOUTS, np.array([np.eye(4), second]), 1, errors=0.0)


def drawn(
    shape: ToolShape,
    pose: RigidTransform | None,
    eye: Eye = "left",
    cover: Cover | None = None,
    glare: float = 0.0,
) -> np.ndarray:
    scene = ToolInView(Room(), shape, lambda time_ns: pose, cover, glare)
    return scene.render(eye, 0)[:, :, 0]


def camera_of(eye: Eye, pose: RigidTransform) -> tuple[Camera, RigidTransform]:
    return (RIG.left, pose) if eye == "left" else (RIG.right, RIG.right_from_left @ pose)


def pixel_of(point_mm: FloatArray | tuple[float, ...], pose: RigidTransform) -> tuple[int, int]:
    """Row and column in the left picture."""
    x, y = np.rint(RIG.left.project(pose.apply(np.array(point_mm)[None]))[0]).astype(int)
    return int(y), int(x)


def markers_of(picture: np.ndarray) -> dict[int, FloatArray]:
    """Corners that OpenCV finds, by the marker's number."""
    settings = cv2.aruco.DetectorParameters()
    settings.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    settings.cornerRefinementWinSize = 3
    detector = cv2.aruco.ArucoDetector(
        cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_100), settings
    )
    grey = np.rint(400.0 * cv2.GaussianBlur(picture, (0, 0), 0.6)).clip(0, 255).astype(np.uint8)
    corners, ids, _ = detector.detectMarkers(grey)
    if ids is None:
        return {}
    return {int(n): np.reshape(c, (4, 2)) for n, c in zip(np.ravel(ids), corners, strict=True)}


@pytest.mark.parametrize("eye", ["left", "right"])
@pytest.mark.parametrize("turn_rad", [(0.0, 0.0, 0.0), (0.4, -0.3, 1.2)])
def test_markers_are_drawn_where_the_pose_says(
    eye: Eye, turn_rad: tuple[float, float, float], shape: ToolShape
) -> None:
    pose = pose_of(turn_rad)
    found = markers_of(drawn(shape, pose, eye))
    assert set(found) >= {0, 1, 2, 3}
    camera, in_eye = camera_of(eye, pose)
    for number in range(4):
        row, column = divmod(number, 2)
        corner = np.array([20.0 * column - 18.0, 20.0 * row - 18.0, 0.0])
        square = corner + 16.0 * np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
        np.testing.assert_allclose(found[number], camera.project(in_eye.apply(square)), atol=0.35)


def test_a_face_turned_away_is_not_seen_and_the_other_is(shape: ToolShape) -> None:
    pose = pose_of((0.0, 0.5 * np.pi + 0.3, 0.0))
    found = markers_of(drawn(shape, pose))
    assert set(found) == {4, 5, 6, 7}
    # The second face's first corner lies at the fold.
    corner = np.array([[20.0, -18.0, 2.0]])
    np.testing.assert_allclose(found[4][0], RIG.left.project(pose.apply(corner))[0], atol=0.25)


def test_from_behind_there_is_no_paper_only_the_shaft(shape: ToolShape) -> None:
    seen = drawn(shape, pose_of((0.0, np.pi + 0.4, 0.0)))
    assert markers_of(seen) == {}
    # Steel is never as bright as paper.
    assert seen.max() < 0.3
    assert (seen != GROUND).any()


def test_the_shaft_goes_from_the_tip_up_its_axis(shape: ToolShape) -> None:
    # Turned so that the shaft lies across the picture.
    pose = pose_of((-0.5 * np.pi, 0.0, 0.0), (0.0, -60.0, 430.0))
    seen = drawn(shape, pose)
    for mm in (5.0, 40.0, 80.0):
        assert seen[pixel_of(shape.tip_mm - mm * shape.axis, pose)] > GROUND + 0.05
    assert seen[pixel_of(shape.tip_mm + 3.0 * shape.axis, pose)] == GROUND


def test_the_cover_hides_one_side_of_the_first_face(shape: ToolShape) -> None:
    pose = pose_of((0.1, 0.2, 0.4))
    free = drawn(shape, pose)
    covered = drawn(shape, pose, cover=Cover(0.0, 0.0))
    # Its edge is wavy by a few millimetres and stands above the paper.
    for y in (-15.0, 0.0, 15.0):
        for x in (8.0, 15.0, 19.0):
            assert covered[pixel_of((x, y, 0.0), pose)] == pytest.approx(0.30, abs=1e-3)
        for x in (-19.0, -12.0, -6.0):
            place = pixel_of((x, y, 0.0), pose)
            assert covered[place] == free[place]
    assert set(markers_of(covered)) == {0, 2}


def test_the_cover_lies_towards_the_side_it_is_told(shape: ToolShape) -> None:
    pose = pose_of()
    for direction_rad, left in ((0.0, {0, 2}), (np.pi, {1, 3}), (0.5 * np.pi, {0, 1})):
        seen = markers_of(drawn(shape, pose, cover=Cover(direction_rad, 0.0)))
        assert set(seen) & {0, 1, 2, 3} == left


def test_the_cover_leaves_the_other_face_alone(shape: ToolShape) -> None:
    pose = pose_of((0.0, 0.8, 0.0))
    assert set(markers_of(drawn(shape, pose))) == set(range(8))
    assert set(markers_of(drawn(shape, pose, cover=Cover(np.pi, 0.0)))) == {1, 3, 4, 5, 6, 7}


def test_shine_adds_light_where_the_lamp_is_mirrored(shape: ToolShape) -> None:
    # The normal halfway between the line of sight and the way to the lamp.
    place = np.array([5.0, -10.0, 430.0])
    sight = place / np.linalg.norm(place)
    lamp = np.array([-0.45, -0.55, -0.70])
    normal = sight - lamp / np.linalg.norm(lamp)
    normal /= np.linalg.norm(normal)
    across = np.cross((0.0, 1.0, 0.0), normal)
    across /= np.linalg.norm(across)
    turn = np.column_stack([across, np.cross(normal, across), normal])
    pose = RigidTransform.from_parts("left", "tool", turn, place)
    matt, shining, brighter = (drawn(shape, pose, glare=glare) for glare in (0.0, 1.0, 2.0))
    added = shining - matt
    assert added.min() > -1e-6
    assert added[pixel_of((0.0, 0.0, 0.0), pose)] == pytest.approx(0.35, abs=0.01)
    np.testing.assert_allclose(brighter - matt, 2.0 * added, atol=1e-5)
    # Paper alone shines, and none of it when it is turned elsewhere.
    assert added[0, 0] == 0.0
    away = pose_of((0.0, -0.3, 0.0))
    assert np.abs(drawn(shape, away, glare=1.0) - drawn(shape, away)).max() < 0.01


def test_without_a_tool_the_room_is_as_it_was(shape: ToolShape) -> None:
    assert (drawn(shape, None) == GROUND).all()
    assert (drawn(shape, pose_of(place_mm=(2000.0, 0.0, 430.0))) == GROUND).all()


def test_what_is_behind_is_not_drawn_over_for_good(shape: ToolShape) -> None:
    """The room hands out the same picture every time; the tool is not left in it."""

    class Still(Room):
        picture = np.full((720, 1280, 3), GROUND, np.float32)

        def render(self, *how: object) -> np.ndarray:
            return self.picture

    scene = ToolInView(Still(), shape, lambda time_ns: pose_of())
    assert scene.render("left", 0).max() > 0.3
    assert (Still.picture == GROUND).all()


def test_a_tool_that_moves_is_told_with_what_is_behind_it(shape: ToolShape) -> None:
    def moving(time_ns: int) -> RigidTransform:
        return pose_of(place_mm=(20.0 + 1e-6 * time_ns, -5.0, 430.0))

    still = ToolInView(Room(), shape, lambda time_ns: pose_of())
    assert still.path_px(0, 1_000_000) == 0.25
    assert ToolInView(Room(), shape, lambda time_ns: None).path_px(0, 1_000_000) == 0.25
    path_px = ToolInView(Room(), shape, moving).path_px(0, 1_000_000)
    # 1 mm; the faces are up to some centimetres nearer or farther than the first one's origin.
    assert path_px == pytest.approx(RIG.left.focal_px / 430.0, rel=0.25)
