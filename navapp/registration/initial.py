"""The first registration without a pose: views, rolls and places are tried, the best verified.

Hypotheses stand on the measured surface, which gives their distance. They are scored by look-ups,
coarse to fine: by how much of the view's surface was measured where it should be, and by equations
2 and 3 in both pictures. The best go through the coarse BiMCC loop and are ranked by what they
explain.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.bands import run_both
from navapp.geometry.box import Box
from navapp.geometry.directions import ViewCone
from navapp.geometry.rectification import RectifiedPair
from navapp.geometry.transform import RigidTransform, rotation_angle_deg
from navapp.registration.bimcc import MIN_POINTS, fit_coarsely
from navapp.registration.edge_tables import EdgeTables, edge_tables, scale_optics
from navapp.registration.hypotheses import (
    Views,
    find_distinct,
    places_of,
    poses_of,
    select_hypotheses,
    spread_hypotheses,
    thin_views,
    vary_hypotheses,
    views_of,
)
from navapp.registration.initial_kernels import Hypotheses, score_edges, score_surface
from navapp.registration.model import RegistrationModel
from navapp.registration.multi_start import ANYWHERE, Candidate, compute_explained_fraction
from navapp.registration.scene import Scene
from navapp.values import AspectGraph

_CELL_PX = 8
# Hypotheses that the coarse loop brings to the same end.
_ALIKE_MM, _ALIKE_DEG = 12.0, 15.0
# Coarse answers that a fit on all points brings to the same end.
_BASIN_MM, _BASIN_DEG = 6.0, 8.0
# Around a hypothesis so much of the scene takes part.
_SPARE_PX, _SPARE_MM = 40, 35.0
_COARSE_POINTS, _JUDGED_POINTS = 400, 1500
# Shares of the work that are told.
_SCORED, _REFINED = 0.5, 0.6


@dataclass(frozen=True, slots=True)
class InitialSettings:
    """How finely is looked.

    Attributes:
        coarse_step_deg, fine_step_deg: between views.
        roll_step_deg: between rolls, all around.
        n_places: on the measured surface, about ...
        n_hypotheses: ... and fewer when all together would be more than this.
        n_surface_points: of each view, to be looked up.
        n_edge_points: of each view, coarse and fine.
        reach_mm: a measured depth within this agrees with a hypothesis.
        n_passed: the best of all by surface alone are scored by their edges too.
        n_refined: the best of those are refined.
        n_verified: the best distinct ones of those are verified on the surface.
    """

    coarse_step_deg: float = 16.0
    fine_step_deg: float = 8.0
    roll_step_deg: float = 24.0
    n_places: int = 2500
    n_hypotheses: int = 3_000_000
    n_surface_points: int = 40
    n_edge_points: tuple[int, int] = (50, 120)
    reach_mm: float = 6.0
    n_passed: int = 8000
    n_refined: int = 300
    n_verified: int = 40


def find_initial(
    pair: RectifiedPair,
    scene: Scene,
    model: RegistrationModel,
    cone: ViewCone,
    aspects: AspectGraph | None = None,
    *,
    settings: InitialSettings | None = None,
    on_progress: Callable[[float], None] = lambda share: None,
) -> list[Candidate]:
    """Find a bone in a box without a pose: distinct candidates, best first.

    Args:
        pair: grey pictures; the bone is looked for in its box.
        scene: what was measured there, in the rectified left camera, not thinned.
        model: prepared bone.
        cone: where the cameras may stand, seen from the bone.
        aspects: edges of the bone; without them the pictures have no say.
        settings: how finely is looked.
        on_progress: told the share done; what it raises stops the search.
    """
    settings = settings or InitialSettings()
    on_progress(0.0)
    if len(scene) < MIN_POINTS:
        return []
    views = views_of(model, cone, settings.fine_step_deg, aspects, settings.n_surface_points)
    best = _best_hypotheses(pair, scene, views, settings, on_progress)
    target = pair.geometry.rectified_from_left.target
    best = select_hypotheses(
        best, find_distinct(best, model.centre_mm, _ALIKE_MM, _ALIKE_DEG)[: settings.n_verified]
    )
    starts = poses_of(best, target, model.bone.name)
    told = lambda share: on_progress(_REFINED + (1.0 - _REFINED) * share)  # noqa: E731
    return _verify(pair, scene, model, starts, told)


def score_views(
    some: Hypotheses, aspects: AspectGraph, tables: EdgeTables, n_first: int
) -> NDArray[np.float32]:
    """(H,) equations 2 and 3 of hypotheses: 0 to 1, mean over both pictures with the same pose.

    Args:
        some: hypotheses whose aspects are the graph's views.
        aspects: edges of the views.
        tables: of the pictures.
        n_first: so many points of a view; they are spread evenly for every number.
    """
    score = np.zeros(len(some.orientation), dtype=np.float32)
    points, tangents = np.array(aspects.points_mm), np.array(aspects.tangents)
    starts = np.array(aspects.starts)
    _in_halves(
        len(score),
        lambda first, last: score_edges(
            some, points, tangents, starts, n_first, tables.left, tables.right, tables.optics,
            (first, last), score,
        ),
    )  # fmt: skip
    return score


def _best_hypotheses(
    pair: RectifiedPair,
    scene: Scene,
    views: Views,
    settings: InitialSettings,
    on_progress: Callable[[float], None],
) -> Hypotheses:
    """Hypotheses, best first, coarse to fine."""
    chosen = thin_views(views, settings.coarse_step_deg)
    n_orientations = len(chosen) * views.anchors_mm.shape[1] * 360.0 / settings.roll_step_deg
    n_places = min(settings.n_places, int(settings.n_hypotheses / n_orientations))
    depth_mm, positions_mm = places_of(scene, pair.geometry, _CELL_PX, n_places)
    some = spread_hypotheses(views, chosen, settings.roll_step_deg, positions_mm)
    optics = scale_optics(pair, _CELL_PX)
    largest_px = pair.geometry.disparity_px(float(scene.points_mm[:, 2].min()))

    def by_surface(these: Hypotheses) -> NDArray[np.float32]:
        score = np.zeros(len(these.orientation), dtype=np.float32)
        fixed = (these, views.surface_mm, views.starts, depth_mm, optics, settings.reach_mm)
        _in_halves(len(score), lambda a, b: score_surface(*fixed, (a, b), score))
        return score

    def by_both(these: Hypotheses, score: NDArray[np.float32], level: int) -> NDArray[np.float32]:
        if views.edges is None:
            return score
        tables = edge_tables(pair, _CELL_PX >> level, 1 + level, largest_px)
        n_first = settings.n_edge_points[level]
        return score + score_views(these, views.edges, tables, n_first)

    score = by_surface(some)
    passed = _largest(score, settings.n_passed)
    on_progress(_SCORED)
    some = select_hypotheses(some, passed)
    some = select_hypotheses(some, _largest(by_both(some, score[passed], 0), settings.n_refined))
    steps = 0.75 * settings.coarse_step_deg, settings.roll_step_deg / 3.0, 0.3 * settings.reach_mm
    some = vary_hypotheses(some, views, *steps)
    score = by_both(some, by_surface(some), 1)
    on_progress(_REFINED)
    return select_hypotheses(some, _largest(score, len(score)))


def _verify(
    pair: RectifiedPair,
    scene: Scene,
    model: RegistrationModel,
    starts: list[RigidTransform],
    on_progress: Callable[[float], None],
) -> list[Candidate]:
    """Where the coarse loop leads from each start, on the scene around it."""
    found: list[Candidate | None] = [None] * len(starts)
    _ = model.arrays  # made here once, not in both threads
    pixels = pair.geometry.project(scene.points_mm)

    def run(first: int) -> None:
        for number in range(first, len(starts), 2):
            if first == 0:
                on_progress(number / len(starts))
            start = starts[number]
            near = _near(pair, scene, pixels, model, start)
            if len(near) < MIN_POINTS:
                continue
            pose = fit_coarsely(replace(near, thinned_to=_COARSE_POINTS), model, start, ANYWHERE)
            if pose is not None:
                # In shares of the whole scene, so that candidates compare.
                share = compute_explained_fraction(
                    replace(near, thinned_to=_JUDGED_POINTS), model, pose
                )
                found[number] = Candidate(pose, share * len(near) / len(scene))

    run_both(lambda: run(0), lambda: run(1))
    on_progress(1.0)
    ranked = sorted((one for one in found if one is not None), key=lambda one: -one.score)
    kept: list[Candidate] = []
    for one in ranked:
        if not any(_same_basin(one, other, model) for other in kept):
            kept.append(one)
    return kept


def _same_basin(a: Candidate, b: Candidate, model: RegistrationModel) -> bool:
    """Whether two coarse answers are on their way to the same pose."""
    one, other = a.scene_from_bone, b.scene_from_bone
    shift_mm = np.linalg.norm(one.apply(model.centre_mm) - other.apply(model.centre_mm))
    return bool(shift_mm < _BASIN_MM and rotation_angle_deg(one, other) < _BASIN_DEG)


def _near(
    pair: RectifiedPair,
    scene: Scene,
    pixels: NDArray[np.float64],
    model: RegistrationModel,
    pose: RigidTransform,
) -> Scene:
    """The part of the scene around the model at a pose."""
    points_mm = pose.apply(model.points_mm)
    around_model = Box.around(pair.geometry.project(points_mm))
    if around_model is None:
        return replace(scene, points_mm=np.empty((0, 3)), sigma_ray_mm=None)
    box = around_model.grow(_SPARE_PX)
    z_mm = scene.points_mm[:, 2]
    inside = (z_mm > points_mm[:, 2].min() - _SPARE_MM) & (z_mm < points_mm[:, 2].max() + _SPARE_MM)
    inside &= (pixels[:, 0] >= box.x) & (pixels[:, 0] < box.x + box.width)
    inside &= (pixels[:, 1] >= box.y) & (pixels[:, 1] < box.y + box.height)
    sigma = scene.sigma_ray_mm
    return replace(
        scene,
        points_mm=scene.points_mm[inside],
        sigma_ray_mm=None if sigma is None else sigma[inside],
    )


def _largest(score: NDArray[np.float32], n: int) -> NDArray[np.intp]:
    """Indices of the n largest scores, largest first; ties in their order."""
    if n < len(score):
        least = np.partition(score, len(score) - n)[len(score) - n]
        kept = np.flatnonzero(score >= least)
    else:
        kept = np.arange(len(score))
    return kept[np.argsort(-score[kept], kind="stable")][:n]


def _in_halves(n: int, job: Callable[[int, int], object]) -> None:
    run_both(lambda: job(0, n // 2), lambda: job(n // 2, n))
