"""Public CTs and label images, read to the right place."""

import numpy as np
import pytest

from navapp.errors import InputError
from navapp.geometry.ply import read_ply
from navapp.preop.volume import read_ct, read_labels
from navapp.preop.volume.dicom_series import read_series
from tests.many import few_rows_of

pytestmark = pytest.mark.data


def test_totalseg_positions_win_and_slices_are_sorted(data):
    ct = read_ct(data / "ct/totalseg_example/dicom")
    np.testing.assert_array_equal(ct.volume.spacing_mm, [0.9765625, 0.9765625, 2.0])
    assert ct.volume.size == (512, 512, 20)
    assert ct.source.thickness_tag_mm == 3.0
    np.testing.assert_allclose(
        ct.volume.points_lps_mm([[0, 0, 0], [0, 0, 19]]),
        [[-249.51171875, -437.51171875, -804.5], [-249.51171875, -437.51171875, -766.5]],
    )
    assert any("2 mm apart, the thickness tag says 3 mm" in said for said in ct.warnings)


@pytest.mark.parametrize(
    ("label", "share", "mean_hu"), few_rows_of([(69, 0.76, 682), (70, 0.755, 580)])
)
def test_dicom_and_nifti_meet_in_physical_space(data, label, share, mean_hu):
    ct = read_ct(data / "ct/totalseg_example/dicom").volume
    mask = read_labels(data / "ct/totalseg_example/example_seg_dicom.nii.gz")
    inside = np.argwhere(mask.labels == label)[:, ::-1]
    points = mask.points_lps_mm(inside)
    i, j, k = np.round(ct.indices_of(points)).astype(int).T
    values = ct.hu[k, j, i]
    assert (values > 200).mean() >= share
    assert values.mean() == pytest.approx(mean_hu, abs=1)
    # Left is at high x.
    assert (points[:, 0].mean() > 0) == (label == 69)


def test_a_missing_slice_is_named(data):
    with pytest.raises(InputError, match=r"1 slice is missing between .*28\.11\) and .*38\.11\)"):
        read_ct(data / "ct/dicom2nifti/missing_slice")


def test_a_tilted_gantry_keeps_its_lean(data):
    found = read_series(data / "ct/dicom2nifti/gantry_tilt", None)
    assert any("14.0 degrees from their normal" in said for said in found.warnings)
    np.testing.assert_allclose(found.volume.lps_from_index[:3, 2], [0, 0, 5], atol=1e-5)
    place = (-106.791015625, -256.61886606561, -46.951915066986)
    np.testing.assert_allclose(found.volume.points_lps_mm([[0, 0, 3]]), [place], atol=1e-6)
    # Its pixels are noise without tissue: refused, and the lean is said there, too.
    with pytest.raises(InputError, match=r"air only.*gantry was tilted"):
        read_ct(data / "ct/dicom2nifti/gantry_tilt")


@pytest.mark.parametrize(
    "name",
    ["uncompressed_mr", "compressed_mr_jpeg_lossless", "compressed_mr_jpegls", "compressed_mr_rle"],
)
def test_all_encodings_are_read(data, name):
    ct = read_ct(data / "ct/dicom2nifti" / name)
    assert ct.volume.size == (256, 256, 4)
    np.testing.assert_allclose(ct.volume.spacing_mm, 1.0)
    # Noise over the whole range: a picture that failed to decode is not.
    assert (ct.volume.hu.min(), ct.volume.hu.max()) == (0, 254)
    assert ct.volume.hu.mean() == pytest.approx(127, abs=2)
    assert any("MR, not CT" in said for said in ct.warnings)


def test_the_phantom_is_read_with_its_flips_and_nothing_to_say(data):
    ct = read_ct(data / "phantom_a/ct.nii.gz")
    assert ct.volume.size == (185, 220, 151)
    np.testing.assert_allclose(ct.volume.spacing_mm, [0.55, 0.55, 0.85], rtol=1e-6)
    np.testing.assert_allclose(
        ct.volume.lps_from_index[:3, :3], np.diag([-0.55, 0.55, -0.85]), atol=1e-6
    )
    assert ct.warnings == ()
    bone, _ = read_ply(data / "phantom_a/femur.ply")
    index = np.round(ct.volume.indices_of(bone.vertices_mm)).astype(int)
    is_in = ((index >= 0) & (index < ct.volume.size)).all(axis=1)
    i, j, k = index[is_in].T
    assert np.median(ct.volume.hu[k, j, i]) > 300


def test_oblique_labels_meet_their_surfaces(data):
    labels = read_labels(data / "bones/knee_dess_R/labels.nrrd")
    for name, value in (("femur", 5), ("tibia", 6), ("patella", 7)):
        bone, _ = read_ply(data / f"bones/knee_dess_R/{name}.ply")
        voxels = labels.points_lps_mm(np.argwhere(labels.labels == value)[:, ::-1])
        for end in (np.min, np.max):
            np.testing.assert_allclose(end(voxels, axis=0), end(bone.vertices_mm, axis=0), atol=1.0)
