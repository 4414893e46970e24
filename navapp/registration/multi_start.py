"""Many starts, one answer: tilted starts, coarse approaches, distinct candidates, agreement."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from navapp.geometry.bands import run_both
from navapp.geometry.directions import sphere_spiral
from navapp.geometry.transform import FloatArray, RigidTransform, rotation_angle_deg
from navapp.registration.bimcc import fit_coarsely
from navapp.registration.bimcc_kernels import BimccSettings
from navapp.registration.coverage import coverage
from navapp.registration.model import RegistrationModel
from navapp.registration.pairing_kernels import Pose, make_pairs, measure_pairs, pair_forward
from navapp.registration.scene import Scene
from navapp.registration.step_kernels import weigh

# Poses nearer than this are the same answer.
_SAME_MM = 2.0
_SAME_DEG = 2.0
_COARSE_POINTS = 400
# For starts that are near, or may be anywhere.
NEAR = BimccSettings(model_points=1000, max_iterations=35)
ANYWHERE = BimccSettings(model_points=1000, max_iterations=60, widest_mm=30.0)


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """Where some start led to, coarsely, and how much of both sides that explains (0 to 1)."""

    scene_from_bone: RigidTransform
    score: float


def make_tilted_starts(
    pose: RigidTransform, centre_mm: FloatArray, tilt_deg: float = 35.0, n_tilts: int = 14
) -> list[RigidTransform]:
    """The pose and tilts of it, axes spread over the sphere.

    Args:
        pose: `scene_from_bone`.
        centre_mm: (3,) what it is tilted about, in the scene's frame.
        tilt_deg: angle of each tilt.
        n_tilts: how many.
    """
    starts = [pose]
    for axis in sphere_spiral(n_tilts):
        twist = np.concatenate([np.zeros(3), np.radians(tilt_deg) * axis])
        starts.append(pose.move(twist, centre_mm))
    return starts


def make_scattered_starts(
    pose: RigidTransform,
    centre_mm: FloatArray,
    step_mm: float,
    tilts: Sequence[tuple[float, int]],
    *,
    has_middle: bool = True,
) -> list[RigidTransform]:
    """A pose shifted along each axis of the scene and back, and tilts of each.

    Args:
        pose: `scene_from_bone`.
        centre_mm: (3,) what it is tilted about, in the scene's frame.
        step_mm: length of the shifts.
        tilts: angle in degrees and number, of each kind of tilt.
        has_middle: the pose itself, not shifted, is the first.
    """
    axes = np.vstack([np.zeros((1, 3)) if has_middle else np.empty((0, 3)), np.eye(3), -np.eye(3)])
    starts = []
    for shift in step_mm * axes:
        moved = pose.move(np.concatenate([shift, np.zeros(3)]), centre_mm)
        starts.append(moved)
        for tilt_deg, n_tilts in tilts:
            starts += make_tilted_starts(moved, centre_mm + shift, tilt_deg, n_tilts)[1:]
    return starts


def find_candidates(
    scene: Scene,
    model: RegistrationModel,
    starts: Sequence[RigidTransform],
    score: Callable[[RigidTransform], float] | None = None,
    on_progress: Callable[[float], None] = lambda share: None,
    settings: BimccSettings = NEAR,
) -> list[Candidate]:
    """Approach from every start on a thinned scene; distinct answers, best score first.

    Args:
        scene: what was measured.
        model: prepared bone.
        starts: `scene_from_bone` each.
        score: of a pose, larger is better; by default `compute_explained_fraction`.
        on_progress: told the share done; may raise to cancel.
        settings: of the approach.
    """
    thinned = replace(scene, thinned_to=_COARSE_POINTS)
    _ = thinned.grid, model.arrays  # made here once, not in both threads
    found: list[RigidTransform | None] = [None] * len(starts)

    def run(first: int) -> None:
        for number in range(first, len(starts), 2):
            if first == 0:
                on_progress(number / len(starts))
            found[number] = fit_coarsely(thinned, model, starts[number], settings)

    run_both(lambda: run(0), lambda: run(1))
    on_progress(1.0)
    poses = distinct([pose for pose in found if pose is not None], model.centre_mm)
    judged = score or (lambda pose: compute_explained_fraction(thinned, model, pose))
    candidates = [Candidate(pose, judged(pose)) for pose in poses]
    return sorted(candidates, key=lambda candidate: candidate.score, reverse=True)


def compute_explained_fraction(
    scene: Scene,
    model: RegistrationModel,
    scene_from_bone: RigidTransform,
    settings: BimccSettings | None = None,
) -> float:
    """How much a pose explains: share of the scene on the model x share of the model in the scene.

    Both under a kernel as wide as the largest noise, so that poses compare. Without a camera the
    second is left out.
    """
    settings = settings or BimccSettings()
    sigma_mm = 0.5 * settings.widest_at_rest_mm
    pose = Pose(*scene_from_bone.inverse_parts())
    arrays = scene.arrays
    n_asked = len(range(0, len(scene), scene.every))
    pairs = make_pairs(n_asked)
    n = pair_forward(arrays, model.arrays, pose, scene.every, pairs)
    measure_pairs(arrays, model.arrays, pose, pairs, n)
    kernels: float = weigh(pairs, n, sigma_mm, settings.n_sigmas, 0.0).kernels
    share = kernels / max(n_asked, 1)
    if scene.camera_mm is None:
        return share
    return share * coverage(scene, model, scene_from_bone, sigma_mm)


def distinct(
    poses: Sequence[RigidTransform], centre_mm: FloatArray, n: int | None = None
) -> list[RigidTransform]:
    """The first n that repeat no earlier one; `centre_mm` (3,) in the bone's frame."""
    kept: list[RigidTransform] = []
    for pose in poses:
        if len(kept) == n:
            break
        if not any(is_same_pose(pose, other, centre_mm) for other in kept):
            kept.append(pose)
    return kept


def is_same_pose(a: RigidTransform, b: RigidTransform, centre_mm: FloatArray) -> bool:
    """Whether two answers differ by less than a fit's basin."""
    shift_mm = float(np.linalg.norm(a.apply(centre_mm) - b.apply(centre_mm)))
    return shift_mm < _SAME_MM and rotation_angle_deg(a, b) < _SAME_DEG
