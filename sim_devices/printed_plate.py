"""A plate of square markers as a printer really puts it on paper: drawing code of its own."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from navapp.geometry.transform import FloatArray
from sim_devices.sheet import PrintedSheet

# How the printer errs (standard deviations): stretch along and across, shear, a marker's place.
_STRETCH, _SHEAR, _MARKER_MM, _SPREAD_MM = 0.001, 0.0005, 0.02, 0.02
# A marker's errors move its edges by less than this.
_REACH_MM = 0.5
_PX_PER_MM, _N_SAMPLES = 20.0, 3


@dataclass(frozen=True, slots=True)
class PlateLayout:
    """Markers in rows and columns on one face."""

    dictionary: str
    ids: tuple[int, ...]  # row by row
    columns: int
    square_mm: float
    marker_mm: float

    @property
    def size_mm(self) -> tuple[float, float]:
        """Width and height of the paper."""
        return self.columns * self.square_mm, len(self.ids) // self.columns * self.square_mm


def print_plate(layout: PlateLayout, seed: int, errors: float = 1.0) -> PrintedSheet:
    """One face on paper, its frame in the middle; `errors` scales what the printer does wrong."""
    rng = np.random.default_rng([seed, *layout.ids])
    stretch_x, stretch_y = 1.0 + errors * _STRETCH * rng.standard_normal(2)
    shear = errors * _SHEAR * rng.standard_normal()
    spread_mm = errors * _SPREAD_MM * rng.standard_normal()
    width, height = layout.size_mm
    n = (round(height * _PX_PER_MM), round(width * _PX_PER_MM))
    steps = np.arange(_N_SAMPLES * n[1]) + 0.5, np.arange(_N_SAMPLES * n[0]) + 0.5
    across, down = (one / (_N_SAMPLES * _PX_PER_MM) for one in steps)
    across, down = across - 0.5 * width, down - 0.5 * height
    black = np.zeros((len(down), len(across)), dtype=bool)
    for number, place in enumerate(_corners_mm(layout)):
        off = place + errors * _MARKER_MM * rng.standard_normal(2)
        # Only the marker's own square is drawn: nothing is printed beyond it.
        part = tuple(
            slice(*np.searchsorted(steps, (one - _REACH_MM, one + layout.marker_mm + _REACH_MM)))
            for one, steps in zip(place[::-1], (down, across), strict=True)
        )
        x, y = np.meshgrid(across[part[1]], down[part[0]])
        x, y = (x - shear * y) / stretch_x - off[0], y / stretch_y - off[1]
        black[part] |= _draw_marker(layout, layout.ids[number], x, y, spread_mm)
    white = 1.0 - black.reshape(n[0], _N_SAMPLES, n[1], _N_SAMPLES).mean(axis=(1, 3))
    return PrintedSheet(
        np.rint(255.0 * white).astype(np.uint8), _PX_PER_MM, -0.5 * width, -0.5 * height
    )


def _corners_mm(layout: PlateLayout) -> FloatArray:
    """(markers, 2) upper left corners, from the paper's middle."""
    width, height = layout.size_mm
    margin_mm = 0.5 * (layout.square_mm - layout.marker_mm)
    row, column = np.divmod(np.arange(len(layout.ids)), layout.columns)
    corners: FloatArray = layout.square_mm * np.column_stack([column, row]) + margin_mm
    return corners - 0.5 * np.array([width, height])


def _draw_marker(
    layout: PlateLayout, number: int, x: FloatArray, y: FloatArray, spread_mm: float
) -> NDArray[np.bool_]:
    """Where a marker is black; ink spreads by `spread_mm` over every edge."""
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, layout.dictionary))
    n = dictionary.markerSize + 2
    ink = np.pad(np.asarray(dictionary.generateImageMarker(number, n)) == 0, 1)
    cell_mm = layout.marker_mm / n
    black = np.zeros(x.shape, dtype=bool)
    # The union of the pattern moved by the spread to all sides is the spread pattern.
    shifts = (-abs(spread_mm), abs(spread_mm)) if spread_mm != 0.0 else (0.0,)
    parts = [
        ink[
            np.clip(np.floor((y + dy) / cell_mm).astype(int) + 1, 0, n + 1),
            np.clip(np.floor((x + dx) / cell_mm).astype(int) + 1, 0, n + 1),
        ]
        for dx in shifts
        for dy in shifts
    ]
    black = np.logical_or.reduce(parts) if spread_mm >= 0.0 else np.logical_and.reduce(parts)
    return np.asarray(black)
