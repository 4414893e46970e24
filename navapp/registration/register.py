"""One registration from start to verdict: what `navapp register` answers."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum
from itertools import chain
from typing import Literal

import numpy as np

from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.registration.bimcc import MIN_POINTS, Solution, solve_bimcc
from navapp.registration.bimcc_kernels import BimccSettings
from navapp.registration.coverage import coverage
from navapp.registration.model import RegistrationModel
from navapp.registration.multi_start import (
    ANYWHERE,
    NEAR,
    compute_explained_fraction,
    find_candidates,
    is_same_pose,
    make_tilted_starts,
)
from navapp.registration.point_to_point import solve_bimcc_literal, solve_icp
from navapp.registration.scene import Scene
from navapp.values import PoseEstimate, Reason

Method = Literal["bimcc", "bimcc-literal", "icp"]

# With a camera; a bone that lies open is covered better than this.
_DOUBTFUL_COVERAGE = 0.85
_LEAST_COVERAGE = 0.25
# A kernel this near to its upper bound never found the noise: residuals are something else.
_MISFIT_SHARE = 0.95
# What residuals have in common some millimetres apart is no noise but another shape; a coarse model
# leaves some of that itself.
_SMOOTH_MM, _SMOOTH_SPACINGS = 0.2, 0.05
_CELL_MM = 3.0
_APART_CELLS = (0.8, 1.6)
# A pose that is no better known than this is not known.
_LARGEST_TRE_MM = 2.0
_N_TRE_POINTS = 200
# No bone is smaller; below it everything lies under one kernel and fits.
_SMALLEST_MM = 5.0
# Residuals so much larger than the points' own sigma lets expect are no noise either.
_MISFIT_RATIO = 1.5
_N_REFINED = 3
# Tilts that leave no orientation far from a start.
_RINGS_DEG = (35.0, 70.0, 105.0, 140.0, 175.0)
# Candidates that explain less than this share of the best are not refined ...
_REFINED_SHARE = 0.6
# ... and a different one that explains as much as this makes the best one a guess.
_AMBIGUOUS_SHARE = 0.9


class Outcome(Enum):
    """What became of a registration."""

    CONVERGED = "CONVERGED"
    DEGENERATE = "DEGENERATE"
    FAILED = "FAILED"


@dataclass(frozen=True, slots=True, eq=False)
class Registration:
    """A registered pose and what is to be thought of it.

    Attributes:
        outcome: only CONVERGED is a registration.
        reasons: why it is not, in words for people.
        estimate: the pose, `scene_from_bone`.
        coverage: share of the model facing the camera that has the scene's surface on it; None
            without a camera.
        predicted_tre_mm: 95 % bound of the mean error over the points that face the camera; None
            when a direction is not fixed at all or no point faces the camera.
        n_starts: so many starts were tried.
    """

    outcome: Outcome
    reasons: tuple[str, ...]
    estimate: PoseEstimate
    coverage: float | None
    predicted_tre_mm: float | None
    n_starts: int


def register(
    scene: Scene,
    model: RegistrationModel,
    start: RigidTransform,
    method: Method = "bimcc",
    *,
    is_global: bool = False,
    on_progress: Callable[[float], None] = lambda share: None,
) -> Registration:
    """Register a model to a scene, check the answer, and try tilted starts when it is doubtful.

    Args:
        scene: what was measured.
        model: prepared bone.
        start: rough `scene_from_bone`.
        method: production, or one of the paper's for comparison (from the start alone).
        is_global: try the tilted starts in any case; when they leave doubt, centre the model on
            the scene and tilt it all around.
        on_progress: told the share done; may raise to cancel.
    """
    if method != "bimcc":
        solve = solve_icp if method == "icp" else solve_bimcc_literal
        return _verdict(scene, model, solve(scene, model, start), 1)
    alone = _verdict(scene, model, solve_bimcc(scene, model, start), 1)
    if len(scene) < MIN_POINTS or not (is_global or _is_doubtful(alone)):
        return alone
    middle_mm = np.median(scene.points_mm, axis=0)  # a stray point far away must not move it
    near = make_tilted_starts(start, middle_mm)
    first_part = 0.2 if is_global else 1.0
    best = _from_many(scene, model, near, alone, lambda share: on_progress(first_part * share))
    if is_global and _is_doubtful(best):
        shift = middle_mm - start.apply(np.median(model.points_mm, axis=0))
        centred = start.move(np.concatenate([shift, np.zeros(3)]), np.zeros(3))
        rings = [make_tilted_starts(centred, middle_mm, tilt_deg)[1:] for tilt_deg in _RINGS_DEG]
        far = [centred, *chain.from_iterable(rings)]
        best = _from_many(
            scene, model, far, best, lambda share: on_progress(first_part + 0.8 * share), ANYWHERE
        )
    on_progress(1.0)
    return best


def _from_many(
    scene: Scene,
    model: RegistrationModel,
    starts: list[RigidTransform],
    known: Registration,
    on_progress: Callable[[float], None],
    settings: BimccSettings = NEAR,
) -> Registration:
    """The best of what is known and of what many starts lead to; a guess is called one."""
    candidates = find_candidates(scene, model, starts, on_progress=on_progress, settings=settings)
    least = _REFINED_SHARE * max((candidate.score for candidate in candidates), default=0.0)
    n_starts = known.n_starts + len(starts)
    tried = [known]
    for candidate in candidates[:_N_REFINED]:
        if candidate.score >= least:
            solution = solve_bimcc(scene, model, candidate.scene_from_bone)
            tried.append(_verdict(scene, model, solution, n_starts))
    scores = [
        compute_explained_fraction(scene, model, one.estimate.camera_from_bone) for one in tried
    ]
    best = int(np.argmax(scores))
    rivals = [
        score
        for score, one in zip(scores, tried, strict=True)
        if one.estimate.is_converged
        and not is_same_pose(
            one.estimate.camera_from_bone,
            tried[best].estimate.camera_from_bone,
            model.centre_mm,
        )
    ]
    answer = replace(tried[best], n_starts=n_starts)
    is_guess = 0.0 < _AMBIGUOUS_SHARE * scores[best] <= max(rivals, default=0.0)
    # Along a free direction every pose fits as well: that is said already.
    if not is_guess or answer.outcome is Outcome.DEGENERATE:
        return answer
    reasons = tuple(dict.fromkeys((*answer.reasons, Reason.AMBIGUOUS.value)))
    return replace(answer, outcome=Outcome.FAILED, reasons=reasons)


def _is_doubtful(answer: Registration) -> bool:
    return answer.outcome is Outcome.FAILED or _is_little(answer.coverage)


def _is_little(seen: float | None) -> bool:
    """Whether a coverage leaves doubt; where the camera stood unknown, it always does."""
    return seen is None or seen < _DOUBTFUL_COVERAGE


def _verdict(
    scene: Scene, model: RegistrationModel, solution: Solution, n_starts: int
) -> Registration:
    """Outcome and reasons of a solution."""
    estimate, information = solution.estimate, solution.information
    if information is None:
        why = tuple(reason.value for reason in estimate.reasons)
        return Registration(Outcome.FAILED, why, estimate, None, None, n_starts)
    seen = None
    if scene.camera_mm is not None:
        seen = coverage(scene, model, estimate.camera_from_bone, solution.sigma_mm)
    faults = _faults(scene, model, solution, seen)
    free = [f"not fixed: {words}" for words in information.free_in_words()]
    free = [Reason.DEGENERATE.value] * bool(free) + free
    tre_mm = _predict_tre_mm(scene, model, estimate)
    if tre_mm is None or tre_mm > _LARGEST_TRE_MM:
        free.append(Reason.POSE_UNCERTAIN.value)
    outcome = Outcome.FAILED if faults else Outcome.DEGENERATE if free else Outcome.CONVERGED
    return Registration(outcome, (*faults, *free), estimate, seen, tre_mm, n_starts)


def _faults(
    scene: Scene, model: RegistrationModel, solution: Solution, seen: float | None
) -> list[str]:
    """What makes a solution no registration."""
    estimate = solution.estimate
    faults = [] if estimate.is_converged else [Reason.NOT_CONVERGED.value]
    for name, points_mm in (("scene", scene.points_mm), ("model", model.points_mm)):
        if float(np.ptp(points_mm, axis=0).max()) < _SMALLEST_MM:
            faults.append(f"the {name} is too small to fix a bone")
    if scene.knows_noise:
        is_misfit = estimate.rms_mm > _MISFIT_RATIO * estimate.expected_rms_mm
    else:
        is_misfit = solution.sigma_mm >= _MISFIT_SHARE * BimccSettings().widest_at_rest_mm
    # Where little tells a right pose from a wrong one, residuals must look like noise as well.
    if _is_little(seen) and not scene.knows_noise:
        spacing_mm = float(np.median(model.arrays.spacing))
        limit_mm = max(_SMOOTH_MM, _SMOOTH_SPACINGS * spacing_mm)
        is_misfit |= smooth_part_mm(solution, max(_CELL_MM, spacing_mm)) > limit_mm
    faults += [Reason.SURFACE_MISFIT.value] * is_misfit
    if seen is not None and seen < _LEAST_COVERAGE:
        faults.append(Reason.COVERAGE_LOW.value)
    return faults


def smooth_part_mm(solution: Solution, cell_mm: float) -> float:
    """Rms of what the mean residuals of cells have in common with those of the cells beside them.

    Noise has nothing in common with the noise beside it; another shape has.

    Args:
        solution: with points and residuals that fit.
        cell_mm: residuals within a cell are averaged; wider than what neighbours share by matching.
    """
    from scipy.spatial import cKDTree

    if len(solution.residual_mm) == 0:
        return 0.0
    cells = np.floor(solution.points_mm / cell_mm)
    _, place, counts = np.unique(cells, axis=0, return_inverse=True, return_counts=True)
    place = place.reshape(-1)
    mean = np.bincount(place, solution.residual_mm) / counts
    centres = [np.bincount(place, axis) / counts for axis in solution.points_mm.T]
    tree = cKDTree(np.column_stack(centres))
    a, b = tree.query_pairs(_APART_CELLS[1] * cell_mm, output_type="ndarray").T
    is_apart = np.linalg.norm(tree.data[a] - tree.data[b], axis=1) > _APART_CELLS[0] * cell_mm
    shared = (mean[a] * mean[b])[is_apart]
    return float(max(float(shared.mean()), 0.0) ** 0.5) if len(shared) else 0.0


def _predict_tre_mm(scene: Scene, model: RegistrationModel, estimate: PoseEstimate) -> float | None:
    points = _facing(model, estimate.camera_from_bone, scene)
    if len(points) == 0 or not np.isfinite(estimate.covariance).all():
        return None
    some = points[:: max(1, len(points) // _N_TRE_POINTS)]
    return estimate.predict_tre_mm(model.centre_mm, some)


def _facing(model: RegistrationModel, pose: RigidTransform, scene: Scene) -> FloatArray:
    """(N, 3) model points, bone coordinates, that face the scene's camera; all without one."""
    if scene.camera_mm is None:
        return model.points_mm
    towards = pose.inverse().apply(scene.camera_mm) - model.points_mm
    cosine = np.einsum("ij,ij->i", model.normals, towards) / np.linalg.norm(towards, axis=1)
    facing: FloatArray = model.points_mm[cosine > 0.2]
    return facing
