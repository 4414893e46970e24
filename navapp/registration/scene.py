"""What was measured, ready to be registered to."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from navapp.geometry.transform import FloatArray
from navapp.registration.lookup_kernels import SceneGrid, fill_scene_grid
from navapp.registration.pairing_kernels import SceneArrays
from navapp.values import SurfaceCloud

_VOXEL_MM = 6.0
_GRID_MARGIN_MM = 6.0
# A scene that is wider than this many voxels gets larger ones: clutter far away costs nothing then.
_MOST_VOXELS = 64


@dataclass(frozen=True, eq=False)
class Scene:
    """Points of a surface, the place that they were seen from, and how exact they are.

    Attributes:
        points_mm: (N, 3) in the scene's frame.
        camera_mm: (3,) where it was seen from; None when unknown: then every model point may pair.
        sigma_ray_mm: (N,) standard deviation along the ray of sight (in all directions without a
            camera); None when unknown: it is then taken from the residuals.
        n_sharing_errors: so many neighbouring points have their errors in common and count as one.
        thinned_to: the search from far uses about so many points.
    """

    points_mm: FloatArray
    camera_mm: FloatArray | None = None
    sigma_ray_mm: FloatArray | None = None
    n_sharing_errors: float = 1.0
    thinned_to: int = 750

    @classmethod
    def from_stereo(cls, cloud: SurfaceCloud, correlation_px: float) -> "Scene":
        """A cloud of the stereo camera, which stands at the origin.

        Args:
            cloud: in the rectified left camera.
            correlation_px: distance in the picture over which the matcher's errors go together.
        """
        n_sharing_errors = max(1.0, (correlation_px / cloud.stride_px) ** 2)
        return cls(cloud.points_mm, np.zeros(3), cloud.sigma_ray_mm, n_sharing_errors)

    def __len__(self) -> int:
        return len(self.points_mm)

    @property
    def knows_noise(self) -> bool:
        """Whether the points say how exact they are."""
        return self.sigma_ray_mm is not None

    @property
    def every(self) -> int:
        """The search from far uses every n-th point."""
        return max(1, -(-len(self.points_mm) // self.thinned_to))

    @cached_property
    def arrays(self) -> SceneArrays:
        """What the compiled loops read."""
        none = np.zeros(len(self.points_mm))
        return SceneArrays(
            np.ascontiguousarray(self.points_mm, dtype=np.float64),
            none if self.sigma_ray_mm is None else np.ascontiguousarray(self.sigma_ray_mm),
            np.zeros(3) if self.camera_mm is None else np.asarray(self.camera_mm, dtype=np.float64),
            self.camera_mm is not None,
        )

    @cached_property
    def grid(self) -> SceneGrid:
        """Which point is near each place; made when a start is far."""
        points = self.arrays.points[:: self.every]
        low = points.min(axis=0) - _GRID_MARGIN_MM
        size = np.ptp(points, axis=0) + 2.0 * _GRID_MARGIN_MM
        voxel = max(_VOXEL_MM, float(size.max()) / _MOST_VOXELS)
        counts = np.ceil(size / voxel).astype(int) + 1
        grid = SceneGrid(np.full(tuple(counts), -1, dtype=np.int32), low, voxel)
        fill_scene_grid(self.arrays.points, self.every, grid)
        return grid
