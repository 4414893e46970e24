"""A drawn plate: what is printed is read by OpenCV, marker by marker, where the plate has it."""

import cv2
import numpy as np
import pytest

from calibration.targets.drawing import rasterise
from calibration.targets.plate_drawing import draw_plate
from navapp.geometry.transform import FloatArray
from navapp.tools.plate import Plate

PX_PER_MM, MARGIN_MM = 10.0, 6.0
PLATES = {
    "one face": Plate(),
    "a row": Plate("DICT_6X6_50", 4, 3, 1, 18.0, 13.0),
    "three faces": Plate(first_id=20, columns=2, rows=2, faces=3, fold_deg=50.0),
}


def read_by_opencv(plate: Plate) -> dict[int, FloatArray]:
    """(4, 2) corners in mm from the drawing's origin, by the marker's number."""
    picture = rasterise(draw_plate(plate), PX_PER_MM, MARGIN_MM)
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, plate.dictionary))
    corners, ids, _ = cv2.aruco.ArucoDetector(dictionary).detectMarkers(picture)
    assert ids is not None
    # A pixel's centre lies half a pixel inside.
    return {
        int(number): (np.reshape(corner, (4, 2)).astype(np.float64) + 0.5) / PX_PER_MM - MARGIN_MM
        for number, corner in zip(np.ravel(ids), corners, strict=True)
    }


@pytest.mark.parametrize("name", PLATES)
def test_every_marker_is_read_where_it_should_be(name: str) -> None:
    plate = PLATES[name]
    found = read_by_opencv(plate)
    assert sorted(found) == list(plate.ids)
    per_face = plate.columns * plate.rows
    for number, corners in found.items():
        face, place = divmod(number - plate.first_id, per_face)
        row, column = divmod(place, plate.columns)
        across = face * plate.columns + column
        corner = plate.margin_mm + plate.square_mm * np.array([across, row])
        square = plate.marker_mm * np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
        np.testing.assert_allclose(corners, corner + square, atol=0.15)


@pytest.mark.parametrize("name", PLATES)
def test_black_covers_as_much_as_the_cells_do(name: str) -> None:
    plate = PLATES[name]
    left, top, right, bottom = draw_plate(plate).rectangles_mm.T
    n_black = sum(int(plate.black_cells(number).sum()) for number in plate.ids)
    cell_mm = plate.marker_mm / plate.n_cells
    assert ((right - left) * (bottom - top)).sum() == pytest.approx(n_black * cell_mm**2)


def test_faces_stand_side_by_side_in_one_strip() -> None:
    drawing = draw_plate(PLATES["three faces"])
    np.testing.assert_allclose(drawing.low_mm, [0.0, 0.0])
    np.testing.assert_allclose(drawing.high_mm, [120.0, 40.0])
    # No black on a fold, and white around.
    left, top, right, bottom = drawing.rectangles_mm.T
    for fold_mm in (40.0, 80.0):
        assert not ((left < fold_mm) & (fold_mm < right)).any()
    assert (left.min(), top.min()) == pytest.approx((2.0, 2.0))
    assert (right.max(), bottom.max()) == pytest.approx((118.0, 38.0))
