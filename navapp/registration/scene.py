"""What was measured, ready to be registered to."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from navapp.geometry.transform import FloatArray
from navapp.registration.lookup_kernels import VoxelGrid, fill_scene_grid
from navapp.registration.pairing_kernels import SceneArrays
from navapp.values import SurfaceCloud

# Of the grid; all chosen.
_VOXEL_MM, _GRID_MARGIN_MM, _MOST_VOXELS = 6.0, 6.0, 64

# No place has a point near it.
NO_GRID = VoxelGrid(np.full((1, 1, 1), -1, dtype=np.int32), np.zeros(3), 1.0)


@dataclass(frozen=True, eq=False)
class Scene:
    """Points of a surface, the place that they were seen from, and how exact they are.

    Raises:
        ValueError: points of another shape, or not finite.
    """

    points_mm: FloatArray  # (N, 3) in the scene's frame
    # (3,) where it was seen from; None when unknown: then every model point may pair.
    camera_mm: FloatArray | None = None
    # (N,) standard deviation along the ray of sight (in all directions without a camera); None when
    # unknown: the residuals then tell it.
    sigma_ray_mm: FloatArray | None = None
    # so many neighbouring points have their errors in common and count as one.
    n_sharing_errors: float = 1.0
    tells_shape: bool = False  # a fit to it tells size and cartilage beside the pose
    thinned_to: int = 500  # the coarse loop uses about so many points

    @classmethod
    def from_stereo(
        cls, cloud: SurfaceCloud, correlation_px: float, *, tells_shape: bool = False
    ) -> "Scene":
        """A cloud in the rectified left camera, whose errors go together over a distance.

        `tells_shape`: as of the scene.
        """
        n_sharing_errors = max(1.0, (correlation_px / cloud.stride_px) ** 2)
        return cls(cloud.points_mm, np.zeros(3), cloud.sigma_ray_mm, n_sharing_errors, tells_shape)

    def __post_init__(self) -> None:
        points = np.asarray(self.points_mm)
        if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
            raise ValueError("a scene's points must be finite and of shape (N, 3)")

    def __len__(self) -> int:
        return len(self.points_mm)

    @property
    def knows_noise(self) -> bool:
        """Whether the points say how exact they are."""
        return self.sigma_ray_mm is not None

    @property
    def every(self) -> int:
        """The coarse loop uses every n-th point."""
        return max(1, -(-len(self.points_mm) // self.thinned_to))

    @cached_property
    def arrays(self) -> SceneArrays:
        """What the compiled loops read, shuffled: thinned rows would be a few columns.

        The points that thinning keeps, and the others, each keep their order: where near points
        follow each other, look-ups in the model are faster.
        """
        n = len(self.points_mm)
        order, (is_kept, is_other) = np.random.default_rng(n).permutation(n), np.ones((2, n), bool)
        is_kept[order], is_other[:: self.every] = np.arange(n) % self.every == 0, False
        order[:: self.every], order[is_other] = np.flatnonzero(is_kept), np.flatnonzero(~is_kept)
        sigma = np.zeros(n) if self.sigma_ray_mm is None else self.sigma_ray_mm
        return SceneArrays(
            np.ascontiguousarray(self.points_mm.take(order, axis=0), dtype=np.float64),
            np.ascontiguousarray(sigma[order], dtype=np.float64),
            np.zeros(3) if self.camera_mm is None else np.asarray(self.camera_mm, dtype=np.float64),
            self.camera_mm is not None,
            self.knows_noise,
            self.every,
        )

    @cached_property
    def grid(self) -> VoxelGrid:
        """Which point is near each place; stray points far from the middle are left out."""
        points = self.arrays.points[:: self.every]
        middle, half = np.median(points, axis=0), 0.5 * _MOST_VOXELS * _VOXEL_MM
        low = np.maximum(points.min(axis=0) - _GRID_MARGIN_MM, middle - half)
        high = np.minimum(points.max(axis=0) + _GRID_MARGIN_MM, middle + half)
        counts = np.ceil((high - low) / _VOXEL_MM).astype(int) + 1
        grid = VoxelGrid(np.full(tuple(counts), -1, dtype=np.int32), low, _VOXEL_MM)
        fill_scene_grid(self.arrays.points, self.every, grid)
        return grid
