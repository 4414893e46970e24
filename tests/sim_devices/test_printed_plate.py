"""A plate on paper: black where OpenCV's markers are black, and wrong as a printer is wrong."""

import cv2
import numpy as np
import pytest

from navapp.geometry.transform import FloatArray
from sim_devices import printed_plate
from sim_devices.printed_plate import PlateLayout, print_plate
from sim_devices.sheet import PrintedSheet

# Cells of 2 mm, which are whole pixels of the print.
LAYOUT = PlateLayout("DICT_4X4_100", (3, 4, 5, 6, 7, 8), 3, 15.0, 12.0)
CELL_PX, SQUARE_PX, MARGIN_PX = 40, 300, 30
ERRORS = ("_STRETCH", "_SHEAR", "_MARKER_MM", "_SPREAD_MM")


def design_of(layout: PlateLayout) -> np.ndarray:
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, layout.dictionary))
    rows = len(layout.ids) // layout.columns
    page = np.full((rows * SQUARE_PX, layout.columns * SQUARE_PX), 255, np.uint8)
    for place, number in enumerate(layout.ids):
        row, column = divmod(place, layout.columns)
        marker = dictionary.generateImageMarker(number, 6)
        top, left = SQUARE_PX * row + MARGIN_PX, SQUARE_PX * column + MARGIN_PX
        size = 6 * CELL_PX
        page[top : top + size, left : left + size] = np.kron(marker, np.ones((CELL_PX, CELL_PX)))
    return page


def only(name: str, size: float, monkeypatch: pytest.MonkeyPatch) -> PrintedSheet:
    """Printed with one kind of error alone."""
    for other in ERRORS:
        monkeypatch.setattr(printed_plate, other, size if other == name else 0.0)
    return print_plate(LAYOUT, 6)


def outer_edges(sheet: PrintedSheet, marker: int) -> FloatArray:
    """Left, top, right, bottom of a marker's border, mm from the paper's middle."""
    row, column = divmod(marker, LAYOUT.columns)
    part = (
        slice(SQUARE_PX * row, SQUARE_PX * (row + 1)),
        slice(SQUARE_PX * column, SQUARE_PX * (column + 1)),
    )
    black = 1.0 - sheet.white[part] / 255.0
    found = []
    for axis in (0, 1):
        # Over the middle of the border's first and last cell; the sum is how far black reaches.
        side = slice(MARGIN_PX + 10, MARGIN_PX + 30), slice(MARGIN_PX + 210, MARGIN_PX + 230)
        lines = [np.take(black, range(one.start, one.stop), axis=axis).mean(axis) for one in side]
        across = 0.5 * (lines[0] + lines[1])
        reach = [MARGIN_PX + 20 - across[: MARGIN_PX + 20].sum(), 0.0]
        reach[1] = MARGIN_PX + 220 + across[MARGIN_PX + 220 :].sum()
        found.append(np.array(reach) / sheet.px_per_mm)
    corner = np.array([15.0 * column - 22.5, 15.0 * row - 15.0])
    (left, right), (top, bottom) = found
    return np.asarray(np.array([left, top, right, bottom]) + np.tile(corner, 2))


DESIGNED_MM = np.array([outer_edges(print_plate(LAYOUT, 5, 0.0), marker) for marker in range(6)])


def test_without_errors_the_print_is_the_design() -> None:
    for seed in (1, 2):
        sheet = print_plate(LAYOUT, seed, errors=0.0)
        np.testing.assert_array_equal(sheet.white, design_of(LAYOUT))
    assert sheet.px_per_mm == 20.0
    assert (sheet.left_mm, sheet.top_mm) == (-22.5, -15.0)
    np.testing.assert_allclose(DESIGNED_MM[0], [-21.0, -13.5, -9.0, -1.5], atol=1e-9)
    np.testing.assert_allclose(DESIGNED_MM[5], [9.0, 1.5, 21.0, 13.5], atol=1e-9)


def test_a_stretched_print_is_larger_about_its_middle(monkeypatch: pytest.MonkeyPatch) -> None:
    sheet = only("_STRETCH", 0.01, monkeypatch)
    edges = np.array([outer_edges(sheet, marker) for marker in range(6)])
    x = np.polyfit(DESIGNED_MM[:, ::2].ravel(), edges[:, ::2].ravel(), 1)
    y = np.polyfit(DESIGNED_MM[:, 1::2].ravel(), edges[:, 1::2].ravel(), 1)
    # Along and across by shares of their own.
    assert 0.001 < abs(x[0] - 1.0) < 0.03
    assert 0.001 < abs(y[0] - 1.0) < 0.03
    assert abs(x[0] - y[0]) > 0.001
    for fit, axis in ((x, 0), (y, 1)):
        fitted = np.polyval(fit, DESIGNED_MM[:, axis::2])
        np.testing.assert_allclose(edges[:, axis::2], fitted, atol=0.01)
        assert fit[1] == pytest.approx(0.0, abs=0.005)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_ink_that_spreads_moves_every_edge_outwards(
    sign: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    sheet = only("_SPREAD_MM", sign * 0.1, monkeypatch)
    edges = np.array([outer_edges(sheet, marker) for marker in range(6)])
    outwards = (edges - DESIGNED_MM) * [-1.0, -1.0, 1.0, 1.0]
    assert 0.01 < abs(outwards.mean()) < 0.4
    np.testing.assert_allclose(outwards, outwards.mean(), atol=0.01)


@pytest.mark.release
def test_ink_that_spreads_covers_white_inside_of_markers(monkeypatch: pytest.MonkeyPatch) -> None:
    grey = {
        sign: only("_SPREAD_MM", sign * 0.1, monkeypatch).white.mean() for sign in (1.0, 0.0, -1.0)
    }
    first = only("_SPREAD_MM", 0.1, monkeypatch)
    # Which of both signs spreads the ink is the seed's.
    spreads = outer_edges(first, 0)[0] < DESIGNED_MM[0, 0]
    darker, lighter = (grey[1.0], grey[-1.0]) if spreads else (grey[-1.0], grey[1.0])
    assert darker < grey[0.0] - 1.0
    assert lighter > grey[0.0] + 1.0


def test_a_sheared_print_leans(monkeypatch: pytest.MonkeyPatch) -> None:
    sheet = only("_SHEAR", 0.01, monkeypatch)
    moved = np.array([outer_edges(sheet, marker) for marker in range(6)]) - DESIGNED_MM
    # What lies above goes to one side, what lies below to the other; up and down stays.
    upper, lower = moved[:3, ::2].mean(), moved[3:, ::2].mean()
    assert abs(upper) > 0.01
    assert upper == pytest.approx(-lower, abs=0.01)
    np.testing.assert_allclose(moved[:, 1::2], 0.0, atol=0.01)


def test_every_marker_has_a_shift_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    sheet = only("_MARKER_MM", 0.1, monkeypatch)
    moved = np.array([outer_edges(sheet, marker) for marker in range(6)]) - DESIGNED_MM
    # As a whole: both edges by the same.
    np.testing.assert_allclose(moved[:, :2], moved[:, 2:], atol=0.01)
    assert len(np.unique(np.round(moved[:, :2], 2), axis=0)) == 6
    assert 0.03 < moved[:, :2].std() < 0.3


def test_another_seed_errs_otherwise_and_the_same_the_same() -> None:
    first = print_plate(LAYOUT, 1).white
    np.testing.assert_array_equal(first, print_plate(LAYOUT, 1).white)
    assert not np.array_equal(first, print_plate(LAYOUT, 2).white)
