import gzip
import struct

import numpy as np
import pytest
import SimpleITK as sitk  # noqa: N813

from navapp.errors import InputError, UsageError
from navapp.preop.volume import read_ct, read_labels

SUFFIXES = ("nii", "nii.gz", "nrrd", "mha", "mhd")
HU = np.random.default_rng(3).integers(-1000, 2000, (5, 6, 7)).astype(np.int16)
# A flip, and a rotation about an axis of the patient.
TURNED = (0.8, -0.6, 0.0, 0.6, 0.8, 0.0, 0.0, 0.0, -1.0)


def image_of(values, direction=TURNED):
    image = sitk.GetImageFromArray(values)
    image.SetDirection(direction)
    image.SetSpacing((0.5, 0.75, 1.25))
    image.SetOrigin((-30.0, 12.0, 700.0))
    return image


def write(path, values, is_compressed=False):
    image = image_of(values)
    sitk.WriteImage(image, str(path), is_compressed)
    return image


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("is_compressed", [False, True])
def test_every_voxel_lies_where_it_was_written(tmp_path, suffix, is_compressed):
    image = write(tmp_path / f"ct.{suffix}", HU, is_compressed)
    ct = read_ct(tmp_path / f"ct.{suffix}")
    assert ct.volume.hu.dtype == np.int16
    np.testing.assert_array_equal(ct.volume.hu, HU)
    for index in [(0, 0, 0), (6, 0, 0), (0, 5, 0), (0, 0, 4), (3, 2, 1)]:
        expected = image.TransformIndexToPhysicalPoint(index)
        np.testing.assert_allclose(ct.volume.points_lps_mm([index]), [expected], atol=1e-4)
    np.testing.assert_allclose(ct.volume.spacing_mm, [0.5, 0.75, 1.25])
    assert (ct.source.kind, ct.source.n_slices) == (f".{suffix}", 5)
    assert not any("space" in warning for warning in ct.warnings)


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("is_compressed", [False, True])
@pytest.mark.parametrize("share", [0.2, 0.6, 0.98])
def test_a_file_that_is_cut_short_is_refused_in_silence(
    tmp_path, suffix, is_compressed, share, capfd
):
    path = tmp_path / f"ct.{suffix}"
    write(path, HU, is_compressed)
    raw = [file for file in tmp_path.iterdir() if "raw" in file.name]
    cut = raw[0] if raw else path
    cut.write_bytes(cut.read_bytes()[: int(share * cut.stat().st_size)])
    with pytest.raises(InputError, match=r"ct\..* is damaged or cut short: "):
        read_ct(path)
    assert capfd.readouterr() == ("", "")


def test_a_nifti_with_one_wrong_byte_in_its_compressed_voxels_is_refused(tmp_path):
    path = tmp_path / "ct.nii.gz"
    write(path, HU)
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 0x10
    path.write_bytes(content)
    with pytest.raises(InputError, match="damaged"):
        read_ct(path)


def test_a_broken_compressed_file_is_not_replaced_by_another_of_its_name(tmp_path):
    write(tmp_path / "ct.nii", HU)
    (tmp_path / "ct.nii.gz").write_bytes(gzip.compress(b"nothing"))
    with pytest.raises(InputError, match="damaged"):
        read_ct(tmp_path / "ct.nii.gz")


def test_fractions_stay_and_what_is_no_number_is_air(tmp_path):
    values = HU.astype(np.float64) + 0.25
    values[0, 0, :3] = np.nan, np.inf, -np.inf
    values[1, 1, 1] = -3024.0
    write(tmp_path / "ct.nrrd", values)
    hu = read_ct(tmp_path / "ct.nrrd").volume.hu
    assert hu.dtype == np.float32
    expected = values.copy()
    expected[0, 0, :3] = expected[1, 1, 1] = -1024.0
    np.testing.assert_allclose(hu, expected)


@pytest.mark.parametrize("kind", [np.uint8, np.int8, np.uint16, np.int32, np.float32])
def test_all_kinds_of_values_are_read(tmp_path, kind):
    values = np.clip(HU, 0, 120).astype(kind)
    write(tmp_path / "ct.mha", values)
    np.testing.assert_array_equal(read_ct(tmp_path / "ct.mha").volume.hu, values)


def test_values_beyond_16_bit_are_kept(tmp_path):
    values = HU.astype(np.int32)
    values[2, 2, 2] = 60000
    write(tmp_path / "ct.nrrd", values)
    assert read_ct(tmp_path / "ct.nrrd").volume.hu.max() == 60000.0


def test_what_the_content_says_is_told_with_the_rest(tmp_path):
    values = HU.copy()
    values[1:3, 1:3, 1:3] = 3071
    with_sform(tmp_path / "ct.nii", [[-0.5, 0, 0, 3], [0, -0.8, 0.2, 1], [0, 0, 1, 7]], (0, 1))
    write(tmp_path / "metal.mha", values)
    assert any("metal" in said for said in read_ct(tmp_path / "metal.mha").warnings)
    said = read_ct(tmp_path / "ct.nii").warnings
    assert any("right angles" in text for text in said)
    assert any("field of view" in text for text in said)


def test_a_file_that_names_no_space_is_read_with_a_warning(tmp_path):
    write(tmp_path / "ct.nii", HU)
    content = bytearray((tmp_path / "ct.nii").read_bytes())
    content[252:256] = bytes(4)  # qform_code and sform_code
    (tmp_path / "ct.nii").write_bytes(content)
    header = "NRRD0004\ntype: int16\ndimension: 3\nsizes: 7 6 5\nspacings: 1 1 1\n"
    header += "endian: little\nencoding: raw\n\n"
    (tmp_path / "ct.nrrd").write_bytes(header.encode() + HU.tobytes())
    for name in ("ct.nii", "ct.nrrd"):
        assert any("no coordinate space" in said for said in read_ct(tmp_path / name).warnings)


def with_sform(path, rows, codes):
    """A file with another affine map (RAS), and codes of its two ways to say its place."""
    write(path, HU)
    content = bytearray(path.read_bytes())
    struct.pack_into("<hh", content, 252, *codes)
    struct.pack_into("<12f", content, 280, *np.ravel(rows))
    path.write_bytes(content)


@pytest.mark.parametrize("codes", [(0, 1), (1, 1), (1, 2)])
@pytest.mark.parametrize("lean_mm", [0.01, 0.3])
def test_a_nifti_with_leaning_axes_keeps_them(tmp_path, codes, lean_mm):
    rows = [[-0.5, 0, 0, 30], [0, -0.75, lean_mm, -12], [0, 0, 1.25, 700]]
    with_sform(tmp_path / "ct.nii", rows, codes)
    ct = read_ct(tmp_path / "ct.nii")
    expected = np.array(rows) * [[-1], [-1], [1]]
    np.testing.assert_allclose(ct.volume.lps_from_index[:3], expected, rtol=1e-6, atol=1e-6)
    np.testing.assert_array_equal(ct.volume.hu, HU)
    assert any("not at right angles" in said for said in ct.warnings)


def test_a_nifti_that_says_two_places_is_read_with_a_warning(tmp_path):
    rows = [[-0.5, 0, 0, 30], [0, -0.75, 0, -12], [0, 0, 1.25, 709]]
    with_sform(tmp_path / "ct.nii", rows, (1, 2))
    assert any(
        "in two ways where it lies" in said for said in read_ct(tmp_path / "ct.nii").warnings
    )


@pytest.mark.parametrize("last", [(0, 0.0, 1.0), (0, 0, 0), (np.nan, 0, 1)])
def test_axes_that_span_no_volume_are_refused(tmp_path, last):
    rows = np.array([[-0.5, 0, 0, 30], [0, -0.75, 0, -12], [0, 0, 0, 700]])
    rows[:, 1], rows[:3, 2] = (0, 0, 1), last
    with_sform(tmp_path / "ct.nii", rows, (0, 1))
    with pytest.raises(InputError, match=r"do not span a volume|damaged"):
        read_ct(tmp_path / "ct.nii")


def test_nrrd_axes_that_lean_are_kept(tmp_path):
    header = (
        "NRRD0004\ntype: int16\ndimension: 3\nspace: right-anterior-superior\nsizes: 7 6 5\n"
        "space directions: (0.5,0,0) (0,0.6,0) (0,0.2,0.7)\nspace origin: (1,2,3)\n"
        "kinds: domain domain domain\nendian: little\nencoding: raw\n\n"
    )
    (tmp_path / "ct.nrrd").write_bytes(header.encode() + HU.tobytes())
    expected = [[-0.5, 0, 0, -1], [0, -0.6, -0.2, -2], [0, 0, 0.7, 3]]
    found = read_ct(tmp_path / "ct.nrrd").volume.lps_from_index
    np.testing.assert_allclose(found[:3], expected, atol=1e-9)


def test_what_is_no_volume_is_refused(tmp_path):
    sitk.WriteImage(sitk.GetImageFromArray(HU[0]), str(tmp_path / "flat.mha"))
    sitk.WriteImage(sitk.GetImageFromArray(HU[:1]), str(tmp_path / "thin.mha"))
    colours = sitk.GetImageFromArray(np.zeros((5, 6, 7, 3), np.uint8), isVector=True)
    sitk.WriteImage(colours, str(tmp_path / "colours.mha"))
    series = sitk.GetImageFromArray(np.zeros((2, 5, 6, 7), np.int16), isVector=False)
    sitk.WriteImage(series, str(tmp_path / "times.nii"))
    for name in ("flat.mha", "thin.mha", "colours.mha", "times.nii"):
        with pytest.raises(InputError, match="is no volume of one value a voxel"):
            read_ct(tmp_path / name)


def test_other_files_are_refused_by_name(tmp_path):
    for name, content in (("ct.txt", b"text"), ("slice", b"\0" * 128 + b"DICM")):
        (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match="is of no kind that is read"):
        read_ct(tmp_path / "ct.txt")
    with pytest.raises(InputError, match="one DICOM file: name the folder"):
        read_ct(tmp_path / "slice")
    (tmp_path / "ct.nii").write_bytes(b"text")
    with pytest.raises(InputError, match="damaged"):
        read_ct(tmp_path / "ct.nii")
    write(tmp_path / "ct.mha", HU)
    with pytest.raises(UsageError, match="--series"):
        read_ct(tmp_path / "ct.mha", "1.2.3")


@pytest.mark.parametrize("kind", [np.uint8, np.int16, np.uint32, np.float32])
def test_labels_are_whole_numbers_at_their_place(tmp_path, kind):
    labels = (np.abs(HU) % 7).astype(kind)
    image = write(tmp_path / "labels.nrrd", labels)
    read = read_labels(tmp_path / "labels.nrrd")
    assert np.issubdtype(read.labels.dtype, np.integer)
    np.testing.assert_array_equal(read.labels, labels)
    expected = image.TransformIndexToPhysicalPoint((6, 5, 4))
    np.testing.assert_allclose(read.points_lps_mm([[6, 5, 4]]), [expected], atol=1e-4)


def test_what_is_no_label_image_is_refused(tmp_path):
    write(tmp_path / "half.nrrd", HU.astype(np.float32) + 0.5)
    write(tmp_path / "none.nrrd", np.zeros_like(HU))
    with pytest.raises(InputError, match=r"half\.nrrd is no label image: its values are not whole"):
        read_labels(tmp_path / "half.nrrd")
    with pytest.raises(InputError, match=r"none\.nrrd is no label image: every voxel is 0"):
        read_labels(tmp_path / "none.nrrd")
