import numpy as np
import pytest

from navapp.stereo.health_kernels import measure_rows
from tests.reference.health_reference import row_offset
from tests.stereo.pairs import texture

PLACE = (60, 20)
LAYOUT = (9, 3)


def scene(seed: int):
    """A left picture, one lowered by 0.3 px and seen 20 px to the left, and a map with holes."""
    rng = np.random.default_rng(seed)
    left = texture(160, 90, seed)
    right = 0.7 * np.roll(left, 1, axis=0) + 0.3 * left
    pictures = [
        (values + rng.normal(0.0, 2.0, values.shape)).clip(0, 255).astype(np.uint8)
        for values in (left, 1.1 * np.roll(right, -20, axis=1))
    ]
    disparity = (20.0 + rng.uniform(-0.4, 0.4, (45, 60))).astype(np.float32)
    origin = (rng.random(disparity.shape) < 0.7).astype(np.uint8)
    return *pictures, disparity, origin


@pytest.mark.kernel
@pytest.mark.parametrize("row_shift_px", [0.0, 0.4, -1.3])
def test_every_window_is_solved_as_by_numpy(row_shift_px: float) -> None:
    left, right, disparity, origin = scene(4)
    stride, radius = LAYOUT
    found = np.empty((100, 5))
    n = measure_rows(left, right, disparity, origin, PLACE, LAYOUT, row_shift_px, found)
    expected = []
    for v in range(radius, 45 - radius, stride):
        for u in range(radius, 60 - radius, stride):
            one = row_offset(
                left, right, disparity, origin == 1, PLACE, (v, u), radius, row_shift_px
            )
            if one[3] >= 0.5:
                expected.append((*one[:3], PLACE[0] + u, PLACE[1] + v))
    assert n == len(expected) > 15
    np.testing.assert_allclose(found[:n], expected, rtol=1e-6, atol=1e-9)


def test_what_was_not_matched_does_not_count() -> None:
    left, right, disparity, origin = scene(4)
    found = np.empty((100, 5))
    for other in (0, 2, 3):
        kinds = np.full_like(origin, other)
        assert measure_rows(left, right, disparity, kinds, PLACE, LAYOUT, 0.0, found) == 0


def test_no_more_are_answered_than_there_is_room_for() -> None:
    left, right, disparity, origin = scene(4)
    found = np.full((6, 5), -7.0)
    assert measure_rows(left, right, disparity, origin, PLACE, LAYOUT, 0.0, found[:5]) == 5
    assert (found[5] == -7.0).all()


@pytest.mark.parametrize("level", [0, 90])
def test_windows_without_texture_answer_nothing(level: int) -> None:
    _, _, disparity, origin = scene(4)
    flat = np.full((90, 160), level, np.uint8)
    found = np.empty((100, 5))
    assert measure_rows(flat, flat, disparity, origin, PLACE, LAYOUT, 0.0, found) == 0


@pytest.mark.parametrize("place", [(0, 0), (110, 50), (-5, -5), (15, 20)])
def test_windows_at_the_pictures_edge_are_left_out(place: tuple[int, int]) -> None:
    left, right, disparity, origin = scene(4)
    found = np.empty((100, 5))
    for row_shift_px in (0.0, 2.5, -2.5):
        n = measure_rows(left, right, disparity, origin, place, LAYOUT, row_shift_px, found)
        assert n < 30
        assert np.isfinite(found[:n]).all()
