"""Pictures without highlights: what is mirrored is gone, and clipped specks cost little."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.box import Box
from navapp.geometry.rectification import RectifiedPair
from navapp.stereo import refine_on_model
from navapp.stereo.matte_pictures import find_clipped, find_near_clipped, make_matte_pair
from tests.stereo.pairs import HEIGHT, WIDTH, shifted_pair

BOX = Box(60, 20, 220, 80)
DISPARITY_PX = 20.3
ASKED = np.ones((BOX.height, BOX.width), dtype=bool)
SUPPORT_PX = np.full(ASKED.shape, DISPARITY_PX, dtype=np.float32)


def bone_pair() -> RectifiedPair:
    """Red twice as bright as blue, both with the same texture."""
    grey = shifted_pair(np.full((HEIGHT, WIDTH), DISPARITY_PX), BOX)
    return replace(grey, left=coloured(grey.left), right=coloured(grey.right))


def coloured(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    red = 60.0 + 0.6 * picture
    return np.stack([0.5 * red, 0.8 * red, red], axis=2).astype(np.uint8)


def with_specks(picture: NDArray[np.uint8], seed: int) -> NDArray[np.uint8]:
    """Clipped in specks that each eye sees elsewhere."""
    rng = np.random.default_rng(seed)
    speckled = picture.copy()
    for y, x in zip(rng.integers(10, 105, 110), rng.integers(5, 310, 110), strict=True):
        speckled[y : y + 2, x : x + 2] = 255
    return speckled


def test_light_of_the_lamp_leaves_no_trace() -> None:
    pair = bone_pair()
    matte = make_matte_pair(pair, ASKED)
    assert matte is not None
    linear = ((pair.left / 255.0 + 0.055) / 1.055) ** 2.4
    glossy = 1.055 * (linear + 0.1) ** (1.0 / 2.4) - 0.055
    shone = replace(pair, left=np.rint(255.0 * glossy).astype(np.uint8))
    assert not find_clipped(shone.left).any()
    without = make_matte_pair(shone, ASKED)
    assert without is not None
    off = np.abs(without.left[BOX.slices].astype(float) - matte.left[BOX.slices])
    assert off.mean() < 0.03 * matte.left[BOX.slices].mean()


def test_clipped_specks_cost_little_of_what_is_answered() -> None:
    pair = bone_pair()
    clean = make_matte_pair(pair, ASKED)
    speckled = replace(pair, left=with_specks(pair.left, 1), right=with_specks(pair.right, 2))
    matte = make_matte_pair(speckled, ASKED)
    assert clean is not None
    assert matte is not None
    expected, found = refine_on_model(clean, SUPPORT_PX), refine_on_model(matte, SUPPORT_PX)
    least = 0.9 * expected.n_matched
    assert found.n_matched > least
    off_px = (found.disparity_px - expected.disparity_px)[found.origin > 0]
    assert abs(np.nanmedian(off_px)) < 0.02
    # Black specks, as red less blue has them where both are clipped, cost more.
    black = replace(
        clean,
        left=np.where(find_clipped(speckled.left), 0, clean.left).astype(np.uint8),
        right=np.where(find_clipped(speckled.right), 0, clean.right).astype(np.uint8),
    )
    assert refine_on_model(black, SUPPORT_PX).n_matched < least


def test_grey_pictures_have_no_colour_to_go_by() -> None:
    grey = shifted_pair(np.full((HEIGHT, WIDTH), DISPARITY_PX), BOX)
    assert make_matte_pair(grey, ASKED) is None


def test_pixels_near_clipped_ones_are_those_whose_window_holds_one() -> None:
    picture = np.full((40, 60), 250, dtype=np.uint8)
    assert not find_near_clipped(picture, 6).any()
    picture[20, 30] = 255
    expected = np.zeros(picture.shape, dtype=np.bool_)
    expected[14:27, 24:37] = True
    np.testing.assert_array_equal(find_near_clipped(picture, 6), expected)
