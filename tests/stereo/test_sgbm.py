import numpy as np
import pytest

from navapp.geometry.rectification import Box
from navapp.stereo import SgbmSettings, match_sgbm
from navapp.stereo.sgbm import disparity_window
from navapp.values import Origin
from tests.stereo.pairs import HEIGHT, WIDTH, shifted_pair

WHOLE = Box(0, 0, WIDTH, HEIGHT)
INNER = Box(90, 20, 180, 80)


def constant(value: float) -> np.ndarray:
    return np.full((HEIGHT, WIDTH), value)


def error_px(found, truth, box: Box) -> np.ndarray:
    inside = truth[box.y : box.y + box.height, box.x : box.x + box.width]
    return (found.disparity_px - inside)[found.origin == Origin.MATCHED]


@pytest.mark.parametrize("is_colour", [False, True])
@pytest.mark.parametrize(("disparity", "median_px"), [(20.0, 0.05), (33.4, 0.25), (20.5, 0.25)])
def test_a_constant_shift_is_found_within_the_matchers_staircase(
    disparity, median_px, is_colour
) -> None:
    truth = constant(disparity)
    found = match_sgbm(shifted_pair(truth, INNER, is_colour=is_colour), (10.0, 50.0))
    assert found.disparity_px.shape == (INNER.height, INNER.width)
    assert (found.x, found.y) == (INNER.x, INNER.y)
    assert found.matched_share > 0.97
    error = np.abs(error_px(found, truth, INNER))
    assert np.median(error) <= median_px
    assert np.percentile(error, 99) < 0.6


def test_a_slant_is_followed_within_its_claimed_sigma() -> None:
    truth = np.broadcast_to(25.0 + 0.06 * np.arange(WIDTH), (HEIGHT, WIDTH)).copy()
    found = match_sgbm(shifted_pair(truth, INNER), (15.0, 60.0))
    error = error_px(found, truth, INNER)
    assert found.matched_share > 0.95
    assert abs(np.median(error)) < 0.1
    assert np.sqrt(np.mean(error**2)) < SgbmSettings().sigma_px
    assert (found.sigma_px[found.origin == Origin.MATCHED] == np.float32(0.25)).all()


@pytest.mark.parametrize("band", [(28.0, 32.0), (0.0, 31.0), (29.5, 90.0), (-20.0, 40.0)])
def test_the_answer_does_not_depend_on_where_the_band_begins(band) -> None:
    truth = constant(30.0)
    found = match_sgbm(shifted_pair(truth, INNER), band)
    assert found.matched_share > 0.97
    assert np.percentile(np.abs(error_px(found, truth, INNER)), 98) < 0.5


def test_the_strip_that_the_right_camera_does_not_see_stays_unknown() -> None:
    truth = constant(30.0)
    found = match_sgbm(shifted_pair(truth, WHOLE), (10.0, 50.0))
    is_matched = found.origin[:, :28] == Origin.MATCHED
    # What chance finds there has at least a partner inside the right picture.
    assert is_matched.mean() < 0.05
    assert (np.isnan(found.disparity_px[:, :28]) == ~is_matched).all()
    columns = np.arange(WIDTH)[None, :]
    assert not (columns - found.disparity_px < 0.0).any()
    # No column is lost beside it.
    assert (found.origin[:, 34:300] == Origin.MATCHED).mean() > 0.97


def test_nothing_outside_the_window_is_claimed() -> None:
    found = match_sgbm(shifted_pair(constant(70.0), INNER), (10.0, 30.0))
    matched = found.disparity_px[found.origin == Origin.MATCHED]
    lowest, count = disparity_window((10.0, 30.0))
    assert matched.min() > lowest
    assert matched.max() < lowest + count - 1


def test_a_surface_just_beyond_the_window_is_not_claimed_at_its_end() -> None:
    lowest, count = disparity_window((10.0, 22.0))
    beyond = float(lowest + count + 1)
    found = match_sgbm(shifted_pair(constant(beyond), INNER), (10.0, 22.0))
    assert found.matched_share < 0.3


@pytest.mark.parametrize(
    "box", [Box(-20, -10, 150, 60), Box(250, 80, 100, 60), Box(-5, -5, 400, 200)]
)
def test_pixels_of_a_box_beyond_the_picture_stay_unknown(box) -> None:
    truth = constant(20.0)
    found = match_sgbm(shifted_pair(truth, box), (10.0, 40.0))
    assert found.disparity_px.shape == (box.height, box.width)
    rows = np.arange(box.y, box.y + box.height)[:, None]
    columns = np.arange(box.x, box.x + box.width)[None, :]
    is_inside = (rows >= 0) & (rows < HEIGHT) & (columns >= 0) & (columns < WIDTH)
    assert (found.origin[~is_inside] == Origin.UNKNOWN).all()
    is_safe = is_inside & (columns > 26) & (columns < WIDTH - 6)
    assert (found.origin[is_safe] == Origin.MATCHED).mean() > 0.95
    error = np.abs(found.disparity_px[is_safe & (found.origin == Origin.MATCHED)] - 20.0)
    assert np.percentile(error, 99) < 0.5


@pytest.mark.parametrize("box", [Box(10, 10, 0, 20), Box(10, 10, 20, 0), Box(WIDTH, 0, 0, 0)])
def test_an_empty_box_gives_an_empty_map(box) -> None:
    found = match_sgbm(shifted_pair(constant(20.0), box), (10.0, 40.0))
    assert found.disparity_px.shape == (box.height, box.width)
    assert found.matched_share == 0.0


@pytest.mark.parametrize("grey", [0, 255])
def test_pictures_without_contrast_match_nowhere(grey) -> None:
    pair = shifted_pair(constant(20.0), INNER)
    pair.left[:], pair.right[:] = grey, grey
    assert match_sgbm(pair, (10.0, 40.0)).matched_share == 0.0


@pytest.mark.parametrize(
    ("band", "lowest", "count"),
    [
        ((10.0, 23.0), 9, 16),
        ((10.0, 23.5), 9, 32),
        ((10.9, 11.0), 9, 16),
        ((-3.5, 60.0), -5, 80),
    ],
)
def test_the_window_holds_the_band_in_blocks_of_sixteen(band, lowest, count) -> None:
    assert disparity_window(band) == (lowest, count)
    assert lowest + 1 <= band[0]
    assert lowest + count - 2 >= band[1]


@pytest.mark.parametrize("band", [(5.0, 5.0), (6.0, 5.0), (np.nan, 5.0), (1.0, np.inf)])
def test_a_band_that_is_none_is_refused(band) -> None:
    with pytest.raises(ValueError, match="band"):
        disparity_window(band)
