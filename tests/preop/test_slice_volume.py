"""Grey slices of volumes that were recorded in any direction, and their file."""

import numpy as np
import pytest

from navapp.errors import PlanError
from navapp.preop.slice_volume import (
    BLACK_HU,
    WHITE_HU,
    SliceVolume,
    make_slice_volume,
    read_slices,
    sample_grey,
    write_slices,
)
from navapp.preop.slices import DIRECTIONS, SliceGrid
from navapp.preop.volume import CtVolume, LabelVolume
from navapp.preop.volume.ct_volume import compute_steps_mm
from tests.geometry.shapes import sphere

# Brightness of a blob, and where it lies: no two of them mirror each other.
BLOBS = {
    1300.0: (-13.0, 4.0, 7.0), 900.0: (9.0, -11.0, 2.0), 500.0: (3.0, 12.0, -12.0),
}  # fmt: skip
_TURN = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))[0]
# A stack whose slices lean, as under a tilted gantry.
_LEANING = np.array([[1.0, 0, 0], [0, 1.0, 0.3], [0, 0, 1.0]])
AXES = {
    "as LPS": np.diag([0.6, 0.6, 1.5]),
    "RAS": np.diag([-0.6, -0.6, 1.5]),
    "left-handed": np.diag([-0.6, 0.6, 1.5]),
    "from head to feet": np.diag([0.6, 0.6, -1.5]),
    "sagittal stack": np.array([[0, 0, 1.5], [0.6, 0, 0], [0, -0.6, 0]]),
    "oblique": _TURN @ np.diag([0.7, 0.7, 0.9]),
    "oblique and left-handed": _TURN @ np.diag([-0.7, 0.7, 0.9]),
    "leaning": _LEANING @ np.diag([0.6, 0.6, 1.5]),
}


def make_volume(axes, values=None, kind=CtVolume):
    """Blobs of 3 mm around the origin, in voxels that lie as the axes say."""
    n = np.array([70, 70, 70]) if values is None else np.array(values.shape[::-1])
    matrix = np.eye(4)
    matrix[:3, :3] = axes
    matrix[:3, 3] = -axes @ (n - 1) / 2.0
    if values is None:
        index = np.stack(np.meshgrid(*(np.arange(k) for k in n), indexing="ij"), axis=-1)
        points = index @ axes.T + matrix[:3, 3]
        values = np.zeros(n)
        for hu, at in BLOBS.items():
            away = np.linalg.norm(points - at, axis=-1)
            values = np.maximum(values, hu * np.clip(3.5 - away, 0.0, 1.0))
        values = values.transpose(2, 1, 0).astype(np.int16)
    return kind(values, matrix, compute_steps_mm(matrix))


@pytest.mark.parametrize("axes", list(AXES))
def test_every_blob_lies_in_the_slice_and_the_pixel_that_its_place_says(axes) -> None:
    volume = make_slice_volume(make_volume(AXES[axes]), [sphere(5.0, 10)])
    assert volume.grid.step_mm == 1.0
    for direction in DIRECTIONS:
        for hu, at in BLOBS.items():
            expected = 255.0 * (hu - BLACK_HU) / (WHITE_HU - BLACK_HU)
            (index,) = volume.grid.find_slices(direction, np.array([at]))
            column, row = volume.grid.find_pixels(direction, np.array(at)).astype(int)
            plane = volume.slice_of(direction, int(index)).astype(float)
            assert plane.shape == volume.grid.shape_of(direction)
            assert plane[row, column] == pytest.approx(expected, abs=6), (direction.name, hu)
            # Nothing of that brightness stands where a mirrored picture would have it.
            assert plane[row, -1 - column] < 0.7 * expected


@pytest.mark.parametrize("axes", ["as LPS", "oblique"])
def test_a_blob_s_middle_is_found_to_a_tenth_of_a_pixel(axes) -> None:
    volume = make_slice_volume(make_volume(AXES[axes]), [sphere(5.0, 10)])
    weight = np.clip(volume.grey.astype(float) - 40.0, 0.0, None)
    places = np.stack(np.meshgrid(*(np.arange(n) for n in volume.grey.shape), indexing="ij"), -1)
    points = places[..., ::-1] * volume.grid.step_mm + volume.grid.origin_mm
    for at in BLOBS.values():
        near = weight * (np.linalg.norm(points - at, axis=-1) < 5.5)
        middle = (near[..., None] * points).sum(axis=(0, 1, 2)) / near.sum()
        np.testing.assert_allclose(middle, at, atol=0.1)


def test_outside_of_what_was_recorded_is_black() -> None:
    volume = make_volume(np.eye(3), np.full((5, 5, 5), 600, np.int16))
    grey = sample_grey(volume, SliceGrid((-4.0, -4.0, -4.0), 1.0, (9, 9, 9)))
    assert (grey[2:7, 2:7, 2:7] == 128).all()
    assert grey.sum() == 125 * 128


def test_labels_stay_whole() -> None:
    labels = np.zeros((9, 9, 9), np.int16)
    labels[4:, :, :], labels[:, :4, :] = 5, 2
    volume = make_volume(np.diag([0.5, 0.5, 0.5]), labels, LabelVolume)
    sliced = make_slice_volume(volume, [sphere(1.0, 5)])
    assert set(np.unique(sliced.grey)) == {0, 102, 255}
    assert sliced.range_hu is None


def test_a_volume_reads_back_exactly(tmp_path) -> None:
    volume = make_slice_volume(make_volume(AXES["oblique"]), [sphere(5.0, 10)])
    write_slices(tmp_path / "slices.npz", volume)
    again = read_slices(tmp_path / "slices.npz")
    assert (again.grid, again.range_hu) == (volume.grid, volume.range_hu)
    np.testing.assert_array_equal(again.grey, volume.grey)
    labels = SliceVolume(volume.grid, volume.grey)
    write_slices(tmp_path / "labels.npz", labels)
    assert read_slices(tmp_path / "labels.npz").range_hu is None


@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 0.9])
def test_a_file_that_was_cut_short_is_refused(tmp_path, share) -> None:
    path = tmp_path / "slices.npz"
    write_slices(path, make_slice_volume(make_volume(np.eye(3)), [sphere(5.0, 10)]))
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])
    with pytest.raises(PlanError, match=r"slices .* cannot be read"):
        read_slices(path)


@pytest.mark.parametrize(
    "change",
    [
        {"format": 2},
        {"step_mm": 0.0},
        {"grey": np.zeros((3, 3), np.uint8)},
        {"grey": np.zeros((3, 3, 3))},
        {"origin_mm": np.zeros(2)},
        {"range_hu": np.zeros(1)},
        {"range_hu": np.zeros(2)},
    ],
)
def test_a_file_of_something_else_is_refused(tmp_path, change) -> None:
    content = {
        "format": 1, "grey": np.zeros((3, 3, 3), np.uint8), "origin_mm": np.zeros(3),
        "step_mm": 1.0, "range_hu": np.array([-200.0, 1400.0]),
    }  # fmt: skip
    np.savez(tmp_path / "a.npz", **content)
    assert read_slices(tmp_path / "a.npz").grid.size == (3, 3, 3)
    np.savez(tmp_path / "a.npz", **{**content, **change})
    with pytest.raises(PlanError, match="cannot be read"):
        read_slices(tmp_path / "a.npz")


def test_a_missing_file_is_refused(tmp_path) -> None:
    with pytest.raises(PlanError, match="cannot be read"):
        read_slices(tmp_path / "slices.npz")
