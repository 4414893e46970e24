import numpy as np
import pytest

from navapp.preop.volume import CtVolume
from navapp.preop.volume.volume_checks import make_content_warnings, refusal_of


def knee(spacing=(1.0, 1.0, 1.0), size=(90, 90, 90), flesh_hu=50):
    """Air around a block of flesh with a block of bone."""
    n_i, n_j, n_k = size
    hu = np.full((n_k, n_j, n_i), -1000, dtype=np.int16)
    hu[:, n_j // 4 : -n_j // 4, n_i // 4 : -n_i // 4] = flesh_hu
    hu[:, n_j // 3 : -n_j // 3, n_i // 3 : -n_i // 3] = 1200
    return CtVolume(hu, np.diag([*spacing, 1.0]), np.array(spacing))


def test_a_good_ct_has_nothing_to_say():
    assert refusal_of(knee()) is None
    assert make_content_warnings(knee()) == []


def test_air_and_padding_only_are_refused():
    volume = knee()
    noise = np.random.default_rng(0).normal(-1000, 30, volume.hu.shape)
    air = CtVolume(noise.astype(np.int16), volume.lps_from_index, volume.spacing_mm)
    assert "air only" in refusal_of(air)[0]
    # A few dead detector pixels are no patient.
    air.hu[0, 0, :9] = 400
    assert "air only" in refusal_of(air)[0]
    volume.hu[:] = -1024
    assert "padding only" in refusal_of(volume)[0]


def test_a_thin_leg_in_a_wide_picture_is_not_air():
    volume = knee(size=(200, 200, 90))
    volume.hu[:] = -1000
    volume.hu[:, 90:110, 90:110] = 0
    assert refusal_of(volume) is None


@pytest.mark.parametrize("spacing", [(0.001, 0.001, 0.001), (0.5, 0.5, 50.0)])
def test_voxels_of_another_unit_are_refused(spacing):
    assert "no CT has" in refusal_of(knee(spacing))[0]


@pytest.mark.parametrize(
    ("spacing", "is_said"),
    [
        ((0.5, 0.5, 1.0), False),
        ((0.5, 0.5, 1.5), False),
        ((0.5, 0.5, 1.6), True),
        ((0.3, 0.3, 1.2), True),
        ((3.0, 3.0, 3.0), True),
    ],
)
def test_coarse_or_long_voxels_are_said(spacing, is_said):
    size = tuple(int(np.ceil(81.0 / step)) for step in spacing)
    said = make_content_warnings(knee(spacing, size))
    assert any("voxels are" in warning for warning in said) == is_said
    assert len(said) == is_said


def test_metal_is_said_with_its_volume():
    volume = knee()
    volume.hu[40:50, 40:50, 40:50] = 3071
    (said,) = make_content_warnings(volume)
    assert said.startswith("metal: 1 cm3")
    volume.hu[40:50, 40:50, 40:50] = 3070
    assert make_content_warnings(volume) == []


def test_a_small_field_of_view_is_said():
    (said,) = make_content_warnings(knee(size=(90, 90, 79)))
    assert "90 x 90 x 79 mm, too small" in said


def test_values_without_air_are_said():
    volume = knee()
    volume.hu[volume.hu < 0] = 0
    (said,) = make_content_warnings(volume)
    assert "may not be Hounsfield" in said
