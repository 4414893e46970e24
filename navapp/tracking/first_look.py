"""A bone looked for without a pose: in an operator's box, or in the whole view."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from navapp.geometry.box import Box
from navapp.geometry.directions import ViewCone
from navapp.geometry.rectification import Image, RectifiedPair, Rectifier, luma
from navapp.geometry.transform import RigidTransform
from navapp.registration import (
    Candidate,
    RegistrationModel,
    Scene,
    find_initial,
    is_same_pose,
)
from navapp.stereo import match_surface, reproject
from navapp.tracking.follower import Fit
from navapp.tracking.surface_meter import FREE_CORRELATION_PX
from navapp.values import AspectGraph, Prior, Reason

# An operator's box may cut the bone: so much more is looked at, of its size.
_SPARE_SHARE = 0.15
_MOST_POINTS = 40_000
_EDGE_SAMPLES = 9
# A different pose that explains as much as this of the best one makes that one a guess.
AMBIGUOUS_SHARE = 0.9


class FirstLook:
    """Looks for one bone under one rig; holds only what is constant."""

    def __init__(
        self,
        rectifier: Rectifier,
        model: RegistrationModel,
        depth_mm: tuple[float, float],
        aspects: AspectGraph | None,
    ) -> None:
        """Join what is looked for and where.

        Args:
            rectifier: of the rig's pictures.
            model: of the bone.
            depth_mm: nearest and farthest surface that the rig is used for.
            aspects: edges of the bone, of at least the prior's cone.
        """
        self._rectifier = rectifier
        self._model = model
        self._depth_mm = depth_mm
        self._aspects = aspects

    def candidates(
        self, left: Image, right: Image, prior: Prior, on_progress: Callable[[float], None]
    ) -> tuple[RectifiedPair, list[Candidate]]:
        """The rectified pictures, and where the bone may be in them: rectified camera from bone.

        Args:
            left: picture of the left camera.
            right: of the right one.
            prior: its box, or the whole view without one; its cone counts for the femur only.
            on_progress: told the share done; may raise to cancel.
        """
        geometry = self._rectifier.geometry
        pair = self._rectifier.rectify(luma(left), luma(right), self._box(prior))
        if pair.box.is_empty:
            return pair, []
        near_mm, far_mm = self._depth_mm
        band_px = (geometry.disparity_px(far_mm), geometry.disparity_px(near_mm))
        found = match_surface(pair, band_px, fills=False).disparity
        n_matched = found.matched_share * found.origin.size
        stride_px = max(1, int(np.ceil((n_matched / _MOST_POINTS) ** 0.5)))
        scene = Scene.from_stereo(reproject(found, geometry, stride_px), FREE_CORRELATION_PX)
        axis = prior.axis_for(self._model.bone.name)
        cone = ViewCone() if axis is None else ViewCone(axis, prior.approach_half_angle_deg)
        candidates = find_initial(
            pair, scene, self._model, cone, self._aspects, on_progress=on_progress
        )
        return pair, candidates

    def _box(self, prior: Prior) -> Box | None:
        """The prior's box in the rectified left view, with what it may have cut."""
        if prior.box is None:
            return None
        x, y, width, height = prior.box
        spare_x, spare_y = _SPARE_SHARE * width, _SPARE_SHARE * height
        columns = np.linspace(x - spare_x, x + width - 1 + spare_x, _EDGE_SAMPLES)
        rows = np.linspace(y - spare_y, y + height - 1 + spare_y, _EDGE_SAMPLES)
        # Distortion bends the box's sides.
        pixels = np.stack(np.meshgrid(columns, rows), axis=-1).reshape(-1, 2)
        rays = self._rectifier.rig.left.rays(pixels)
        geometry = self._rectifier.geometry
        around = Box.around(geometry.project(geometry.rectified_from_left.rotate(rays)))
        return Box(0, 0, 0, 0) if around is None else around


def doubted(fits: list[Fit], scores: list[float], model: RegistrationModel) -> list[Fit]:
    """The fits, best first; the best one says so when a different one explains as much.

    Args:
        fits: of different candidates.
        scores: how much of the model each explains.
        model: of the bone.
    """
    order = np.argsort([-score for score in scores], kind="stable")
    ranked = [fits[k] for k in order]
    if len(ranked) < 2 or scores[order[0]] <= 0.0:
        return ranked
    best = ranked[0]
    is_guess = any(
        scores[k] >= AMBIGUOUS_SHARE * scores[order[0]]
        and not is_same_pose(best.pose, fits[k].pose, model.centre_mm)
        for k in order[1:]
    )
    if not is_guess:
        return ranked
    return [replace(best, estimate=best.estimate.doubted(Reason.AMBIGUOUS)), *ranked[1:]]


def poses_to_refine(
    candidates: list[Candidate], n: int, least_share: float
) -> list[RigidTransform]:
    """Of the candidates that explain enough beside the best, at most n."""
    least = least_share * max((one.score for one in candidates), default=0.0)
    return [one.scene_from_bone for one in candidates[:n] if one.score >= least]
