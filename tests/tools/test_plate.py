"""Where the markers of a plate lie, and how its faces are folded."""

import math

import cv2
import numpy as np
import pytest

from navapp.tools.plate import Plate


def test_a_face_is_as_large_as_its_squares() -> None:
    plate = Plate(columns=3, rows=2, square_mm=20.0, marker_mm=15.0)
    assert plate.face_size_mm == (60.0, 40.0)
    assert plate.margin_mm == 2.5


def test_every_marker_of_every_face_has_an_id_of_its_own() -> None:
    plate = Plate(first_id=5, columns=3, rows=2, faces=2, fold_deg=30.0)
    assert list(plate.ids) == list(range(5, 17))
    assert len(plate.corners_mm) == len(plate.ids)


def test_corners_go_clockwise_from_the_upper_left_and_markers_row_by_row() -> None:
    corners = Plate(columns=3, rows=2, square_mm=20.0, marker_mm=16.0).corners_mm
    first = [[-28, -18, 0], [-12, -18, 0], [-12, -2, 0], [-28, -2, 0]]
    np.testing.assert_allclose(corners[0], first)
    np.testing.assert_allclose(corners[2] - corners[0], np.tile([40.0, 0.0, 0.0], (4, 1)))
    np.testing.assert_allclose(corners[3] - corners[0], np.tile([0.0, 20.0, 0.0], (4, 1)))
    np.testing.assert_allclose(corners.mean(axis=(0, 1)), 0.0, atol=1e-12)


def test_faces_folded_by_a_right_angle_stand_upright_on_each_other() -> None:
    plate = Plate(faces=2, fold_deg=90.0)
    first, second = plate.plate_from_faces
    assert first[:3, 2] @ second[:3, 2] == pytest.approx(0.0, abs=1e-12)
    # Away from who reads, and read from the right.
    np.testing.assert_allclose(second[:3, 3], [20.0, 0.0, 20.0], atol=1e-12)
    np.testing.assert_allclose(second[:3, 2], [-1.0, 0.0, 0.0], atol=1e-12)


@pytest.mark.parametrize("fold_deg", [90.0, 50.0, -35.0])
def test_neighbouring_faces_share_their_hinge(fold_deg: float) -> None:
    plate = Plate(columns=3, rows=1, faces=3, fold_deg=fold_deg)
    width, height = plate.face_size_mm
    for before, after in zip(plate.plate_from_faces, plate.plate_from_faces[1:], strict=False):
        for y in (-0.5 * height, 0.5 * height):
            right_end = before @ [0.5 * width, y, 0.0, 1.0]
            left_end = after @ [-0.5 * width, y, 0.0, 1.0]
            np.testing.assert_allclose(left_end, right_end, atol=1e-12)
        turned = math.degrees(math.acos(before[:3, 2] @ after[:3, 2]))
        assert turned == pytest.approx(abs(fold_deg))


def test_corners_of_a_further_face_lie_on_that_face() -> None:
    plate = Plate(faces=2, fold_deg=90.0)
    # The fold lies at x = 20; the second face goes away from there, its rows still along y.
    np.testing.assert_allclose(plate.corners_mm[4, 0], [20.0, -18.0, 2.0], atol=1e-12)
    np.testing.assert_allclose(plate.corners_mm[7, 2], [20.0, 18.0, 38.0], atol=1e-12)


@pytest.mark.parametrize("dictionary", ["DICT_4X4_100", "DICT_6X6_50"])
def test_black_cells_are_those_of_the_dictionary(dictionary: str) -> None:
    plate = Plate(dictionary=dictionary)
    known = plate.opencv_dictionary
    for number in (0, 7, 31):
        black = plate.black_cells(number)
        bits = cv2.aruco.Dictionary.getBitsFromByteList(
            known.bytesList[number : number + 1], known.markerSize
        )
        inside = np.pad(bits == 0, 1, constant_values=True)
        np.testing.assert_array_equal(black, inside)
        assert plate.n_cells == known.markerSize + 2 == len(black)


def test_a_plate_says_what_it_is() -> None:
    assert str(Plate()) == "plate with one face of 40 x 40 mm, DICT_4X4_100"
    assert str(Plate(faces=3, fold_deg=50.0)).startswith("plate with 3 faces")
