"""Bilinear rectification and undistortion, on pictures and against stored references."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from navapp.geometry.bilinear import Interpolation, bilinear, lens_maps
from navapp.geometry.box import Box
from navapp.geometry.camera import Camera
from navapp.geometry.rectification import Rectifier
from navapp.geometry.resampling import find_places, resample
from navapp.geometry.rig_files import read_rig
from tests.geometry.shapes import STRONG, camera, toed_in_rig


def undistort(picture: np.ndarray, lens: Camera, interpolation: Interpolation) -> np.ndarray:
    """The picture as the same camera without distortion sees it; else 0."""
    columns, rows = lens_maps(lens, np.eye(3), lens.matrix)
    if interpolation == "bilinear":
        return bilinear(picture, columns, rows, Box(0, 0, lens.width, lens.height).slices)
    return resample(picture, find_places(columns, rows))


def test_a_value_is_the_weighted_mean_of_its_four_pixels() -> None:
    picture = np.random.default_rng(2).integers(0, 256, (20, 30), dtype=np.uint8)
    rng = np.random.default_rng(3)
    columns = rng.uniform(0.0, 28.0, (15, 16)).astype(np.float32)
    rows = rng.uniform(0.0, 18.0, (15, 16)).astype(np.float32)
    x, y = columns.astype(int), rows.astype(int)
    a, b = columns.astype(float) - x, rows.astype(float) - y
    top = (1 - a) * picture[y, x] + a * picture[y, x + 1]
    bottom = (1 - a) * picture[y + 1, x] + a * picture[y + 1, x + 1]
    found = bilinear(picture, columns, rows, (slice(None), slice(None)))
    assert np.abs(found - ((1 - b) * top + b * bottom)).max() <= 0.51


def test_a_part_is_that_of_the_whole_and_the_rest_is_black() -> None:
    picture = np.random.default_rng(2).integers(1, 256, (20, 30, 3), dtype=np.uint8)
    rows, columns = np.mgrid[:20, :30].astype(np.float32)
    everything = (slice(None), slice(None))
    whole = bilinear(picture, columns + 0.5, rows, everything)
    part = bilinear(picture, columns + 0.5, rows, Box(4, 3, 9, 40).clip(30, 20).slices)
    np.testing.assert_array_equal(part[3:, 4:13], whole[3:, 4:13])
    assert part[:3].max() == part[:, :4].max() == part[:, 13:].max() == 0
    nothing = bilinear(picture, columns, rows, Box(90, 3, 9, 4).clip(30, 20).slices)
    assert nothing.max() == 0


@pytest.mark.parametrize("interpolation", ["cubic", "bilinear"])
def test_a_spot_is_undistorted_to_where_the_plain_camera_sees_it(interpolation: str) -> None:
    lens = camera(STRONG)
    ray = np.array([[0.21, -0.17, 1.0]])
    raw_px, plain_px = lens.project(ray)[0], camera().project(ray)[0]
    v, u = np.mgrid[:480, :640]
    spot = 250 * np.exp(-((u - raw_px[0]) ** 2 + (v - raw_px[1]) ** 2) / 18)
    found = undistort(spot.astype(np.uint8), lens, interpolation).astype(float)
    centre = np.array([(u * found).sum(), (v * found).sum()]) / found.sum()
    assert np.linalg.norm(raw_px - plain_px) > 1.0
    np.testing.assert_allclose(centre, plain_px, atol=0.1)


def test_given_rotations_are_rectified_with() -> None:
    rig = toed_in_rig()
    r1, r2, p1, p2 = Rectifier(rig).matrices
    turn = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    other = Rectifier(rig, given=(turn @ r1, turn @ r2, p1, p2))
    np.testing.assert_array_equal(other.geometry.rectified_from_left.rotation, turn @ r1)
    assert not np.allclose(other.maps[0], Rectifier(rig).maps[0])


@pytest.mark.data
@pytest.mark.parametrize("number", ["01", "06", "12"])
def test_reference_pictures_are_met_to_a_tenth_of_a_grey_level(data: Path, number: str) -> None:
    folder = data / "calib" / "rectify_reference"
    rig = read_rig(folder / "rig.yml")
    storage = cv2.FileStorage(str(folder / "rig.yml"), cv2.FILE_STORAGE_READ)
    given = tuple(storage.getNode(name).mat() for name in ("R1", "R2", "P1", "P2"))
    storage.release()

    def stored(side: str, kind: str) -> np.ndarray:
        path = folder / f"{side}{number}_{kind}.png"
        return cv2.imdecode(np.fromfile(path, dtype=np.uint8), cv2.IMREAD_GRAYSCALE)

    rectifier = Rectifier(rig, "bilinear", given)
    left, right = stored("left", "raw"), stored("right", "raw")
    pair = rectifier.rectify(left, right)
    found = {
        ("left", "rect"): pair.left,
        ("right", "rect"): pair.right,
        ("left", "undist"): undistort(left, rig.left, "bilinear"),
        ("right", "undist"): undistort(right, rig.right, "bilinear"),
    }
    for (side, kind), picture in found.items():
        off = np.abs(picture.astype(float) - stored(side, kind))
        assert off.mean() <= 0.1, (side, kind)
        assert off.max() <= 1.0, (side, kind)
