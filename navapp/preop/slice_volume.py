"""A CT, or a segmentation, as grey values on the grid of slices: to look at, not to measure in."""

import zipfile
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from navapp.errors import PlanError
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import FloatArray
from navapp.preop.slices import Direction, Picture, SliceGrid, make_grid
from navapp.preop.volume import CtVolume, LabelVolume

# From fat to dense cortex.
BLACK_HU, WHITE_HU = -200.0, 1400.0
_FORMAT = 1


@dataclass(frozen=True, slots=True, eq=False)
class SliceVolume:
    """Grey values on a grid, or the grid alone where there is no CT.

    Raises:
        ValueError: the grey values are not those of the grid.
    """

    grid: SliceGrid
    grey: NDArray[np.uint8] | None = None  # (n_z, n_y, n_x)
    # HU of black and of white; None for a segmentation.
    range_hu: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        if self.grey is not None and (
            self.grey.dtype != np.uint8 or self.grey.shape != self.grid.size[::-1]
        ):
            raise ValueError("the grey values are not those of the grid")

    def slice_of(self, direction: Direction, index: int) -> Picture:
        """(h, w) grey, as it is seen; black without a CT."""
        if self.grey is None:
            return np.zeros(self.grid.shape_of(direction), dtype=np.uint8)
        plane: Picture = np.take(self.grey, index, axis=2 - direction.axis)
        return plane if direction.is_down else plane[::-1]


def make_slice_volume(
    volume: CtVolume | LabelVolume, meshes: Sequence[TriangleMesh], step_mm: float = 1.0
) -> SliceVolume:
    """The region around surfaces, in grey.

    Args:
        volume: recorded in any direction, also leaning or left-handed.
        meshes: LPS mm.
        step_mm: of the grid.
    """
    grid = make_grid(meshes, make_bounds(volume), step_mm)
    range_hu = (BLACK_HU, WHITE_HU) if isinstance(volume, CtVolume) else None
    return SliceVolume(grid, sample_grey(volume, grid), range_hu)


def make_bounds(volume: CtVolume | LabelVolume) -> FloatArray:
    """(2, 3) LPS mm: the lowest and the highest coordinates of a volume's voxels."""
    corners_mm = volume.points_lps_mm(_make_corners(volume.size))
    return np.stack([corners_mm.min(axis=0), corners_mm.max(axis=0)])


def _make_corners(size: Sequence[int]) -> NDArray[np.int_]:
    """(8, 3) indices."""
    ends = np.meshgrid(*((0, n - 1) for n in size))
    return np.stack(ends, axis=-1).reshape(-1, 3)


def sample_grey(volume: CtVolume | LabelVolume, grid: SliceGrid) -> NDArray[np.uint8]:
    """(n_z, n_y, n_x) grey at the cubes of a grid; black outside the volume.

    A CT with finer voxels is the mean of eight places in each cube. Labels are those of the nearest
    voxel: there is nothing between two of them.
    """
    from scipy.ndimage import affine_transform

    is_ct = isinstance(volume, CtVolume)
    n = 2 if is_ct and float(volume.spacing_mm.min()) < 0.75 * grid.step_mm else 1
    finer_mm = grid.step_mm / n
    first_mm = np.array(grid.origin_mm) - 0.5 * (n - 1) * finer_mm
    linear = volume.index_from_lps[:3, :3] * finer_mm
    origin = volume.indices_of(first_mm[None])[0]
    grey, lower = _grey_around(volume, linear, origin, n * np.array(grid.size))
    # The array's axes are k, j, i, and those of the grey values z, y, x.
    sampled = affine_transform(
        grey,
        linear[::-1, ::-1],
        (origin - lower)[::-1],
        tuple(n * count for count in grid.size[::-1]),
        order=1 if is_ct else 0,
    )
    if n == 1:
        return np.asarray(sampled, dtype=np.uint8)
    n_x, n_y, n_z = grid.size
    # Slab by slab: in one go the sums would need eight times the room.
    blocks = sampled.reshape(n_z, n, n_y, n, n_x, n)
    means = [slab.mean(axis=(0, 2, 4), dtype=np.float32) for slab in blocks]
    return np.asarray(np.rint(np.stack(means)), dtype=np.uint8)


def _grey_around(
    volume: CtVolume | LabelVolume, linear: FloatArray, origin: FloatArray, size: NDArray[np.int_]
) -> tuple[NDArray[np.uint8], FloatArray]:
    """The voxels that are needed, in grey, and the index of the first of them."""
    corners = origin + _make_corners(size.tolist()) @ linear.T
    most = np.array(volume.size)
    lower = np.clip(np.floor(corners.min(axis=0)) - 1, 0, most - 1).astype(int)
    upper = np.clip(np.ceil(corners.max(axis=0)) + 2, lower + 1, most).astype(int)
    return _to_grey(volume, volume.crop(lower, upper)), lower.astype(np.float64)


def _to_grey(whole: CtVolume | LabelVolume, part: CtVolume | LabelVolume) -> NDArray[np.uint8]:
    if isinstance(part, CtVolume):
        share = (part.hu.astype(np.float32) - BLACK_HU) / (WHITE_HU - BLACK_HU)
    else:
        highest = whole.labels.max() if isinstance(whole, LabelVolume) else 1
        share = part.labels.astype(np.float32) / max(float(highest), 1.0)
    grey: NDArray[np.uint8] = np.rint(255.0 * np.clip(share, 0.0, 1.0)).astype(np.uint8)
    return grey


def write_slices(path: str | Path, volume: SliceVolume) -> None:
    """Write a volume with grey values as `.npz`."""
    if volume.grey is None:
        raise ValueError("there are no grey values to write")
    with Path(path).open("wb") as file:
        np.savez_compressed(
            file,
            format=np.array(_FORMAT),
            grey=volume.grey,
            origin_mm=np.array(volume.grid.origin_mm),
            step_mm=np.array(volume.grid.step_mm),
            range_hu=np.array(volume.range_hu or ()),
        )


def read_slices(path: str | Path) -> SliceVolume:
    """Read what `write_slices` wrote.

    Raises:
        PlanError: missing, or no such file.
    """
    path = Path(path)
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as content:
            return _parse(content)
    except (
        OSError, EOFError, ValueError, KeyError, TypeError, zipfile.BadZipFile, zlib.error,
    ) as error:  # fmt: skip
        raise PlanError(
            f"slices {path} cannot be read ({error})",
            subject=str(path),
            remedy="make the plan again with `navapp plan`",
        ) from error


def _parse(content: Any) -> SliceVolume:
    if int(content["format"]) != _FORMAT:
        raise ValueError(f"format {content['format']}")
    grey, (x, y, z) = content["grey"], content["origin_mm"].tolist()
    n_z, n_y, n_x = grey.shape
    grid = SliceGrid((x, y, z), float(content["step_mm"]), (n_x, n_y, n_z))
    if not len(content["range_hu"]):
        return SliceVolume(grid, grey)
    black_hu, white_hu = content["range_hu"].tolist()
    if not black_hu < white_hu:
        raise ValueError("white is not denser than black")
    return SliceVolume(grid, grey, (black_hu, white_hu))
