"""Highlights: where the pictures differ by more than a shift explains."""

from dataclasses import replace

import numpy as np

from navapp.geometry.box import Box
from navapp.geometry.rectification import RectifiedPair
from navapp.stereo.subpixel.highlights import without_highlights
from tests.stereo.pairs import HEIGHT, WIDTH, shifted_pair

Y, X = np.mgrid[:HEIGHT, :WIDTH].astype(float)
BOX = Box(80, 8, 200, 104)
TRUTH = 30.0 + 0.06 * X + 0.04 * Y
SUPPORT = TRUTH[BOX.y : BOX.y + BOX.height, BOX.x : BOX.x + BOX.width].astype(np.float32)


def lit(picture: np.ndarray, x: float, y: float) -> np.ndarray:
    """With a highlight of about 10 px there."""
    light = 90.0 * np.exp(-((X - x) ** 2 + (Y - y) ** 2) / (2.0 * 5.0**2))
    return np.clip(picture + light, 0, 255).astype(np.uint8)


def pair(x: float = 180.0, y: float = 60.0, wanders_px: float | None = None) -> RectifiedPair:
    """A slanted surface, half as contrasty as others; a highlight that wanders over it, or none."""
    found = shifted_pair(TRUTH, BOX)
    left, right = (64 + picture // 2 for picture in (found.left, found.right))
    if wanders_px is not None:
        faced = x - TRUTH[int(y), int(x)]
        left, right = lit(left, x, y), lit(right, faced + wanders_px, y)
    return replace(found, left=left, right=right)


def test_without_a_highlight_all_of_the_support_stays() -> None:
    assert np.isfinite(without_highlights(pair(), SUPPORT)).all()


def test_what_wanders_over_the_surface_is_left_out_and_the_rest_stays() -> None:
    answered = np.isfinite(without_highlights(pair(wanders_px=8.0), SUPPORT))
    rows, columns = np.mgrid[: BOX.height, : BOX.width]
    distance = np.hypot(columns + BOX.x - 180, rows + BOX.y - 60)
    # Half way between the two pictures' highlights, both are equally bright.
    assert answered[distance < 6.0].mean() < 0.3
    assert answered[distance > 30.0].all()


def test_a_bright_spot_of_the_surface_itself_stays() -> None:
    assert np.isfinite(without_highlights(pair(wanders_px=0.0), SUPPORT)).mean() > 0.99


def test_gain_and_offset_of_a_camera_are_no_highlight() -> None:
    found = pair()
    brighter = replace(found, right=(20.0 + 0.8 * found.right).astype(np.uint8))
    assert np.isfinite(without_highlights(brighter, SUPPORT)).all()


def test_a_support_that_is_half_a_pixel_off_is_no_highlight() -> None:
    assert np.isfinite(without_highlights(pair(), SUPPORT + np.float32(0.5))).mean() > 0.97


def test_unknown_stays_unknown_also_everywhere() -> None:
    nothing = np.full_like(SUPPORT, np.nan)
    assert np.isnan(without_highlights(pair(), nothing)).all()
    half = SUPPORT.copy()
    half[:, :50] = np.nan
    np.testing.assert_array_equal(without_highlights(pair(), half), half)
