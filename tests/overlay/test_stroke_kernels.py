"""The compiled line beside a plain one."""

from itertools import pairwise

import numpy as np
import pytest

from navapp.overlay.stroke_kernels import Ground, Room, blend_places, trace_lines, weigh

HEIGHT, WIDTH, X, Y = 40, 60, 100, 50
ONE = np.float32(1.0)
BENEATH = np.float32(0.5)


def ground(weight: float = 1.0, nearest_mm: float = np.nan, size: int = 200) -> Ground:
    shape = (size, size)
    return Ground(
        0, 0, np.full(shape, weight, np.float32), np.full(shape, nearest_mm, np.float32),
        np.zeros(shape, bool), ONE, BENEATH, BENEATH,
    )  # fmt: skip


def room(height: int = Y + HEIGHT, width: int = X + WIDTH, n: int = 50_000) -> Room:
    line, rim = np.zeros((2, height, width), np.float32)
    touched = np.empty((2, line.size), np.int32)
    place, number = np.empty((2, n), np.int32)
    return Room(line, rim, touched, place, np.empty(n, np.float32), number)


def trace(
    pixels: np.ndarray, given: Ground, depth_mm: float = 100.0, half_px: float = 1.0,
    rim_px: float = 0.0,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """What is drawn of a picture with `X` columns and `Y` rows before the part that is returned."""
    given_room, firsts = room(), np.array([0, len(pixels)])
    depths = np.full(len(pixels), depth_mm)
    pens = np.array([half_px]), np.array([rim_px])
    n = trace_lines(pixels, depths, firsts, np.array([False]), *pens, given, given_room)
    assert not given_room.line.any()
    assert not given_room.rim.any()
    found = []
    for number in (0, -1):
        of = given_room.number[:n] == number
        share = np.zeros((Y + HEIGHT, X + WIDTH), np.float32)
        share.ravel()[given_room.place[:n][of]] = given_room.share[:n][of]
        assert len(np.unique(given_room.place[:n][of])) == of.sum()
        found.append(share[Y:, X:])
    return found[0], found[1]


def covered(pixels: np.ndarray, half_px: float) -> np.ndarray:
    """One less the distance from the line's edge, by the plain formula for each pixel."""
    rows, columns = np.mgrid[Y : Y + HEIGHT, X : X + WIDTH]
    places = np.stack([columns, rows], axis=-1).astype(float)
    off = np.full(rows.shape, np.inf)
    for start, end in pairwise(pixels):
        along = ((places - start) @ (end - start)) / max(
            float((end - start) @ (end - start)), 1e-12
        )
        foot = start + np.clip(along, 0.0, 1.0)[..., None] * (end - start)
        off = np.minimum(off, np.linalg.norm(places - foot, axis=-1))
    return np.clip(half_px + 0.5 - off, 0.0, 1.0)


LINE = np.array([[103.2, 55.7], [120.0, 71.3], [155.9, 66.0], [155.9, 52.25]])


@pytest.mark.kernel
@pytest.mark.parametrize("half_px", [0.5, 1.0, 2.0])
def test_a_whole_line_covers_what_lies_near_it(half_px: float) -> None:
    line, _ = trace(LINE, ground(), half_px=half_px)
    np.testing.assert_allclose(line, covered(LINE, half_px), atol=1e-5)


@pytest.mark.kernel
def test_a_rim_is_wider_and_only_on_top() -> None:
    _, rim = trace(LINE, ground(), rim_px=1.5)
    np.testing.assert_allclose(rim, covered(LINE, 2.5), atol=1e-5)
    line, rim = trace(LINE, ground(weight=0.5), rim_px=1.5)
    assert line.any()
    assert not rim.any()


@pytest.mark.kernel
def test_beneath_it_is_dashed_and_hidden_it_is_left_out() -> None:
    straight = np.array([[102.0, 60.0], [158.0, 60.0]])
    for given, depth_mm in ((ground(weight=0.5), 100.0), (ground(nearest_mm=90.0), 100.0)):
        line, _ = trace(straight, given, depth_mm)
        assert 7 / 12 - 0.12 < line[10, 3:57].mean() < 7 / 12 + 0.2
        assert line[10, 3:57].min() == 0.0
    assert trace(straight, ground(nearest_mm=90.0), 90.5)[0][10, 3:57].min() == 1.0
    assert not trace(straight, ground(weight=0.2))[0].any()


@pytest.mark.kernel
def test_unknown_points_part_a_line() -> None:
    parted = np.insert(LINE, 2, np.nan, axis=0)
    line, _ = trace(parted, ground())
    expected = np.maximum(covered(LINE[:2], 1.0), covered(LINE[2:], 1.0))
    np.testing.assert_allclose(line, expected, atol=1e-5)


@pytest.mark.kernel
def test_a_point_beyond_the_ground_weighs_what_is_told_of_there() -> None:
    given = ground(size=20)
    assert weigh(19.4, 3.0, 5.0, given) == 1.0
    for u, v in ((19.6, 3.0), (-0.6, 3.0), (3.0, 40.0)):
        assert weigh(u, v, 5.0, given) == BENEATH


@pytest.mark.kernel
def test_strokes_are_traced_one_after_the_other_each_with_its_pen() -> None:
    both, firsts = np.concatenate([LINE, LINE[::-1] + 3.0]), np.array([0, 4, 8])
    given = room()
    n = trace_lines(
        both,
        np.full(8, 50.0),
        firsts,
        np.zeros(2, bool),
        np.array([0.5, 1.5]),
        np.array([0.0, 1.0]),
        ground(),
        given,
    )
    order = given.number[:n]
    # The first stroke, the second one's rim, then the second one.
    assert list(order[np.flatnonzero(np.diff(order, prepend=9))]) == [0, -1, 1]
    for number, line, half_px in ((0, LINE, 0.5), (-1, LINE + 3.0, 2.5), (1, LINE + 3.0, 1.5)):
        share = np.zeros(given.line.shape)
        share.ravel()[given.place[:n][order == number]] = given.share[:n][order == number]
        np.testing.assert_allclose(share[Y:, X:], covered(line, half_px), atol=1e-5)


@pytest.mark.kernel
@pytest.mark.parametrize(("weight", "is_drawn"), [(1.0, True), (0.2, False)])
def test_a_whole_stroke_is_as_its_first_point(weight: float, is_drawn: bool) -> None:
    """The ground hides all but the left part, or only that."""
    given = ground()
    given.weight[:, :110] = weight
    given.weight[:, 110:] = 0.2 if is_drawn else 1.0
    line, given_room = np.array([[104.0, 60.0], [150.0, 60.0]]), room()
    n = trace_lines(
        line, np.full(2, 50.0), np.array([0, 2]), np.array([True]), np.array([1.0]),
        np.array([0.0]), given, given_room,
    )  # fmt: skip
    share = np.zeros(given_room.line.shape)
    share.ravel()[given_room.place[:n]] = given_room.share[:n]
    assert (share[60, 104:151].min() == 1.0) == is_drawn
    assert share.any() == is_drawn


@pytest.mark.kernel
def test_what_stands_in_front_hides_parts_of_a_whole_stroke() -> None:
    given, given_room = ground(), room()
    given.is_hidden[:, 130:] = True
    line = np.array([[104.0, 60.0], [150.0, 60.0]])
    n = trace_lines(
        line, np.full(2, 50.0), np.array([0, 2]), np.array([True]), np.array([1.0]),
        np.array([0.0]), given, given_room,
    )  # fmt: skip
    columns = given_room.place[:n] % given_room.line.shape[1]
    assert 128 <= columns.max() <= 132


@pytest.mark.kernel
@pytest.mark.parametrize(("hidden_from", "reach"), [(109, 8), (102, 0)])
def test_all_arms_end_as_near_as_the_one_of_which_least_is_seen(hidden_from, reach) -> None:
    given, given_room, middle = ground(), room(), np.array([100.0, 60.0])
    given.is_hidden[:, hidden_from:] = True
    ways = np.array([[1.0, 0], [-1, 0], [0, 1], [0, -1]])
    arms = [np.vstack([middle, middle + 20.0 * way, [[np.nan] * 2]]) for way in ways]
    points = np.concatenate(arms)
    n = trace_lines(
        points, np.full(12, 50.0), np.array([0, 12]), np.array([True]), np.array([1.0]),
        np.array([0.0]), given, given_room,
    )  # fmt: skip
    assert (n > 0) == (reach > 0)
    if n:
        rows, columns = np.divmod(given_room.place[:n], given_room.line.shape[1])
        light = given_room.share[:n]
        centre = np.array([(columns * light).sum(), (rows * light).sum()]) / light.sum()
        np.testing.assert_allclose(centre, middle, atol=0.05)
        assert abs(columns - 100).max() == pytest.approx(reach + 1, abs=1)


@pytest.mark.kernel
def test_what_does_not_fit_into_the_room_is_left_out_and_leaves_no_trace() -> None:
    given = room(n=40)
    n = trace_lines(
        LINE,
        np.full(4, 50.0),
        np.array([0, 4]),
        np.array([False]),
        np.array([1.0]),
        np.array([1.0]),
        ground(),
        given,
    )
    assert n == 40
    assert not given.line.any()
    assert not given.rim.any()


@pytest.mark.kernel
def test_places_are_blended_in_their_order_and_no_others() -> None:
    rng = np.random.default_rng(5)
    before = rng.integers(0, 256, (6, 7, 3), dtype=np.uint8)
    place = np.array([3, 8, 40, 8], np.int32)
    share = rng.random(4).astype(np.float32)
    number = np.array([-1, 0, 1, 1], np.int32)
    colours = np.array([[10.0, 200.0, 250.0], [90.0, 5.0, 160.0]], np.float32)
    image = before.copy()
    blend_places(image.reshape(-1, 3), place, share, number, colours)
    expected = before.astype(float).reshape(-1, 3)
    for k, one, which in zip(place, share, number, strict=True):
        colour = colours[which] if which >= 0 else np.zeros(3)
        expected[k] += one * (colour - expected[k])
    np.testing.assert_allclose(image.reshape(-1, 3), expected, atol=1.01)
