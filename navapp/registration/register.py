"""One registration from start to verdict: what `navapp register` answers."""

from dataclasses import dataclass, replace
from enum import Enum
from typing import Literal

import numpy as np

from navapp.geometry.transform import RigidTransform
from navapp.registration.bimcc import DEFAULT, MIN_POINTS, Solution, solve_bimcc
from navapp.registration.bimcc_kernels import BimccSettings
from navapp.registration.model import RegistrationModel
from navapp.registration.multi_start import (
    ANYWHERE_SETTINGS,
    NEAR_SETTINGS,
    compute_coverage,
    compute_explained_fraction,
    find_poses,
    make_far_starts,
    make_near_starts,
    make_tilted_starts,
    rank_fits,
    select_poses,
)
from navapp.registration.point_to_point import solve_bimcc_literal, solve_icp
from navapp.registration.scene import Scene
from navapp.registration.verdict import Agreement, Evidence, Goal, find_reasons
from navapp.values import PoseEstimate, Reason
from navapp.values.progress import Progress, tell_part

Method = Literal["bimcc", "bimcc-literal", "icp"]

# All chosen. An answer of which less was seen is tried from other starts: with a camera a bone that
# lies open is covered better.
_DOUBTFUL_COVERAGE = 0.85
# What residuals have in common some millimetres apart is no noise but another shape; a coarse model
# leaves some of that itself.
_SMOOTH_MM, _SMOOTH_SPACINGS = 0.2, 0.05
_CELL_MM, _APART_CELLS = 3.0, (0.8, 1.6)
# A pose that is no better known than this is not known; no stage asks for more.
_GOAL = Goal(np.empty((0, 3)), tolerance_mm=np.inf, seen_limit_mm=2.0)
_LEAST_FACING_COSINE, _N_TRE_POINTS = 0.2, 200
# Tilts that leave no orientation far from a start: angles, and how many of each.
_RINGS = ((35.0, 14), (70.0, 14), (105.0, 14), (140.0, 14), (175.0, 14))


class Outcome(Enum):
    """What became of a registration."""

    CONVERGED = "CONVERGED"
    DEGENERATE = "DEGENERATE"
    FAILED = "FAILED"


@dataclass(frozen=True, slots=True, eq=False)
class Registration:
    """A registered pose and what is to be thought of it."""

    outcome: Outcome  # only CONVERGED is a registration
    reasons: tuple[Reason, ...]  # why it is not
    # which directions are not fixed, and what is too small, in words for people.
    details: tuple[str, ...]
    estimate: PoseEstimate  # the pose, `scene_from_bone`
    # fraction of the model facing the camera that has the scene's surface on it; None without a
    # camera.
    coverage: float | None
    # 95 % bound of the mean error over the points that face the camera; None when a direction is
    # not fixed at all or no point faces the camera.
    predicted_tre_mm: float | None
    n_starts: int  # so many starts were tried

    @property
    def is_doubtful(self) -> bool:
        """Whether other starts are worth a try."""
        return self.outcome is Outcome.FAILED or _is_little(self.coverage)

    @property
    def explanations(self) -> tuple[str, ...]:
        """Why it is no registration, in words for people."""
        # What is too small is told by the details: its size is not known to differ.
        told = (one.value for one in self.reasons if one is not Reason.SIZE_DIFFERS)
        return (*told, *self.details)


def register(
    scene: Scene,
    model: RegistrationModel,
    start: RigidTransform,
    method: Method = "bimcc",
    *,
    is_global: bool = False,
    on_progress: Progress = lambda fraction: None,
) -> Registration:
    """Register a model to a scene, judge the answer, and try more starts when it is doubtful.

    Near starts first, then far ones, as a tracker's first registration does. The paper's methods
    are for comparison: from the start alone.

    Args:
        scene: what was measured.
        model: prepared bone.
        start: rough `scene_from_bone`.
        method: of the fit.
        is_global: try the near starts in any case; when doubt remains, centre the model on the
            scene and tilt it all around.
        on_progress: told the fraction done; what it raises stops the search.
    """
    if method != "bimcc":
        solve = solve_icp if method == "icp" else solve_bimcc_literal
        return _judge(scene, model, solve(scene, model, start), 1)
    search = _Search(scene, model, start)
    if len(scene) < MIN_POINTS:
        return search.best
    place_mm = start.apply(model.centre_mm)
    if is_global or search.best.is_doubtful:
        told = tell_part(on_progress, 0.0, 0.1)
        search.try_starts(make_near_starts(start, place_mm), NEAR_SETTINGS, told)
    if search.best.is_doubtful:
        told = tell_part(on_progress, 0.1, 0.6)
        search.try_starts(make_far_starts(start, place_mm), NEAR_SETTINGS, told)
    if is_global and search.best.is_doubtful:
        starts = _make_starts_all_around(scene, model, start)
        search.try_starts(starts, ANYWHERE_SETTINGS, tell_part(on_progress, 0.6, 1.0))
    on_progress(1.0)
    return search.best


class _Search:
    """The best of what one start and then others lead to."""

    def __init__(self, scene: Scene, model: RegistrationModel, start: RigidTransform) -> None:
        self._scene, self._model = scene, model
        self._solutions = [solve_bimcc(scene, model, start)]
        self.best = _judge(scene, model, self._solutions[0], 1)

    def try_starts(
        self, starts: list[RigidTransform], settings: BimccSettings, on_progress: Progress
    ) -> None:
        """Fit to all points what many starts lead to."""
        scene, model = self._scene, self._model
        found = find_poses(scene, model, starts, on_progress=on_progress, settings=settings)
        self._solutions += [solve_bimcc(scene, model, pose) for pose in select_poses(found)]
        poses = [one.estimate.camera_from_bone for one in self._solutions]
        scores = [compute_explained_fraction(scene, model, pose) for pose in poses]
        solution = rank_fits(self._solutions, scores, model.centre_mm)[0]
        self.best = _judge(scene, model, solution, self.best.n_starts + len(starts))


def _make_starts_all_around(
    scene: Scene, model: RegistrationModel, start: RigidTransform
) -> list[RigidTransform]:
    """The model's middle on the scene's, tilted all around."""
    middle_mm = np.median(scene.points_mm, axis=0)  # a stray point far away must not move it
    shift_mm = middle_mm - start.apply(np.median(model.points_mm, axis=0))
    centred = start.move(np.concatenate([shift_mm, np.zeros(3)]), np.zeros(3))
    return make_tilted_starts(centred, middle_mm, *_RINGS)


def _judge(
    scene: Scene, model: RegistrationModel, solution: Solution, n_starts: int
) -> Registration:
    """Outcome and reasons of a solution."""
    estimate, information = solution.estimate, solution.information
    if information is None:
        return Registration(Outcome.FAILED, estimate.reasons, (), estimate, None, None, n_starts)
    seen = compute_coverage(scene, model, estimate.camera_from_bone, solution.sigma_mm)
    tre_mm = _predict_tre_mm(scene, model, estimate)
    reasons = find_reasons(_gather_evidence(scene, model, solution, seen, tre_mm))
    outcome = Outcome.FAILED
    if {Reason.DEGENERATE, Reason.POSE_UNCERTAIN}.issuperset(reasons):
        outcome = Outcome.DEGENERATE if reasons else Outcome.CONVERGED
    details = [f"not fixed: {words}" for words in information.free_in_words()]
    if Reason.SIZE_DIFFERS in reasons:
        name = "model" if _extent_mm(model) < _extent_mm(scene) else "scene"
        details.append(f"the {name} is too small to fix a bone")
    return Registration(outcome, reasons, tuple(details), estimate, seen, tre_mm, n_starts)


def _gather_evidence(
    scene: Scene,
    model: RegistrationModel,
    solution: Solution,
    seen: float | None,
    tre_mm: float | None,
) -> Evidence:
    """What is known of a solution; nothing is known of pictures."""
    estimate = solution.estimate
    evidence = Evidence(
        estimate=estimate,
        # Nothing tells what hides the rest.
        agreement=None if seen is None else Agreement(0, seen, 0.0, *[np.nan] * 3),
        extent_mm=min(_extent_mm(scene), _extent_mm(model)),
        seen_error_mm=np.inf if tre_mm is None else tre_mm,
        plan_mm=0.0,
        goal=_GOAL,
    )
    if scene.knows_noise:
        return replace(evidence, rms_ratio=estimate.rms_mm / estimate.expected_rms_mm)
    kernel_fraction = solution.sigma_mm / DEFAULT.widest_at_rest_mm
    evidence = replace(evidence, kernel_fraction=kernel_fraction)
    if not _is_little(seen):
        return evidence
    # Where little tells a right pose from a wrong one, residuals must look like noise as well.
    spacing_mm = float(np.median(model.arrays.spacing))
    limit_mm = max(_SMOOTH_MM, _SMOOTH_SPACINGS * spacing_mm)
    smooth_mm = measure_smooth_part_mm(solution, max(_CELL_MM, spacing_mm))
    return replace(evidence, smooth_excess_mm=smooth_mm - limit_mm)


def _extent_mm(points: Scene | RegistrationModel) -> float:
    return float(np.ptp(points.points_mm, axis=0).max())


def _is_little(seen: float | None) -> bool:
    """Whether a coverage leaves doubt; where the camera stood unknown, it always does."""
    return seen is None or seen < _DOUBTFUL_COVERAGE


def measure_smooth_part_mm(solution: Solution, cell_mm: float) -> float:
    """Square root of the covariance of the residuals of neighbouring cells; 0 when it is negative.

    Noise is not correlated with the noise beside it; residuals of another shape are. Residuals
    within a cell are averaged: cells are wider than what neighbours share by matching.
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
    """95 % bound over the model's points that face the camera, or over all without one."""
    points_mm = model.points_mm
    if scene.camera_mm is not None:
        camera_mm = estimate.camera_from_bone.inverse().apply(scene.camera_mm)
        towards = camera_mm - points_mm
        cosine = np.einsum("ij,ij->i", model.normals, towards) / np.linalg.norm(towards, axis=1)
        points_mm = points_mm[cosine > _LEAST_FACING_COSINE]
    if len(points_mm) == 0 or not estimate.has_finite_covariance:
        return None
    some_mm = points_mm[:: max(1, len(points_mm) // _N_TRE_POINTS)]
    return estimate.predict_tre_mm(model.centre_mm, some_mm)
