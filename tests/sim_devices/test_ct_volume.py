import numpy as np
import pytest

from sim_devices.anatomy import KneeSpec, make_knee
from sim_devices.ct_volume import make_ct

COARSE_MM = (1.0, 1.0, 1.2)


@pytest.fixture(scope="module")
def knee():
    return make_knee(KneeSpec(3))


@pytest.fixture(scope="module")
def ct(knee):
    return make_ct(knee, COARSE_MM, noise_hu=0.0)


def hounsfield_at(ct, points):
    from scipy.ndimage import map_coordinates

    index = ((points - ct.origin_mm) @ ct.direction) / ct.spacing_mm
    coordinates = [index[..., 2], index[..., 1], index[..., 0]]
    return map_coordinates(ct.hounsfield.astype(np.float64), coordinates, order=1)


def surface_offsets_mm(ct, points, normals):
    """Where along the normals the half maximum between soft tissue and cortex lies."""
    offsets = np.linspace(-1.0, 2.0, 121)
    rays = points[:, None] + offsets[None, :, None] * normals[:, None]
    above = hounsfield_at(ct, rays) > 0.5 * (1200.0 + 50.0)
    assert above.any(axis=1).mean() > 0.98
    above = above[above.any(axis=1)]
    return offsets[above.shape[1] - 1 - np.argmax(above[:, ::-1], axis=1)]


@pytest.mark.release
@pytest.mark.parametrize(("bone", "low", "high"), [("femur", 60.0, 90.0), ("tibia", -130.0, -95.0)])
def test_the_surface_of_thick_cortex_is_that_of_the_mesh(knee, ct, bone, low, high):
    mesh = knee.bones[bone]
    z = mesh.vertices_mm[:, 2]
    on_shaft = np.flatnonzero((z > low) & (z < high))[::5]
    offsets = surface_offsets_mm(ct, mesh.vertices_mm[on_shaft], mesh.normals[on_shaft])
    assert abs(np.median(offsets)) < 0.1
    assert np.percentile(np.abs(offsets), 95) < 0.25


@pytest.mark.release
def test_tissues_have_their_values(knee, ct):
    inside_condyle = knee.landmarks["femur/medial_condyle"] + [0.0, 0.0, 12.0]
    shaft = knee.bones["femur"].vertices_mm
    marrow = shaft[np.abs(shaft[:, 2] - 85.0) < 2.0].mean(axis=0)
    muscle = np.array([35.0, 10.0, 70.0])
    air = np.array([60.0, -60.0, 0.0])
    joint = 0.5 * (knee.landmarks["tibia/medial_plateau"] + knee.landmarks["femur/medial_condyle"])
    found = hounsfield_at(ct, np.stack([inside_condyle, marrow, muscle, air]))
    np.testing.assert_allclose(found, [250.0, -50.0, 50.0, -1000.0], atol=5.0)
    assert hounsfield_at(ct, joint[None])[0] > 60.0


def test_the_cortex_thins_towards_the_joint(knee, ct):
    mesh = knee.bones["femur"]

    def brightest(select):
        points, normals = mesh.vertices_mm[select], mesh.normals[select]
        depths = np.linspace(0.0, 3.0, 13)
        rays = points[:, None] - depths[None, :, None] * normals[:, None]
        return np.median(hounsfield_at(ct, rays).max(axis=1))

    z = mesh.vertices_mm[:, 2]
    assert brightest((z > 60.0) & (z < 90.0)) > 1.2 * brightest(z < -20.0)


def test_fat_lies_under_the_skin_and_a_table_under_the_leg(knee, ct):
    slice_hu = ct.hounsfield[ct.hounsfield.shape[0] // 2].astype(np.float64)
    column = slice_hu[:, slice_hu.shape[1] // 2]
    body = np.flatnonzero(column > -500.0)
    first, last = body[0], body[-1]
    assert column[first + 2 : first + 5] == pytest.approx(-95.0, abs=10.0)
    assert column[last - 2] == pytest.approx(300.0, abs=60.0)
    assert column[last - 8] < -900.0


def test_a_left_knee_is_scanned_where_it_lies():
    left = make_knee(KneeSpec(3, "left"))
    ct = make_ct(left, (1.5, 1.5, 2.0), noise_hu=0.0)
    bulk = left.landmarks["femur/medial_condyle"] + [0.0, 0.0, 12.0]
    assert hounsfield_at(ct, bulk[None])[0] == pytest.approx(250.0, abs=10.0)
    assert ct.hounsfield.dtype == np.int16


def test_noise_has_its_deviation_and_its_seed(knee):
    spacing = (2.0, 2.0, 3.0)
    clean = make_ct(knee, spacing, noise_hu=0.0).hounsfield
    noisy = make_ct(knee, spacing, seed=1, noise_hu=20.0).hounsfield
    in_body = clean > -500
    assert (noisy - clean)[in_body].std() == pytest.approx(20.0, rel=0.05)
    again = make_ct(knee, spacing, seed=1, noise_hu=20.0).hounsfield
    np.testing.assert_array_equal(noisy, again)
    assert (noisy != make_ct(knee, spacing, seed=2, noise_hu=20.0).hounsfield).mean() > 0.5
