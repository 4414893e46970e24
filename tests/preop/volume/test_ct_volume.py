import numpy as np
import pytest

from navapp.preop.volume import CtVolume, LabelVolume


def leaning():
    """Oblique, left-handed and leaning at once."""
    matrix = np.array(
        [[0.4, 0.1, 0.0, 5.0], [0.1, -0.5, 0.3, -7.0], [0.0, 0.2, 1.5, 90.0], [0, 0, 0, 1.0]]
    )
    hu = np.arange(4 * 5 * 6, dtype=np.int16).reshape(4, 5, 6)
    return CtVolume(hu, matrix, np.linalg.norm(matrix[:3, :3], axis=0))


def test_indices_are_i_j_k_against_axes_k_j_i():
    volume = leaning()
    assert volume.size == (6, 5, 4)
    matrix = volume.lps_from_index
    expected = matrix[:3, 3] + 5 * matrix[:3, 0] + 4 * matrix[:3, 1] + 3 * matrix[:3, 2]
    np.testing.assert_allclose(volume.points_lps_mm([[5, 4, 3]]), [expected])
    assert volume.hu[3, 4, 5] == volume.hu[-1, -1, -1]


def test_points_and_indices_are_inverse_also_between_and_outside_voxels():
    volume = leaning()
    indices = np.random.default_rng(1).uniform(-9, 9, (50, 3))
    points = volume.points_lps_mm(indices)
    np.testing.assert_allclose(volume.indices_of(points), indices, atol=1e-9)
    back = np.c_[points, np.ones(50)] @ volume.index_from_lps.T
    np.testing.assert_allclose(back[:, :3], indices, atol=1e-9)


def test_a_crop_stays_where_it_is():
    volume = leaning()
    lower, upper = np.array([1, 2, 1]), np.array([5, 4, 3])
    crop = volume.crop(lower, upper)
    assert crop.size == (4, 2, 2)
    for index in np.ndindex(4, 2, 2):
        there = np.array(index) + lower
        i, j, k = index
        assert crop.hu[k, j, i] == volume.hu[there[2], there[1], there[0]]
        np.testing.assert_allclose(crop.points_lps_mm([index]), volume.points_lps_mm([there]))
    assert not np.shares_memory(crop.hu, volume.hu)


def test_a_crop_of_labels_is_labels():
    volume = leaning()
    labels = LabelVolume(volume.hu.astype(np.uint8), volume.lps_from_index, volume.spacing_mm)
    assert isinstance(labels.crop((0, 0, 0), (1, 2, 3)), LabelVolume)


@pytest.mark.parametrize(
    ("lower", "upper"), [((0, 0, 0), (7, 5, 4)), ((-1, 0, 0), (2, 2, 2)), ((2, 2, 2), (2, 3, 3))]
)
def test_a_crop_beyond_the_volume_or_of_nothing_is_refused(lower, upper):
    with pytest.raises(ValueError, match="not inside"):
        leaning().crop(lower, upper)


def test_the_place_cannot_be_written():
    volume = leaning()
    with pytest.raises(ValueError, match="read-only"):
        volume.lps_from_index[0, 3] = 1.0


def test_what_is_no_volume_is_refused():
    volume = leaning()
    flat, wrong = volume.lps_from_index.copy(), volume.lps_from_index.copy()
    flat[:3, 2] = flat[:3, 1]
    wrong[0, 0] = np.nan
    with pytest.raises(ValueError, match="one plane"):
        CtVolume(volume.hu, flat, np.linalg.norm(flat[:3, :3], axis=0))
    with pytest.raises(ValueError, match="finite affine"):
        CtVolume(volume.hu, wrong, volume.spacing_mm)
    with pytest.raises(ValueError, match="columns"):
        CtVolume(volume.hu, volume.lps_from_index, np.ones(3))
    with pytest.raises(ValueError, match="int16 or float32"):
        CtVolume(volume.hu.astype(np.float64), volume.lps_from_index, volume.spacing_mm)
    with pytest.raises(ValueError, match="three axes"):
        CtVolume(volume.hu[0], volume.lps_from_index, volume.spacing_mm)
    with pytest.raises(ValueError, match="whole numbers"):
        LabelVolume(volume.hu.astype(np.float32), volume.lps_from_index, volume.spacing_mm)
