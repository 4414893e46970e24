"""Lines by what covers them."""

import numpy as np
import pytest

from navapp.overlay.drawing import Drawing
from navapp.overlay.scene import Scene
from navapp.overlay.strokes import sample_line, thin_line
from tests.overlay.scenes import (
    BEHIND,
    CAMERA,
    MESH,
    POSE,
    TARGET,
    Occluder,
    black,
    change,
    is_colour,
    painted,
    pixels_of,
    scene,
    seen,
    video,
)

COLOUR = (10, 200, 250)
# On the bowl, through its middle.
X = np.linspace(-40.0, 40.0, 81)
ON_BONE = np.column_stack([X, np.zeros(81), 0.008 * X * X])


@pytest.mark.parametrize("straight_mm", [0.02, 0.3])
def test_of_a_curve_only_the_points_are_kept_that_it_needs(straight_mm: float) -> None:
    angles = np.linspace(0.0, 1.5 * np.pi, 400)
    curve = np.column_stack([20.0 * np.cos(angles), 20.0 * np.sin(angles), 3.0 * angles])
    thinned = thin_line(curve, straight_mm)
    np.testing.assert_array_equal(thinned[[0, -1]], curve[[0, -1]])
    dense = sample_line(thinned, 0.02)
    off_mm = np.linalg.norm(curve[:, None] - dense, axis=2).min(axis=1)
    assert 0.2 * straight_mm < off_mm.max() < straight_mm + 0.005
    assert len(thinned) < 80
    # A corner stays, of a line that is straight beside it the ends alone.
    corner = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 1, 0], [2, 2, 0], [2, 0.5, 0]])
    np.testing.assert_array_equal(thin_line(corner), corner[[0, 2, 4, 5]])


def draw_lines(
    image: np.ndarray, given: Scene, lines_mm: list[np.ndarray], width_px: float = 2.0,
    colour=COLOUR,
) -> None:  # fmt: skip
    drawing = Drawing()
    drawing.lines(lines_mm, colour, width_px)
    painted(given, drawing, image)


def draw_line(image: np.ndarray, given: Scene, points_mm: np.ndarray, *pen) -> None:
    draw_lines(image, given, [points_mm], *pen)


def drawn_at(image: np.ndarray, points_mm: np.ndarray) -> np.ndarray:
    u, v = pixels_of(points_mm).T
    return is_colour(image, COLOUR)[v, u]


def test_a_sampled_line_keeps_its_corners_and_leaves_no_gap() -> None:
    corners = np.array([[0.0, 0, 0], [10.0, 0, 0], [10.0, 0.4, 0], [10.0, 0.4, -7.3]])
    points = sample_line(corners, 1.0)
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    assert steps.max() <= 1.0 + 1e-9
    assert steps.sum() == pytest.approx(10.0 + 0.4 + 7.3)
    for corner in corners:
        assert np.linalg.norm(points - corner, axis=1).min() < 1e-12
    np.testing.assert_array_equal(sample_line(corners[:1]), corners[:1])


def test_a_line_on_a_bone_that_is_seen_is_whole() -> None:
    image = black()
    draw_line(image, seen(scene()), ON_BONE)
    # Places between two pixels are lit by a part.
    assert drawn_at(image, ON_BONE).mean() > 0.93


def test_a_line_of_which_nothing_is_known_is_dashed() -> None:
    image = black()
    draw_line(image, scene(), ON_BONE)
    # Dashes of 7 px and gaps of 5 px, less the ends of a line two pixels wide.
    assert 0.5 < drawn_at(image, ON_BONE).mean() < 0.85


def test_a_line_is_dashed_behind_the_bone_and_whole_beside_it() -> None:
    image, given = black(), seen(scene())
    draw_line(image, given, BEHIND)
    fine = sample_line(BEHIND, 0.5)
    hidden = behind_bone(fine)
    on_line = drawn_at(image, fine)
    assert 0.5 < on_line[hidden].mean() < 0.85
    assert on_line[~hidden & near_box(fine)].mean() > 0.95


def behind_bone(points_mm: np.ndarray) -> np.ndarray:
    given = scene()
    u, v = pixels_of(points_mm).T - np.array([[given.box.x], [given.box.y]])
    there = np.zeros(len(u), dtype=bool)
    inside = (u >= 0) & (v >= 0) & (u < given.box.width) & (v < given.box.height)
    there[inside] = np.isfinite(given.bone_mm[v[inside], u[inside]])
    return there


def near_box(points_mm: np.ndarray) -> np.ndarray:
    """Where the depth is known: over the scene's box, not at its rim."""
    box = scene().box
    u, v = pixels_of(points_mm).T
    return (u > box.x + 8) & (u < box.x + box.width - 8) & (v > box.y) & (v < box.y + box.height)


def test_a_line_before_the_bone_is_whole() -> None:
    before = BEHIND * (0.4, 1.0, 1.0) - (0.0, 0.0, 90.0)
    image = black()
    draw_line(image, seen(scene()), before)
    assert drawn_at(image, before).all()


def test_a_hand_leaves_nothing_of_a_line() -> None:
    image = black()
    draw_line(image, seen(scene(), occluder=Occluder(325.0)), ON_BONE)
    assert image[:, :320].any()
    assert not image[:, 329:].any()


@pytest.mark.parametrize("width_px", [1, 2])
def test_a_line_lies_at_parts_of_a_pixel(width_px: int) -> None:
    """The centre of what is lit follows the line, not the grid."""
    given = seen(scene())
    axes = given.picture_axes_in_bone
    for part in (0.0, 0.3, 0.6):
        start = TARGET + part * 400.0 / 705.0 * axes[1] - (0.0, 0.0, 20.0)
        line = start + np.linspace(-10.0, 10.0, 21)[:, None] * axes[0]
        image = black()
        draw_line(image, given, line, width_px, (255, 255, 255))
        middle = CAMERA.project(POSE.apply(line[10:11]))[0]
        column = image[:, round(middle[0]), 0].astype(float)
        centre = (np.arange(len(column)) * column).sum() / column.sum()
        assert abs(centre - middle[1]) < 0.15


def test_a_dashed_line_is_still_seen() -> None:
    before, image = video(), video()
    draw_line(image, scene(), ON_BONE, 1)
    assert (change(before, image) > 3).sum() > 50


def draw_cross(given: Scene, point_mm: np.ndarray, half_mm: float = 5.0) -> np.ndarray:
    drawing = Drawing()
    drawing.cross(point_mm, given.picture_axes_in_bone, half_mm, COLOUR)
    return painted(given, drawing)


def test_a_cross_has_its_middle_at_its_point() -> None:
    given, point = seen(scene()), TARGET - (0.0, 0.0, 10.0)
    lit = is_colour(draw_cross(given, point), COLOUR)
    (u, v), reach = pixels_of(point)[0], round(4.0 * 700 / 400)
    assert lit[v, u - reach : u + reach + 1].all()
    assert lit[v - reach : v + reach + 1, u].all()
    assert not lit[v + 4, u + 4]


@pytest.mark.parametrize("nearer_mm", [0.0, 3.5])
def test_a_cross_is_judged_at_its_point_and_its_light_lies_around_it(nearer_mm: float) -> None:
    """Its arms reach into the bowl's flank: what lies beneath would be cut off them."""
    occluder = Occluder(nearer_mm=nearer_mm) if nearer_mm else None
    given, point = seen(scene(), occluder=occluder), np.array([-25.0, 5.0, 0.008 * 25.0**2])
    image = draw_cross(given, point, 8.0)[..., 1].astype(float)
    v, u = np.mgrid[: image.shape[0], : image.shape[1]]
    light = np.array([(u * image).sum(), (v * image).sum()]) / image.sum()
    expected = CAMERA.project(POSE.apply(point[None]))[0]
    np.testing.assert_allclose(light, expected, atol=0.3)
    lit_px = (image > 0).sum()
    whole_px = (draw_cross(seen(scene()), point, 8.0)[..., 1] > 0).sum()
    assert (lit_px < 0.9 * whole_px) == (nearer_mm > 0.0)


def test_a_cross_whose_point_is_hidden_is_left_out() -> None:
    given = seen(scene(), occluder=Occluder(325.0))
    hidden = np.array([20.0, 5.0, 0.008 * 20.0**2])
    assert pixels_of(hidden)[0][0] > 330
    assert not draw_cross(given, hidden, 40.0).any()


@pytest.mark.parametrize("depth_mm", [-20.0, 0.0, 1e-5, 1e-3, 0.1])
def test_points_beside_and_behind_the_lens_are_left_out(depth_mm: float) -> None:
    near = np.array([[80.0, 5.0, depth_mm], [-90.0, 7.0, depth_mm]])
    image = black()
    draw_line(image, scene(), POSE.inverse().apply(near))
    assert not image.any()


def test_one_point_is_no_line() -> None:
    image = black()
    draw_line(image, seen(scene()), MESH.vertices_mm[:1])
    assert not image.any()
