"""Writes a volume as NIfTI, as `read_ct` reads it."""

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from navapp.preop.volume.itk_package import import_simple_itk


def write_nifti(
    path: str | Path, hounsfield: NDArray[np.int16], spacing_mm: ArrayLike, origin_mm: ArrayLike
) -> None:
    """Write an upright volume.

    Args:
        path: ends in .nii or, compressed, in .nii.gz.
        hounsfield: (D, H, W), axes k, j, i.
        spacing_mm: (3,) of the voxels along x, y, z.
        origin_mm: (3,) centre of the first voxel, LPS.
    """
    sitk = import_simple_itk()
    image = sitk.GetImageFromArray(hounsfield)
    image.SetSpacing(np.asarray(spacing_mm, dtype=np.float64).tolist())
    image.SetOrigin(np.asarray(origin_mm, dtype=np.float64).tolist())
    sitk.WriteImage(image, str(path), str(path).endswith(".gz"))
