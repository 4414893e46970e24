"""Volumes: an array of voxels and the affine map from indices to LPS mm."""

from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from navapp.geometry.transform import FloatArray, read_only

_LAST_ROW = (0.0, 0.0, 0.0, 1.0)


class _Placed:
    """A volume's place. Indices are (i, j, k): against the array's axes k, j, i.

    `lps_from_index` is any invertible affine map: its axes may be oblique, left-handed (flips of a
    NIfTI file), and not at right angles (a tilted gantry: the step from slice to slice leans, and
    is kept as it was recorded instead of resampling the voxels). Whoever takes distances or
    gradients takes them in LPS: scaling the indices by `spacing_mm` is wrong for a leaning stack.
    """

    __slots__ = ()

    lps_from_index: FloatArray
    spacing_mm: FloatArray

    @property
    def _voxels(self) -> NDArray[Any]:
        raise NotImplementedError

    def _with_voxels(self, voxels: NDArray[Any], lps_from_index: FloatArray) -> Self:
        raise NotImplementedError

    def _place(self) -> None:
        """Check a volume's place and freeze it; the voxels, which are large, stay as given."""
        matrix, spacing = read_only(self.lps_from_index), read_only(self.spacing_mm)
        if (
            matrix.shape != (4, 4)
            or not np.isfinite(matrix).all()
            or (matrix[3] != _LAST_ROW).any()
        ):
            raise ValueError("lps_from_index must be a finite affine 4x4 matrix")
        if self._voxels.ndim != 3 or self._voxels.size == 0:
            raise ValueError("a volume has three axes and at least one voxel")
        if spacing.shape != (3,) or not np.allclose(spacing, compute_steps_mm(matrix), rtol=1e-6):
            raise ValueError("spacing_mm must be the lengths of the matrix's columns")
        if not is_invertible(matrix):
            raise ValueError("the axes of lps_from_index lie in one plane")
        object.__setattr__(self, "lps_from_index", matrix)
        object.__setattr__(self, "spacing_mm", spacing)

    @property
    def size(self) -> tuple[int, int, int]:
        """Voxels along i, j, k."""
        n_k, n_j, n_i = self._voxels.shape
        return n_i, n_j, n_k

    @property
    def index_from_lps(self) -> FloatArray:
        """(4, 4) inverse of `lps_from_index`."""
        return np.linalg.inv(self.lps_from_index).astype(np.float64)

    def points_lps_mm(self, indices_ijk: ArrayLike) -> FloatArray:
        """(N, 3) LPS points of (N, 3) indices, which need not be whole."""
        return _map_points(self.lps_from_index, indices_ijk)

    def indices_of(self, points_lps_mm: ArrayLike) -> FloatArray:
        """(N, 3) fractional indices i, j, k of (N, 3) LPS points; also outside the volume."""
        return _map_points(self.index_from_lps, points_lps_mm)

    def crop(self, lower_ijk: ArrayLike, upper_ijk: ArrayLike) -> Self:
        """A copy of the voxels from `lower_ijk` up to, without, `upper_ijk`, at the same place.

        Raises:
            ValueError: the box is empty or reaches beyond the volume.
        """
        lower = np.array(lower_ijk, dtype=np.intp)
        upper = np.array(upper_ijk, dtype=np.intp)
        if (lower < 0).any() or (upper > self.size).any() or (lower >= upper).any():
            raise ValueError(f"box {lower} to {upper} is not inside a volume of {self.size}")
        (i0, j0, k0), (i1, j1, k1) = lower.tolist(), upper.tolist()
        matrix = self.lps_from_index.copy()
        matrix[:3, 3] = self.points_lps_mm(lower[None])[0]
        return self._with_voxels(self._voxels[k0:k1, j0:j1, i0:i1].copy(), matrix)


@dataclass(frozen=True, slots=True, eq=False)
class CtVolume(_Placed):
    """A CT in Hounsfield units.

    Raises:
        ValueError: wrong shapes or types, or a matrix that cannot be inverted.
    """

    # (D, H, W) int16 or float32, axes k, j, i as in SimpleITK's arrays.
    hu: NDArray[np.int16] | NDArray[np.float32]
    # (4, 4) float64, maps (i, j, k, 1) to LPS mm; voxel centres at integers. Any invertible affine
    # map: see the base class for what it may hold.
    lps_from_index: FloatArray
    spacing_mm: FloatArray  # (3,) lengths of one step along i, j, k

    def __post_init__(self) -> None:
        if self.hu.dtype not in (np.dtype(np.int16), np.dtype(np.float32)):
            raise ValueError(f"HU must be int16 or float32, not {self.hu.dtype}")
        self._place()

    @property
    def _voxels(self) -> NDArray[Any]:
        return self.hu

    def _with_voxels(self, voxels: NDArray[Any], lps_from_index: FloatArray) -> Self:
        return replace(self, hu=voxels, lps_from_index=lps_from_index)


@dataclass(frozen=True, slots=True, eq=False)
class LabelVolume(_Placed):
    """A ready segmentation: a whole number per voxel, 0 for none.

    Raises:
        ValueError: wrong shapes or types, or a matrix that cannot be inverted.
    """

    labels: NDArray[np.integer[Any]]  # (D, H, W) of an integer type, axes k, j, i
    # lps_from_index, spacing_mm: as in `CtVolume`.
    lps_from_index: FloatArray
    spacing_mm: FloatArray

    def __post_init__(self) -> None:
        if not np.issubdtype(self.labels.dtype, np.integer):
            raise ValueError(f"labels must be whole numbers, not {self.labels.dtype}")
        self._place()

    @property
    def _voxels(self) -> NDArray[Any]:
        return self.labels

    def _with_voxels(self, voxels: NDArray[Any], lps_from_index: FloatArray) -> Self:
        return replace(self, labels=voxels, lps_from_index=lps_from_index)


def compute_steps_mm(lps_from_index: FloatArray) -> FloatArray:
    """(3,) lengths of one step along i, j, k."""
    lengths: FloatArray = np.sqrt((lps_from_index[:3, :3] ** 2).sum(axis=0))
    return lengths


def is_invertible(lps_from_index: FloatArray) -> bool:
    """Whether the axes are finite and span a volume.

    At least a thousandth of a box of their lengths: flatter is a direction that is lost, no tilt.
    """
    if not np.isfinite(lps_from_index).all():
        return False
    volume_mm3 = abs(float(np.linalg.det(lps_from_index[:3, :3])))
    return bool(volume_mm3 > 1e-3 * float(compute_steps_mm(lps_from_index).prod()) > 0.0)


def _map_points(matrix: FloatArray, points: ArrayLike) -> FloatArray:
    rows = np.asarray(points, dtype=np.float64)
    mapped: FloatArray = rows @ matrix[:3, :3].T + matrix[:3, 3]
    return mapped
