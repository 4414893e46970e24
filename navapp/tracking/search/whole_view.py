"""The search for a bone without a pose: in an operator's box, or in the whole view."""

import numpy as np

from navapp.geometry.box import Box
from navapp.geometry.directions import ViewCone
from navapp.geometry.rectification import Image, RectifiedPair, luma
from navapp.registration import Scene, ScoredPose, find_initial
from navapp.stereo import match_surface
from navapp.tracking.surface_meter import FREE_CORRELATION_PX, SurfaceMeter
from navapp.values import AspectGraph, Prior
from navapp.values.progress import Progress

# All chosen. An operator's box may cut the bone: so much of its size is added on each side.
_SPARE_FRACTION = 0.15
# Measured points are thinned to about so many.
_MOST_POINTS = 40_000
# Distortion bends the box's sides: it is projected as a grid of so many points a side.
_SAMPLES_PER_SIDE = 9


class WholeViewSearch:
    """Searches for one bone in an operator's box or in all that the cameras see.

    Without aspects (edges of the bone, seen from the prior's cone) only the surface counts.
    """

    def __init__(self, meter: SurfaceMeter, aspects: AspectGraph | None) -> None:
        self._meter, self._aspects = meter, aspects

    def rectify(self, left: Image, right: Image, prior: Prior) -> RectifiedPair:
        """Both pictures; the box of the pair is the prior's, or the whole view without one."""
        return self._meter.rectifier.rectify(luma(left), luma(right), self._box(prior))

    def find_poses(
        self, pair: RectifiedPair, prior: Prior, on_progress: Progress
    ) -> list[ScoredPose]:
        """Where the bone may be: rectified left camera from bone, best first.

        `on_progress` is told the fraction done; it may raise to cancel.
        """
        if pair.box.is_empty:
            return []
        geometry, model = self._meter.geometry, self._meter.model
        found = match_surface(pair, self._meter.band_px, fills=False).disparity
        stride_px = max(1, int(np.ceil((found.n_matched / _MOST_POINTS) ** 0.5)))
        cloud = found.reproject(geometry, stride_px)
        scene = Scene.from_stereo(cloud, FREE_CORRELATION_PX)
        cone = prior.cones.get(model.bone.name, ViewCone())
        return find_initial(pair, scene, model, cone, self._aspects, on_progress=on_progress)

    def _box(self, prior: Prior) -> Box | None:
        """The prior's box in the rectified left view, with what it may have cut."""
        if prior.box is None:
            return None
        x, y, width, height = prior.box
        spare_x, spare_y = _SPARE_FRACTION * width, _SPARE_FRACTION * height
        columns = np.linspace(x - spare_x, x + width - 1 + spare_x, _SAMPLES_PER_SIDE)
        rows = np.linspace(y - spare_y, y + height - 1 + spare_y, _SAMPLES_PER_SIDE)
        pixels = np.stack(np.meshgrid(columns, rows), axis=-1).reshape(-1, 2)
        rays = self._meter.rectifier.rig.left.rays(pixels)
        geometry = self._meter.geometry
        around = Box.around(geometry.project(geometry.rectified_from_left.rotate(rays)))
        return Box(0, 0, 0, 0) if around is None else around
