"""A volume that is written as NIfTI is read back in its place."""

from pathlib import Path

import numpy as np
import pytest

from navapp.preop.volume import read_ct
from navapp.preop.volume.volume_writing import write_nifti

SPACING_MM, ORIGIN_MM = (6.0, 7.0, 8.0), (-90.0, -80.0, -110.5)


@pytest.mark.parametrize("name", ["ct.nii", "ct.nii.gz"])
def test_values_and_places_come_back(name: str, tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    hounsfield = rng.integers(-1000, 1500, (14, 16, 18), dtype=np.int16)
    write_nifti(tmp_path / name, hounsfield, SPACING_MM, ORIGIN_MM)
    volume = read_ct(tmp_path / name).volume
    np.testing.assert_array_equal(volume.hu, hounsfield)
    corner = volume.points_lps_mm([[0, 0, 0], [1, 2, 3]])
    np.testing.assert_allclose(corner[0], ORIGIN_MM, atol=1e-4)
    np.testing.assert_allclose(corner[1] - corner[0], (6.0, 14.0, 24.0), atol=1e-4)


def test_only_the_name_with_gz_is_compressed(tmp_path: Path) -> None:
    hounsfield = np.zeros((14, 16, 18), np.int16)
    for name in ("ct.nii", "ct.nii.gz"):
        write_nifti(tmp_path / name, hounsfield, SPACING_MM, ORIGIN_MM)
    assert (tmp_path / "ct.nii").stat().st_size > hounsfield.nbytes
    assert (tmp_path / "ct.nii.gz").stat().st_size < 1000
