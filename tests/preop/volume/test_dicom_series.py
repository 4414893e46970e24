from dataclasses import replace

import numpy as np
import pytest
from pydicom.dataset import FileMetaDataset

from navapp.errors import InputError
from navapp.preop.volume import list_series, read_ct
from tests.preop.volume.dicom_writing import UID, Series, assert_in_place, axial, change

OTHER_UID = UID + ".7"


def test_slices_are_placed_by_position_whatever_their_names(tmp_path):
    series = axial()
    series.write(tmp_path, [f"file{9 - k}" for k in range(6)])
    ct = read_ct(tmp_path)
    assert_in_place(ct.volume, series)
    np.testing.assert_allclose(ct.volume.spacing_mm, [0.5, 0.7, 2.0])
    assert ct.volume.size == (10, 12, 6)
    assert ct.volume.hu.dtype == np.int16
    assert ct.source.n_slices == 6


def test_a_stack_that_goes_down_is_turned_up(tmp_path):
    series = axial()
    series.positions_mm = series.positions_mm[::-1].copy()
    series.write(tmp_path)
    volume = read_ct(tmp_path).volume
    assert_in_place(volume, series)
    assert np.linalg.det(volume.lps_from_index[:3, :3]) > 0


def rotated(angle_deg):
    """Row, column and normal of a slice turned about an odd axis."""
    axis = np.array([1.0, 2.0, 3.0]) / np.sqrt(14.0)
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    angle = np.radians(angle_deg)
    return (np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross).T


DIRECTIONS = {
    "coronal": ((1, 0, 0), (0, 0, -1), (0, 1, 0)),
    "sagittal": ((0, 1, 0), (0, 0, -1), (-1, 0, 0)),
    "flipped": ((-1, 0, 0), (0, 1, 0), (0, 0, -1)),
    "feet first": ((-1, 0, 0), (0, -1, 0), (0, 0, 1)),
    "oblique": tuple(map(tuple, rotated(25.0))),
}


@pytest.mark.parametrize("name", DIRECTIONS)
@pytest.mark.parametrize("sign", [1, -1])
def test_the_direction_is_honoured(tmp_path, name, sign):
    row, column, normal = DIRECTIONS[name]
    positions = np.arange(6)[:, None] * sign * 1.25 * np.array(normal) + [30.0, -40.0, 50.0]
    series = replace(axial(), positions_mm=positions, row=row, column=column)
    series.write(tmp_path)
    ct = read_ct(tmp_path)
    assert_in_place(ct.volume, series)
    assert not any("tilted" in warning for warning in ct.warnings)


def test_positions_win_over_the_thickness_tag_and_that_is_said(tmp_path):
    series = axial(step_mm=0.5, SliceThickness=2, SpacingBetweenSlices=2)
    series.write(tmp_path)
    ct = read_ct(tmp_path)
    assert_in_place(ct.volume, series)
    assert ct.source.thickness_tag_mm == 2.0
    (said,) = [warning for warning in ct.warnings if "thickness" in warning]
    assert "0.5 mm apart" in said
    assert "overlap" in said


def test_gaps_between_thin_slices_are_said(tmp_path):
    axial(step_mm=2.0, SliceThickness=1).write(tmp_path)
    assert any("was not recorded" in warning for warning in read_ct(tmp_path).warnings)


def test_a_thickness_that_fits_is_not_mentioned(tmp_path):
    axial(step_mm=2.0, SliceThickness=2).write(tmp_path)
    assert not any("thickness" in warning for warning in read_ct(tmp_path).warnings)


def test_a_tilted_gantry_leans_in_the_matrix_and_no_voxel_is_moved(tmp_path):
    tilt = np.radians(14.0)
    column = (0.0, np.cos(tilt), -np.sin(tilt))
    series = replace(axial(step_mm=5.0), column=column, tags={"GantryDetectorTilt": 14.0})
    series.write(tmp_path)
    ct = read_ct(tmp_path)
    assert_in_place(ct.volume, series)
    step = ct.volume.lps_from_index[:3, 2]
    np.testing.assert_allclose(step, [0.0, 0.0, 5.0], atol=1e-9)
    normal = np.cross(series.row, series.column)
    assert step @ normal == pytest.approx(5.0 * np.cos(tilt))
    (said,) = [warning for warning in ct.warnings if "tilt" in warning]
    assert "14.0 degrees" in said


def test_a_tilt_that_the_positions_deny_is_refused_unless_the_pictures_are_derived(tmp_path):
    files = axial(GantryDetectorTilt=-22.0).write(tmp_path)
    with pytest.raises(InputError, match=r"tilt of 22\.0 degrees in its tag and 0\.0"):
        read_ct(tmp_path)
    for file in files:
        change(file, ImageType=["DERIVED", "SECONDARY", "REFORMATTED"])
    assert any("positions are taken" in warning for warning in read_ct(tmp_path).warnings)


def test_a_fractional_rescale_is_applied_slice_by_slice(tmp_path):
    series = axial()
    files = series.write(tmp_path)
    slopes = 0.5 + 0.1 * np.arange(6)
    for k, file in enumerate(files):
        change(file, RescaleSlope=f"{slopes[k]:.1f}", RescaleIntercept=-100 - k)
    volume = read_ct(tmp_path).volume
    assert volume.hu.dtype == np.float32
    expected = series.stored * slopes[:, None, None] - 100 - np.arange(6)[:, None, None]
    assert_in_place(volume, series, expected)


def test_a_whole_rescale_stays_whole(tmp_path):
    series = axial(RescaleIntercept=-50)
    series.write(tmp_path)
    volume = read_ct(tmp_path).volume
    assert volume.hu.dtype == np.int16
    assert_in_place(volume, series, series.stored - 50)


def test_padding_reads_as_air(tmp_path):
    series = axial(RescaleIntercept=-24)
    series.stored[:, 0, :3] = -2000
    series.stored[:, 1, :3] = 1500
    series.tags["PixelPaddingValue"] = 1500
    series.write(tmp_path)
    expected = series.stored - 24
    expected[:, :2, :3] = -1024
    assert_in_place(read_ct(tmp_path).volume, series, expected)


def test_a_range_of_padding_reads_as_air(tmp_path):
    series = axial(PixelPaddingValue=2000, PixelPaddingRangeLimit=2005)
    series.stored[:, 0, :7] = np.arange(2000, 2007)
    series.write(tmp_path)
    expected = series.stored.copy()
    expected[:, 0, :6] = -1024
    assert_in_place(read_ct(tmp_path).volume, series, expected)


def test_padding_is_rescaled_like_any_value(tmp_path):
    series = axial(RescaleSlope=2, RescaleIntercept=-24, PixelPaddingValue=800)
    series.stored[:, 0, :3] = 800
    # 776 HU: where the padding would be without the slope.
    series.stored[0, 1, 1] = 400
    series.write(tmp_path)
    expected = np.maximum(2 * series.stored - 24, -1024)
    expected[series.stored == 800] = -1024
    assert_in_place(read_ct(tmp_path).volume, series, expected)


@pytest.mark.parametrize("compressor", ["JPEG2000", "JPEG"])
def test_compressed_slices_are_read(tmp_path, compressor):
    series = axial()
    files = series.write_compressed(tmp_path, compressor)
    assert b"1.2.840.10008.1.2.4." in files[0].read_bytes()
    assert_in_place(read_ct(tmp_path).volume, series)


def test_slices_below_the_folder_without_suffix_or_preamble_are_found(tmp_path):
    series = axial()
    (tmp_path / "DICOM").mkdir()
    files = series.write(tmp_path / "DICOM" / "SE0", [f"IM{k}" for k in range(6)])
    (tmp_path / "DICOMDIR").write_bytes(b"\0" * 128 + b"DICM rest")
    bare = series.dataset(0)
    bare.preamble = None
    bare.file_meta = FileMetaDataset()
    bare.save_as(files[0], implicit_vr=True, little_endian=True, enforce_file_format=False)
    assert files[0].read_bytes()[128:132] != b"DICM"
    assert_in_place(read_ct(tmp_path).volume, series)


def test_the_laterality_tag_is_said(tmp_path):
    files = axial(Laterality="R").write(tmp_path)
    assert read_ct(tmp_path).source.side == "right"
    change(files[2], Laterality="L")
    ct = read_ct(tmp_path)
    assert ct.source.side is None
    assert any("laterality" in warning for warning in ct.warnings)


def test_another_modality_is_said(tmp_path):
    axial(Modality="MR").write(tmp_path)
    assert any("MR, not CT" in warning for warning in read_ct(tmp_path).warnings)


def test_a_slice_that_is_there_twice_is_dropped_with_a_word(tmp_path):
    series = axial()
    files = series.write(tmp_path)
    (tmp_path / "copy").write_bytes(files[3].read_bytes())
    ct = read_ct(tmp_path)
    assert_in_place(ct.volume, series)
    assert any("1 slice that is there twice" in warning for warning in ct.warnings)


def two_series(folder) -> tuple[Series, Series]:
    first, second = axial(6), axial(4, SeriesInstanceUID=OTHER_UID, SeriesDescription="Hip 2.0")
    first.write(folder)
    second.write(folder, [f"second{k}" for k in range(4)])
    return first, second


def test_several_series_are_listed_and_one_is_chosen(tmp_path):
    first, second = two_series(tmp_path)
    infos = list_series(tmp_path)
    assert [(info.uid, info.n_slices) for info in infos] == [(UID, 6), (OTHER_UID, 4)]
    assert infos[1].description == "Hip 2.0"
    with pytest.raises(InputError) as refused:
        read_ct(tmp_path)
    text = str(refused.value)
    assert all(word in text for word in (UID, OTHER_UID, "Hip 2.0", "--series", "6 slices"))
    assert_in_place(read_ct(tmp_path, UID).volume, first)
    assert_in_place(read_ct(tmp_path, OTHER_UID).volume, second)
    with pytest.raises(InputError, match="no series of that UID"):
        read_ct(tmp_path, "1.2.3")


def test_an_overview_beside_the_volume_is_passed_over(tmp_path):
    series = axial()
    series.write(tmp_path)
    overview = axial(1, SeriesInstanceUID=OTHER_UID, ImageType=["ORIGINAL", "PRIMARY", "LOCALIZER"])
    overview.write(tmp_path, ["overview"])
    ct = read_ct(tmp_path)
    assert_in_place(ct.volume, series)
    assert any(OTHER_UID in warning for warning in ct.warnings)


def test_a_series_without_uid_is_read(tmp_path):
    series = axial(SeriesInstanceUID="")
    series.write(tmp_path)
    assert list_series(tmp_path)[0].uid == "none"
    assert_in_place(read_ct(tmp_path, "none").volume, series)
