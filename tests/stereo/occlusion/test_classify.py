"""Classes of unmatched pixels, in both views."""

import numpy as np
import pytest

from navapp.stereo.occlusion.classify import classify, project_to_right
from navapp.values import DisparityMap, Origin
from tests.reference.occlusion_reference import classes_reference, seen_from_right_reference

pytestmark = pytest.mark.kernel

HEIGHT, WIDTH = 50, 160
NEAR = 30.0
# Nothing is withdrawn for its looks.
BLANK = np.full((HEIGHT, WIDTH), 60, dtype=np.uint8)
# The square in the left view, and in the right one.
ROWS, LEFT_COLUMNS, RIGHT_COLUMNS = slice(12, 40), slice(80, 115), slice(50, 85)


def as_map(disparity: np.ndarray, x: int = 0) -> DisparityMap:
    disparity = np.asarray(disparity, dtype=np.float32)
    known = np.isfinite(disparity)
    return DisparityMap(
        disparity,
        np.where(known, 0.25, np.nan).astype(np.float32),
        np.where(known, Origin.MATCHED, Origin.UNKNOWN).astype(np.uint8),
        x,
        3,
    )


def mirrored(disparity_map: DisparityMap, picture_width: int) -> DisparityMap:
    """The map seen in a mirror; a mirrored right view obeys the rules of a left one.

    To treat the right view, mirror its map and flip its picture; the left view's disparity,
    flipped, takes the part of `right_px`, with `picture_width - x - width` as its first column.
    Mirroring twice gives the map back.
    """
    width = disparity_map.disparity_px.shape[1]
    return DisparityMap(
        np.ascontiguousarray(disparity_map.disparity_px[:, ::-1]),
        np.ascontiguousarray(disparity_map.sigma_px[:, ::-1]),
        np.ascontiguousarray(disparity_map.origin[:, ::-1]),
        picture_width - disparity_map.x - width,
        disparity_map.y,
    )


def true_views() -> tuple[np.ndarray, np.ndarray]:
    """True disparity of a near square before a slanted wall, in the left and the right view."""
    rows, columns = np.mgrid[:HEIGHT, :WIDTH].astype(float)
    left = 12.0 + 0.04 * columns + 0.02 * rows
    # Right column u shows the wall's left column x with u = x - d(x).
    right = (columns + 12.0 + 0.02 * rows) / 0.96 - columns
    left[ROWS, LEFT_COLUMNS] = NEAR
    right[ROWS, RIGHT_COLUMNS] = NEAR
    return left, right


def hidden_places() -> tuple[np.ndarray, np.ndarray]:
    """Wall pixels whose place in the other view is taken by the square."""
    left, right = true_views()
    columns = np.arange(WIDTH)
    in_rows = np.zeros((HEIGHT, 1), dtype=bool)
    in_rows[ROWS] = True
    partner = columns - left
    of_left = in_rows & (left != NEAR) & (partner > 49.5) & (partner < 84.5)
    partner = columns + right
    of_right = in_rows & (right != NEAR) & (partner > 79.5) & (partner < 114.5)
    return of_left, of_right


def found_views() -> tuple[np.ndarray, np.ndarray]:
    """What a perfect matcher finds: nothing where the other view shows something else."""
    left, right = true_views()
    of_left, of_right = hidden_places()
    columns = np.arange(WIDTH)
    left = np.where(of_left | (columns - left < 0), np.nan, left)
    right = np.where(of_right | (columns + right > WIDTH - 1), np.nan, right)
    return left, right


def right_view_as_seen() -> np.ndarray:
    """An unchecked right view: it has an answer everywhere."""
    return true_views()[1].astype(np.float32)


def test_the_strip_that_the_right_camera_does_not_see_is_a_border_occlusion() -> None:
    left, _ = found_views()
    classes = classify(as_map(left), right_view_as_seen(), 0, WIDTH, BLANK)
    is_strip = np.arange(WIDTH) - true_views()[0] < 0
    # The agreed end of a slanted strip is good to a pixel.
    assert (classes == Origin.FILLED_BORDER)[is_strip].mean() > 0.97
    assert (classes == Origin.FILLED_BORDER)[~is_strip].mean() < 0.001


def test_what_the_square_hides_is_an_interior_occlusion() -> None:
    left, _ = found_views()
    hidden, _ = hidden_places()
    assert hidden.sum() > 200
    classes = classify(as_map(left), right_view_as_seen(), 0, WIDTH, BLANK)
    is_interior = classes == Origin.FILLED_INTERIOR
    # A pixel at either end may still be within reach of a right pixel.
    assert is_interior[hidden].mean() > 0.9
    assert not is_interior[~hidden].any()


def test_matches_stand() -> None:
    left, _ = found_views()
    classes = classify(as_map(left), right_view_as_seen(), 0, WIDTH, BLANK)
    inside = np.isfinite(left) & (np.arange(WIDTH) > 20)
    assert (classes[inside] == 0).all()


def test_the_rest_is_a_mismatch() -> None:
    left, _ = found_views()
    left[20:24, 130:136] = np.nan
    classes = classify(as_map(left), right_view_as_seen(), 0, WIDTH, BLANK)
    assert (classes[20:24, 130:136] == Origin.MISMATCH_FILLED).all()


@pytest.mark.parametrize(
    ("on_left", "on_right", "expected"),
    [(20.0, 30.0, Origin.FILLED_INTERIOR), (30.0, 20.0, Origin.MISMATCH_FILLED)],
)
def test_only_left_of_something_nearer_is_an_interior_occlusion(
    on_left: float, on_right: float, expected: Origin
) -> None:
    line = np.full((5, 60), on_left)
    line[:, 30:] = on_right
    line[:, 25:30] = np.nan
    nobody = np.full((5, 60), np.nan, dtype=np.float32)
    classes = classify(as_map(line, x=60), nobody, 60, 200, BLANK[:5, :60])
    assert (classes[:, 25:30] == expected).all()


def test_accidental_matches_in_the_strip_are_withdrawn() -> None:
    left, _ = found_views()
    left[30:33, 4:8] = 3.0
    classes = classify(as_map(left), right_view_as_seen(), 0, WIDTH, BLANK)
    assert (classes[30:33, 4:8] == Origin.FILLED_BORDER).all()


def test_a_box_inside_the_picture_has_no_border_strip() -> None:
    left, _ = found_views()
    box = as_map(left[:, 30:], x=30)
    box.disparity_px[:, :10] = np.nan
    box.origin[:, :10] = Origin.UNKNOWN
    classes = classify(box, right_view_as_seen(), 0, WIDTH, BLANK[:, 30:])
    assert not (classes == Origin.FILLED_BORDER).any()
    assert (classes[:10, :10] != 0).all()


@pytest.mark.parametrize("first", [0, 10])
def test_boxes_of_both_views_meet_where_their_columns_say(first: int) -> None:
    left, _ = found_views()
    whole = classify(as_map(left), right_view_as_seen(), 0, WIDTH, BLANK)
    part, right_part = as_map(left[:, 40:], x=40), right_view_as_seen()[:, first:]
    box = classify(part, right_part, first, WIDTH, BLANK[:, 40:])
    np.testing.assert_array_equal(box, whole[:, 40:])


def test_the_mirrored_right_view_obeys_the_same_rules() -> None:
    _, right = found_views()
    left_as_seen = true_views()[0].astype(np.float32)
    _, hidden = hidden_places()
    view = mirrored(as_map(right), WIDTH)
    classes = classify(view, left_as_seen[:, ::-1], 0, WIDTH, BLANK)[:, ::-1]
    is_strip = np.arange(WIDTH) + true_views()[1] > WIDTH - 1
    assert (classes == Origin.FILLED_BORDER)[is_strip].mean() > 0.9
    assert (classes == Origin.FILLED_INTERIOR)[hidden].mean() > 0.9
    # The square hides what is right of it in the right view, left of it in the left one.
    assert np.nonzero(classes == Origin.FILLED_INTERIOR)[1].min() >= RIGHT_COLUMNS.stop - 1


def test_a_map_without_matches_is_all_unmatched() -> None:
    nothing = np.full((8, 20), np.nan, dtype=np.float32)
    classes = classify(as_map(nothing), nothing, 0, 20, BLANK[:8, :20])
    assert (classes == Origin.MISMATCH_FILLED).all()


def test_what_lies_outside_the_picture_has_no_class() -> None:
    nothing = np.full((8, 40), np.nan)
    nobody = np.empty((8, 0), dtype=np.float32)
    classes = classify(as_map(nothing, x=-10), nobody, 0, 20, BLANK[:8, :40])
    assert (classes[:, :10] == 0).all()
    assert (classes[:, 10:30] != 0).all()
    assert (classes[:, 30:] == 0).all()


def test_views_of_different_rows_are_refused() -> None:
    left, _ = found_views()
    with pytest.raises(ValueError, match="same rows"):
        classify(as_map(left), right_view_as_seen()[1:], 0, WIDTH, BLANK)


def test_a_picture_of_another_size_is_refused() -> None:
    left, _ = found_views()
    with pytest.raises(ValueError, match="grey picture of the map's size"):
        classify(as_map(left), right_view_as_seen(), 0, WIDTH, BLANK[:, 1:])


def edge_that_hangs_over() -> tuple[DisparityMap, np.ndarray]:
    """Matches of something nearer from column 30 on, which is seen from column 32 on only."""
    line = np.full((5, 60), 20.0)
    line[:, 30:] = 30.0
    line[:, 22:30] = np.nan
    picture = np.full(line.shape, 60, dtype=np.uint8)
    picture[:, 32:] = 90
    return as_map(line, x=60), picture


def test_matches_that_look_like_what_is_behind_the_edge_are_interior_occlusions() -> None:
    found, picture = edge_that_hangs_over()
    nobody = np.full((5, 60), np.nan, dtype=np.float32)
    classes = classify(found, nobody, 60, 200, picture)
    assert (classes[:, 22:32] == Origin.FILLED_INTERIOR).all()
    assert not classes[:, :22].any()
    assert not classes[:, 32:].any()
    # Neither when both look alike, nor where what is on the right is farther.
    picture[:, 32:] = 66
    assert not classify(found, nobody, 60, 200, picture)[:, 30:].any()
    found, picture = edge_that_hangs_over()
    found.disparity_px[:, 30:] = 10.0
    assert not classify(found, nobody, 60, 200, picture)[:, 30:].any()


def test_something_narrower_than_the_overhang_keeps_its_matches() -> None:
    found, picture = edge_that_hangs_over()
    nobody = np.full((5, 60), np.nan, dtype=np.float32)
    # Nothing is matched beyond it, or something farther is.
    found.origin[:, 33] = Origin.UNKNOWN
    assert not classify(found, nobody, 60, 200, picture)[:, 30:33].any()
    found, picture = edge_that_hangs_over()
    found.disparity_px[:, 33:] = 20.0
    assert not classify(found, nobody, 60, 200, picture)[:, 30:].any()


@pytest.mark.parametrize("seed", range(8))
def test_edges_near_the_sides_of_a_map_are_those_of_the_reference(seed: int) -> None:
    """Jumps and grey levels that just suffice, in maps of a few columns."""
    rng = np.random.default_rng(seed)
    nobody = np.full((40, 26), np.nan, dtype=np.float32)
    for width in range(1, 26):
        behind, edge = rng.integers(0, width + 1, (2, 40, 1))
        columns = np.arange(width)
        left = np.where(columns < edge, 20.0, 20.0 + rng.choice([1.9375, 2.0, 9.0], (40, 1)))
        left[rng.random(left.shape) < 0.1] = np.nan
        picture = np.where(columns < behind, 60, 60 + rng.choice([10, 11, 90], (40, 1)))
        found = as_map(left, x=60)
        classes = classify(found, nobody[:, :width], 60, 200, picture.astype(np.uint8))
        given = found.disparity_px, found.is_matched, 60, nobody[:, :width].astype(float), 60
        np.testing.assert_array_equal(classes, classes_reference(*given, picture.astype(np.uint8)))


@pytest.mark.parametrize("seed", range(6))
def test_classes_are_those_of_the_reference(seed: int) -> None:
    rng = np.random.default_rng(seed)
    left = np.repeat(rng.integers(5, 25, (12, 10)), 8, axis=1) + rng.normal(0.0, 0.2, (12, 80))
    # Fewer and fewer matches to the left, where the right camera sees nothing.
    left[rng.random(left.shape) < np.linspace(0.6, 0.05, 80)] = np.nan
    right = np.where(rng.random((12, 70)) < 0.3, np.nan, rng.uniform(5.0, 25.0, (12, 70)))
    right, x0, right_x0 = right.astype(np.float32), (0, 6)[seed % 2], (0, -9)[seed // 2 % 2]
    found = as_map(left, x=x0)
    # What looks alike begins two columns right of what is matched alike; some like neither side.
    picture = np.roll(np.repeat(rng.integers(40, 200, (12, 10)), 8, axis=1), 2, axis=1)
    picture = np.where(rng.random(picture.shape) < 0.2, 255, picture).astype(np.uint8)
    classes = classify(found, right, right_x0, 200, picture)
    given = found.disparity_px, found.is_matched, x0, right.astype(float), right_x0
    np.testing.assert_array_equal(classes, classes_reference(*given, picture))
    assert (classes != classes_reference(*given, np.zeros_like(picture))).sum() > 5
    assert len(np.unique(classes)) == 4


@pytest.mark.parametrize("left_x", [0, 37, 150, -20])
def test_what_the_right_camera_sees_is_what_the_reference_says(left_x: int) -> None:
    rng = np.random.default_rng(7)
    rough = rng.uniform(0.0, 60.0, (9, 70))
    smooth = 20.0 + 0.3 * np.arange(70) + rng.normal(0.0, 0.05, (9, 70))
    whole = rng.integers(5, 25, (9, 70)).astype(float)
    for surface in (rough, smooth, whole, 0.5 + whole):
        left = np.where(rng.random(surface.shape) < 0.2, np.nan, surface).astype(np.float32)
        found = project_to_right(left, left_x, 130)
        assert found.shape == (9, 130)
        assert found.dtype == np.float32
        np.testing.assert_array_equal(found, seen_from_right_reference(left, left_x, 130))


def test_the_right_camera_sees_the_square_where_it_stands_and_the_wall_beside_it() -> None:
    left, right = true_views()
    found = project_to_right(left.astype(np.float32), 0, WIDTH)
    assert (found[ROWS, RIGHT_COLUMNS] == NEAR).all()
    is_square = np.zeros(found.shape, dtype=bool)
    is_square[ROWS, RIGHT_COLUMNS] = True
    is_wall = np.isfinite(found) & ~is_square
    # A place is off by up to half a pixel, a slanted wall's disparity by as little.
    np.testing.assert_allclose(found[is_wall], right[is_wall], atol=0.03)
    # Unknown is what the left camera does not see: behind the square, and right of its picture. A
    # wall that comes nearer on the right has no other gaps: in the right picture it is narrower.
    _, hidden = hidden_places()
    unknown = hidden | (np.arange(WIDTH) + right > WIDTH)
    assert np.isnan(found[hidden]).mean() > 0.95
    assert np.isfinite(found[~unknown]).mean() > 0.95


def test_where_two_surfaces_fall_on_one_place_the_nearer_is_seen() -> None:
    line = np.full((1, 40), np.nan, dtype=np.float32)
    line[0, [8, 10, 25]] = (3.0, 5.0, 20.0)
    found = project_to_right(line, 0, 40)
    assert found[0, 5] == 20.0
    assert np.isfinite(found).sum() == 1


def test_a_box_of_the_surface_falls_where_its_columns_say() -> None:
    left = true_views()[0].astype(np.float32)
    whole, box = project_to_right(left, 0, WIDTH), project_to_right(left[:, 60:], 60, WIDTH)
    known = np.isfinite(box)
    assert known.sum() > 0.5 * box.size
    # Without the pixels left of the box something farther may be seen, never something nearer.
    assert (whole[known] >= box[known]).all()
    np.testing.assert_array_equal(box[:, 60:], whole[:, 60:])


def test_without_a_surface_the_right_camera_sees_nothing() -> None:
    nothing = np.full((6, 30), np.nan, dtype=np.float32)
    assert np.isnan(project_to_right(nothing, 0, 40)).all()
    # Everything falls left of the right picture.
    assert np.isnan(project_to_right(np.full((6, 30), 99.0, dtype=np.float32), 0, 40)).all()
    assert project_to_right(np.empty((6, 0), dtype=np.float32), 0, 40).shape == (6, 40)
