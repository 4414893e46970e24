"""The first registration without a pose: hypotheses are scored coarse to fine, the best are fitted.

A hypothesis puts a point of the bone on the measured surface, which gives its distance. Look-ups
score how much of the view's surface was measured where it should be, and equations 2 and 3 in both
pictures. The best go through the coarse BiMCC loop and are ranked by what they explain.
"""

from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.bands import in_row_bands, map_both
from navapp.geometry.directions import ViewCone
from navapp.geometry.rectification import RectifiedGeometry, RectifiedPair
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.registration.bimcc import MIN_POINTS, fit_coarsely
from navapp.registration.edge_tables import make_edge_tables
from navapp.registration.hypotheses import (
    Views,
    compute_poses,
    keep_best,
    make_views,
    sample_scene,
    spread_hypotheses,
    thin_views,
    vary_hypotheses,
)
from navapp.registration.model import RegistrationModel
from navapp.registration.multi_start import (
    ANYWHERE_SETTINGS,
    ScoredPose,
    compute_explained_fraction,
    find_distinct,
)
from navapp.registration.scene import Scene
from navapp.registration.score_kernels import Hypotheses, score_edges, score_surface
from navapp.values import AspectGraph
from navapp.values.progress import Progress, tell_part


class Level(NamedTuple):
    """Pictures made `scale` times smaller, the reach of a gradient there, edge points of a view."""

    scale: int
    reach_px: int
    n_points: int


# All chosen on simulated knees other than those of `python -m tests.bench.first_registration`.
_COARSE_STEP_DEG, _ROLL_STEP_DEG = 16.0, 24.0
_COARSE, _FINE = Level(8, 1, 50), Level(4, 2, 120)
# On the measured surface; fewer when there would be more hypotheses than this.
_N_PLACES, _N_HYPOTHESES = 2500, 3_000_000
# A measured depth within this agrees with a hypothesis.
_REACH_MM = 6.0
# So many are scored by their edges too, refined, and fitted.
_N_PASSED, _N_REFINED, _N_FITTED = 8000, 300, 40
# Hypotheses this close end in the same coarse pose; coarse poses this close, in the same fit.
_SAME_START_MM, _SAME_START_DEG = 12.0, 15.0
_SAME_POSE_MM, _SAME_POSE_DEG = 6.0, 8.0
# So much of the scene around a hypothesis is fitted to.
_SPARE_PX, _SPARE_MM = 40, 35.0
_FITTED_POINTS, _JUDGED_POINTS = 400, 1500
# Fractions of the work that are told.
_SCORED, _REFINED = 0.5, 0.6


def find_initial(
    pair: RectifiedPair,
    scene: Scene,
    model: RegistrationModel,
    cone: ViewCone,
    aspects: AspectGraph | None = None,
    on_progress: Progress = lambda fraction: None,
) -> list[ScoredPose]:
    """Find a bone in a box without a pose: distinct poses, best first.

    Args:
        pair: grey pictures; the bone is looked for in its box.
        scene: what was measured there, in the rectified left camera, not thinned.
        model: prepared bone.
        cone: where the cameras may stand, seen from the bone.
        aspects: edges of the bone, seen from that cone; without them the pictures do not count.
        on_progress: told the fraction done; what it raises stops the search.
    """
    on_progress(0.0)
    if len(scene) < MIN_POINTS:
        return []
    views = make_views(model, cone, aspects)
    rotations, shifts_mm = compute_poses(_rank_hypotheses(pair, scene, views, on_progress))
    centres_mm = rotations @ model.centre_mm + shifts_mm
    distinct = find_distinct(rotations, centres_mm, _SAME_START_MM, _SAME_START_DEG, _N_FITTED)
    frames = pair.geometry.rectified_from_left.target, model.bone.name
    starts = [RigidTransform.from_parts(*frames, rotations[k], shifts_mm[k]) for k in distinct]
    return _fit_starts(pair.geometry, scene, model, starts, on_progress)


def _rank_hypotheses(
    pair: RectifiedPair, scene: Scene, views: Views, on_progress: Progress
) -> Hypotheses:
    """The refined hypotheses, best first."""
    chosen = thin_views(views, _COARSE_STEP_DEG)
    n_orientations = len(chosen) * views.anchors_mm.shape[1] * 360.0 / _ROLL_STEP_DEG
    n_places = min(_N_PLACES, int(_N_HYPOTHESES / n_orientations))
    depth, places_mm = sample_scene(scene, pair.geometry, _COARSE.scale, n_places)
    largest_px = pair.geometry.disparity_px(float(scene.points_mm[:, 2].min()))

    def score(some: Hypotheses, level: Level | None) -> NDArray[np.float32]:
        n, found = len(some.place), np.zeros(len(some.place), dtype=np.float32)
        in_row_bands(n, partial(score_surface, some, views.surface_mm, depth, _REACH_MM, found))
        aspects = views.aspects
        if level is None or aspects is None:
            return found
        tables = make_edge_tables(pair, level.scale, level.reach_px, largest_px)
        on_edges = np.zeros_like(found)
        edges = aspects.starts, aspects.points_mm, aspects.tangents
        in_row_bands(n, partial(score_edges, some, *edges, level.n_points, tables, on_edges))
        return found + on_edges

    some = spread_hypotheses(views, chosen, _ROLL_STEP_DEG, places_mm)
    some = keep_best(some, score(some, None), _N_PASSED)
    on_progress(_SCORED)
    some = keep_best(some, score(some, _COARSE), _N_REFINED)
    steps = 0.75 * _COARSE_STEP_DEG, _ROLL_STEP_DEG / 3.0, 0.3 * _REACH_MM
    some = vary_hypotheses(some, views.directions, *steps)
    some = keep_best(some, score(some, _FINE), len(some.place))
    on_progress(_REFINED)
    return some


def _fit_starts(
    geometry: RectifiedGeometry,
    scene: Scene,
    model: RegistrationModel,
    starts: list[RigidTransform],
    on_progress: Progress,
) -> list[ScoredPose]:
    """What the coarse loop finds from each start, on the scene around it: distinct, best first."""
    _ = model.arrays  # made here once, not in both threads
    pixels = geometry.project(scene.points_mm)

    def fit(start: RigidTransform) -> ScoredPose | None:
        near = _crop_scene(scene, pixels, geometry, start.apply(model.points_mm))
        if len(near) < MIN_POINTS:
            return None
        pose = fit_coarsely(
            replace(near, thinned_to=_FITTED_POINTS), model, start, ANYWHERE_SETTINGS
        )
        if pose is None:
            return None
        judged = replace(near, thinned_to=_JUDGED_POINTS)
        # As a fraction of the whole scene, so that poses compare.
        explained = compute_explained_fraction(judged, model, pose)
        return ScoredPose(pose, explained * len(near) / len(scene))

    found = map_both(fit, starts, tell_part(on_progress, _REFINED, 1.0))
    ranked = sorted((one for one in found if one is not None), key=lambda one: -one.score)
    poses = [one.scene_from_bone for one in ranked]
    rotations = np.array([pose.rotation for pose in poses])
    centres_mm = np.array([pose.apply(model.centre_mm) for pose in poses])
    distinct = find_distinct(rotations, centres_mm, _SAME_POSE_MM, _SAME_POSE_DEG)
    return [ranked[k] for k in distinct]


def _crop_scene(
    scene: Scene, pixels: FloatArray, geometry: RectifiedGeometry, model_mm: FloatArray
) -> Scene:
    """The part of a scene, seen at `pixels` (N, 2), around points of a model in its frame."""
    # Some point of the model is in front of the camera: the hypothesis' anchor.
    model_pixels = geometry.project(model_mm)
    low = np.floor(np.nanmin(model_pixels, axis=0)) - _SPARE_PX
    high = np.ceil(np.nanmax(model_pixels, axis=0)) + _SPARE_PX + 1
    inside = ((pixels >= low) & (pixels < high)).all(axis=1)
    z_mm, model_z_mm = scene.points_mm[:, 2], model_mm[:, 2]
    inside &= z_mm > model_z_mm.min() - _SPARE_MM
    inside &= z_mm < model_z_mm.max() + _SPARE_MM
    sigma_mm = scene.sigma_ray_mm
    sigma_mm = None if sigma_mm is None else sigma_mm[inside]
    return replace(scene, points_mm=scene.points_mm[inside], sigma_ray_mm=sigma_mm)
