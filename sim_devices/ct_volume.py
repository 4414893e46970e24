"""A CT of the simulated knee, whose bone surfaces are those of the meshes."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.transform import FloatArray
from sim_devices.anatomy import KneeAnatomy
from sim_devices.cartilage import smoothstep
from sim_devices.surface_nets import Grid, sample

VolumeArray = NDArray[np.float32]

AIR_HU, FAT_HU, SOFT_HU, JOINT_HU, TABLE_HU = -1000.0, -95.0, 50.0, 100.0, 300.0
CORTEX_HU, TRABECULAR_HU, MARROW_HU = 1200.0, 250.0, -50.0
END_MARGIN_MM = 6.0


@dataclass(frozen=True, slots=True, eq=False)
class CtVolume:
    """A CT; voxel (i, j, k) lies at origin + direction @ (spacing * (i, j, k)), LPS mm."""

    hounsfield: NDArray[np.int16]  # (nz, ny, nx) int16, so hounsfield[k, j, i]
    spacing_mm: FloatArray  # (3,) along x, y, z
    origin_mm: FloatArray  # (3,) centre of the first voxel
    direction: FloatArray  # (3, 3) columns are the directions of i, j, k


def make_ct(
    anatomy: KneeAnatomy,
    spacing_mm: tuple[float, float, float] = (0.5, 0.5, 0.8),
    seed: int = 0,
    psf_sigma_mm: float = 0.5,
    noise_hu: float = 20.0,
) -> CtVolume:
    """Scan the knee: partial volumes, point spread and Gaussian noise included.

    The volume ends a few millimetres beyond the cut ends of the bones, which are closed in it as
    they are in the meshes.
    """
    from scipy.ndimage import gaussian_filter

    spacing = np.asarray(spacing_mm, dtype=np.float64)
    grid = _scan_grid(anatomy, spacing)
    volume = _leg_and_table(anatomy, grid)
    for bone in anatomy.bones:
        _put_bone(volume, grid, anatomy, bone)
    volume = gaussian_filter(volume, psf_sigma_mm / spacing[::-1], mode="nearest", truncate=3.0)
    if noise_hu > 0.0:
        noise = np.random.default_rng([seed, 4]).standard_normal(volume.shape, dtype=np.float32)
        noise *= np.float32(noise_hu)
        volume += noise
    np.clip(np.rint(volume, out=volume), -1024.0, 3071.0, out=volume)
    return CtVolume(volume.astype(np.int16), spacing, grid.origin_mm, np.eye(3))


def _scan_grid(anatomy: KneeAnatomy, spacing: FloatArray) -> Grid:
    """The voxels: from the tibia's to the femur's end, with the leg and the table in them."""
    size = np.abs(anatomy.scale)
    z_low = anatomy.bones["tibia"].vertices_mm[:, 2].min() - END_MARGIN_MM
    z_high = anatomy.bones["femur"].vertices_mm[:, 2].max() + END_MARGIN_MM
    lower = np.array([-72.0 * size[0], -74.0 * size[1], z_low])
    upper = np.array([72.0 * size[0], 96.0 * size[1], z_high])
    nx, ny, nz = (int(n) for n in np.ceil((upper - lower) / spacing) + 1)
    return Grid(lower, spacing, (nx, ny, nz))


def _axes(grid: Grid) -> list[FloatArray]:
    """The coordinates of the voxels along x, y and z."""
    return [grid.origin_mm[a] + grid.spacing_mm[a] * np.arange(grid.shape[a]) for a in range(3)]


def _mix(
    volume: VolumeArray, inside: NDArray[np.floating], value: float | VolumeArray
) -> VolumeArray:
    """The volume with a part (0 to 1) of each voxel replaced by another material."""
    result: VolumeArray = (volume + inside * (value - volume)).astype(np.float32)
    return result


def _leg_and_table(anatomy: KneeAnatomy, grid: Grid) -> VolumeArray:
    """(nz, ny, nx) everything but the bones, slice by slice."""
    x, y, z = _axes(grid)
    x, y, z = x / anatomy.scale[0], y / abs(anatomy.scale[1]), z / abs(anatomy.scale[2])
    voxel = float(grid.spacing_mm[0])
    across, along = x[None, :], y[:, None]
    plate = np.abs(along - 88.0 + 0.0012 * across**2) - 2.5
    empty = np.full((len(y), len(x)), AIR_HU, dtype=np.float32)
    empty = _mix(empty, np.clip(0.5 - plate / voxel, 0.0, 1.0), TABLE_HU)
    volume = np.empty((len(z), len(y), len(x)), dtype=np.float32)
    for k, height in enumerate(z):
        wide = 62.0 + 0.05 * height + 4.0 * np.exp(-((height / 35.0) ** 2))
        deep = 60.0 + 0.06 * height + 2.0 * np.exp(-((height / 35.0) ** 2))
        fat = 7.0 + 0.02 * height + 2.0 * across / wide
        level = np.hypot(across / wide, (along - 6.0) / deep)
        skin = (level - 1.0) * min(wide, deep)
        part = _mix(empty, np.clip(0.5 - skin / voxel, 0.0, 1.0), FAT_HU)
        part = _mix(part, np.clip(0.5 - (skin + fat) / voxel, 0.0, 1.0), SOFT_HU)
        for centre, radii in (((0.0, 8.0, -28.0), (37.0, 27.0, 12.0)), _BEHIND_PATELLA):
            offset = ((height - centre[2]) / radii[2]) ** 2
            if offset < 1.0:
                ball = ((across - centre[0]) / radii[0]) ** 2 + (
                    (along - centre[1]) / radii[1]
                ) ** 2
                part = _mix(part, smoothstep(1.0, 0.9, ball + offset), JOINT_HU)
        volume[k] = part
    return volume


_BEHIND_PATELLA = ((-2.0, -27.0, 8.0), (20.0, 11.0, 22.0))


def _put_bone(volume: VolumeArray, grid: Grid, anatomy: KneeAnatomy, bone: str) -> None:
    """Composite one bone into the volume: cortical shell, spongy bone, marrow in the shaft."""
    vertices = anatomy.bones[bone].vertices_mm
    first = np.floor((vertices.min(axis=0) - 3.0 - grid.origin_mm) / grid.spacing_mm)
    first = np.maximum(first.astype(int), 0)
    last = np.ceil((vertices.max(axis=0) + 3.0 - grid.origin_mm) / grid.spacing_mm).astype(int)
    last = np.minimum(last, np.array(grid.shape) - 1)
    nx, ny, nz = (int(n) for n in last - first + 1)
    part = Grid(grid.points(first), grid.spacing_mm, (nx, ny, nz))
    values = np.ascontiguousarray(sample(anatomy.solids[bone], part).T).astype(np.float32)
    slopes = np.gradient(values, *grid.spacing_mm[::-1].astype(np.float32))
    steepness = np.clip(np.sqrt(sum(slope * slope for slope in slopes)), 0.5, 2.0)
    distance = values / steepness
    # The extent of a voxel along the surface normal: how fast its filled part changes.
    width = sum(
        np.abs(slope) * np.float32(step)
        for slope, step in zip(slopes, grid.spacing_mm[::-1], strict=True)
    )
    width = np.maximum(width / steepness, 0.3)
    from_joint = _distance_from_joint(anatomy, bone, _axes(part)[2])[:, None, None]
    cortex = 1.0 + 1.5 * smoothstep(5.0, 55.0, from_joint)
    spongy = TRABECULAR_HU + (MARROW_HU - TRABECULAR_HU) * smoothstep(40.0, 70.0, from_joint)
    outer = np.clip(0.5 - distance / width, 0.0, 1.0)
    inner = np.clip(0.5 - (distance + cortex) / width, 0.0, 1.0)
    box = tuple(slice(int(a), int(b) + 1) for a, b in zip(first[::-1], last[::-1], strict=True))
    filled = CORTEX_HU + inner * (spongy - CORTEX_HU)
    volume[box] = _mix(volume[box], outer, filled.astype(np.float32))


def _distance_from_joint(anatomy: KneeAnatomy, bone: str, z_mm: FloatArray) -> FloatArray:
    """Height above (femur) or depth below (tibia) the joint; small for the patella."""
    if bone == "femur":
        return z_mm
    if bone == "tibia":
        depth: FloatArray = float(anatomy.landmarks["tibia/medial_plateau"][2]) - z_mm
        return depth
    return np.full_like(z_mm, 15.0)
