"""The compiled line beside a plain one."""

from itertools import pairwise

import numpy as np
import pytest

from navapp.overlay.stroke_kernels import Ground, Pen, blend_touched, trace_line, weigh

HEIGHT, WIDTH, X, Y = 40, 60, 100, 50
ONE = np.float32(1.0)
BENEATH = np.float32(0.5)


def ground(weight: float = 1.0, nearest_mm: float = np.nan, size: int = 200) -> Ground:
    shape = (size, size)
    return Ground(
        0, 0, np.full(shape, weight, np.float32), np.full(shape, nearest_mm, np.float32), ONE,
        BENEATH, BENEATH,
    )  # fmt: skip


def trace(
    pixels: np.ndarray, given: Ground, depth_mm: float = 100.0, half_px: float = 1.0,
    rim_px: float = 0.0,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """What is drawn of a picture with `X` columns and `Y` rows before the part that is returned."""
    line, rim = np.zeros((2, Y + HEIGHT, X + WIDTH), np.float32)
    touched = np.empty((2, line.size), np.int32)
    pen = Pen(*(np.float32(n) for n in (half_px, rim_px, 7.0, 5.0)))
    n = trace_line(pixels, np.full(len(pixels), depth_mm), given, pen, line, rim, touched)
    for share, places, count in zip((line, rim), touched, n, strict=True):
        assert sorted(places[:count]) == list(np.flatnonzero(share))
    return line[Y:, X:], rim[Y:, X:]


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
def test_touched_pixels_are_blended_and_no_others() -> None:
    rng = np.random.default_rng(5)
    before = rng.integers(0, 256, (6, 7, 3), dtype=np.uint8)
    share = rng.random((6, 7)).astype(np.float32)
    touched = np.array([3, 8, 40], np.int32)
    part = share.ravel()[touched, None]
    image = before.copy()
    blend_touched(image, share, touched, (10, 200, 250))
    expected = before.astype(float)
    flat = expected.reshape(-1, 3)
    flat[touched] += part * (np.array([10.0, 200.0, 250.0]) - flat[touched])
    np.testing.assert_allclose(image, expected, atol=0.51)
    assert not share.ravel()[touched].any()
