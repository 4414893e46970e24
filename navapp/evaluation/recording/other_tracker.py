"""Truth from another tracker: its frames and its clock are solved on one half of a recording.

    left_from_bone(t) = left_from_tracker @ tracker_from_marker(t + offset) @ marker_from_bone

Both frames are constant and unknown, as is the offset. They are solved with the poses under test in
one of every two seconds, and the poses are scored in the others, which the solve never sees.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from navapp.errors import ResultError
from navapp.evaluation.recording.other_tracker_start import (
    BonePoses,
    find_offsets,
    solve_closed_form,
)
from navapp.evaluation.recording.tracker_motion import TrackerMotion, split_halves, to_seconds
from navapp.evaluation.recording.truth_files import TrackerTruth
from navapp.geometry.transform import FloatArray, RigidTransform, rotation_from_vector

# Chosen: below this the frames follow from noise.
_LEAST_TURN_DEG = 1.0  # root mean square, about the second axis
_MOST_FRAMES_SD_MM = 0.5
_LEAST_PICTURES, _LEAST_BLOCKS, _LEAST_SCORED = 30, 4, 10
# Two trackers of one bone agree better than this, or they do not see the same motion.
_MOST_FIT_MM = 5.0
# Another offset that fits nearly as well: the motion repeats itself.
_UNLIKE = 1.3
# Starts that end in the same solution differ by where the solver stopped.
_ALIKE = 1.0 + 1e-6
_OUTLIER_MM = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class SolvedFrames:
    """What was solved, and how well it is known."""

    left_from_tracker: RigidTransform
    marker_from_bone: RigidTransform
    offset_ns: int  # tracker's time less recording's time
    offset_sd_ms: float
    fit_mm: float  # median over the pictures it was solved with, of the bone's root mean square
    frames_sd_mm: float  # of the bone in the scored pictures, because of the solved frames alone
    solved_with: tuple[int, ...]  # places of pictures in the recording
    scored: tuple[int, ...]


@dataclass(frozen=True, slots=True, eq=False)
class _Start:
    """What the unknowns are counted from, and what they are solved with."""

    motion: TrackerMotion
    lag_s: float
    left_from_tracker: RigidTransform
    marker_from_bone: RigidTransform
    marker_mm: FloatArray  # (3,) mean place of the marker in the tracker's frame
    bone_mm: FloatArray  # (3,) centre of the bone
    arms_mm: FloatArray  # (K, 3) places on the bone from its centre

    def predict(self, unknowns: FloatArray, times_s: FloatArray) -> FloatArray:
        """(N, K, 3) places of the bone in the left camera, mm.

        The unknowns are turn and shift of `left_from_tracker` at the mean marker, of
        `marker_from_bone` at the bone's centre, and the change of the lag in s.
        """
        tracker, bone = self.left_from_tracker, self.marker_from_bone
        turn = rotation_from_vector(unknowns[0:3]) @ tracker.rotation
        place = tracker.apply(self.marker_mm) + unknowns[3:6]
        in_marker = self.arms_mm @ (rotation_from_vector(unknowns[6:9]) @ bone.rotation).T
        in_marker = in_marker + bone.apply(self.bone_mm) + unknowns[9:12]
        rotations, places_mm = self.motion.at(times_s + self.lag_s + unknowns[12])
        in_tracker = np.einsum("nij,kj->nki", rotations, in_marker) + places_mm[:, None]
        in_left: FloatArray = (in_tracker - self.marker_mm) @ turn.T + place
        return in_left

    def frames_of(self, unknowns: FloatArray) -> tuple[RigidTransform, RigidTransform]:
        """`left_from_tracker` and `marker_from_bone`."""
        frames = []
        for frame, values, centre_mm in (
            (self.left_from_tracker, unknowns[0:6], self.marker_mm),
            (self.marker_from_bone, unknowns[6:12], self.bone_mm),
        ):
            twist = np.concatenate([values[3:6], values[0:3]])
            frames.append(frame.move(twist, frame.apply(centre_mm)))
        return frames[0], frames[1]


def solve_frames(
    times_ns: Sequence[int],
    poses: Sequence[RigidTransform | None],
    truth: TrackerTruth,
    vertices_mm: FloatArray,
) -> SolvedFrames:
    """Solve both frames and the offset on one half of a recording; the other is to be scored.

    Args:
        times_ns: of the recording's pictures.
        poses: left camera from bone in each; None where there is none to be believed.
        truth: of the other tracker.
        vertices_mm: (V, 3) of the bone: errors are weighed by how far they move it.

    Raises:
        ResultError: motion or number of pictures do not determine them, and why.
    """
    since_s = to_seconds(times_ns, int(times_ns[0]))
    halves = split_halves(since_s)
    given = halves.is_to_solve & np.array([pose is not None for pose in poses])
    _check_number(given, halves.blocks, len(truth.times_ns))
    used = _gather(poses, since_s, halves.blocks, given)
    _check_turns(used)
    start, unknowns, fit_mm = _choose(_solve_each(used, TrackerMotion(truth), vertices_mm))
    left_from_tracker, marker_from_bone = start.frames_of(unknowns)
    motion, lag_s = start.motion, start.lag_s + float(unknowns[12])
    scored = np.flatnonzero(halves.is_to_score & motion.knows(since_s + lag_s))
    if len(scored) < _LEAST_SCORED:
        raise _undetermined(f"the tracker knows only {len(scored)} of the pictures to be scored")
    fitted = motion.knows(used.times_s + lag_s)
    covariance = _find_covariance(start, unknowns, used, fitted)
    slopes = _slopes(start, unknowns, since_s[scored])
    variances = np.einsum("rp,pq,rq->r", slopes, covariance, slopes)
    frames_sd_mm = float(np.sqrt(3.0 * variances.mean()))
    if frames_sd_mm > _MOST_FRAMES_SD_MM:
        raise _undetermined(f"they would put the bone off by {frames_sd_mm:.1f} mm (sd)")
    return SolvedFrames(
        left_from_tracker,
        marker_from_bone,
        round(lag_s * 1e9) + motion.origin_ns - int(times_ns[0]),
        float(np.sqrt(covariance[12, 12]) * 1e3),
        fit_mm,
        frames_sd_mm,
        tuple(int(n) for n in np.flatnonzero(given)[fitted]),
        tuple(int(n) for n in scored),
    )


def _solve_each(
    used: BonePoses, motion: TrackerMotion, vertices_mm: FloatArray
) -> list[tuple[_Start, FloatArray, float]]:
    """A solution for each time offset that may be the right one."""
    centre_mm = vertices_mm.mean(axis=0)
    arms_mm = np.vstack([np.diag(sign * vertices_mm.std(axis=0)) for sign in (1.0, -1.0)])
    found = []
    for lag_s in find_offsets(used, motion):
        frames = solve_closed_form(used, motion, lag_s)
        if frames is not None:
            marker_mm = motion.at(used.times_s + lag_s)[1].mean(axis=0)
            start = _Start(motion, lag_s, *frames, marker_mm, centre_mm, arms_mm)
            found.append(_refine(start, used))
    return found


def find_poses(
    solved: SolvedFrames, truth: TrackerTruth, times_ns: Sequence[int]
) -> list[RigidTransform | None]:
    """Left camera from bone in the scored pictures, as the tracker says; None in all others."""
    motion = TrackerMotion(truth)
    poses: list[RigidTransform | None] = [None] * len(times_ns)
    chosen_ns = [times_ns[n] for n in solved.scored]
    rotations, places_mm = motion.at(to_seconds(chosen_ns, motion.origin_ns - solved.offset_ns))
    for n, turn, place in zip(solved.scored, rotations, places_mm, strict=True):
        seen = RigidTransform.from_parts("tracker", "marker", turn, place)
        poses[n] = solved.left_from_tracker @ seen @ solved.marker_from_bone
    return poses


def _undetermined(why: str) -> ResultError:
    return ResultError(
        f"the other tracker's frames cannot be solved: {why}",
        remedy="record the bone for a minute, turned to and fro by ten degrees and more about two "
        "axes, and never twice alike",
    )


def _check_number(given: NDArray[np.bool_], blocks: NDArray[np.int64], n_samples: int) -> None:
    n_pictures, n_blocks = int(given.sum()), len(np.unique(blocks[given]))
    if n_pictures < _LEAST_PICTURES or n_blocks < _LEAST_BLOCKS or n_samples < 2:
        raise _undetermined(
            f"{n_pictures} pictures with an OK pose in {n_blocks} of the seconds to solve with, "
            f"and {n_samples} poses of the tracker; {_LEAST_PICTURES} in {_LEAST_BLOCKS} are needed"
        )


def _gather(
    poses: Sequence[RigidTransform | None],
    since_s: FloatArray,
    blocks: NDArray[np.int64],
    given: NDArray[np.bool_],
) -> BonePoses:
    chosen = [pose for pose, is_given in zip(poses, given, strict=True) if is_given and pose]
    rotations = np.array([pose.rotation for pose in chosen])
    places_mm = np.array([pose.translation_mm for pose in chosen])
    return BonePoses(since_s[given], rotations, places_mm, blocks[given])


def _check_turns(used: BonePoses) -> None:
    """Two axes of turning are needed: about one alone, places along it are not determined."""
    from scipy.spatial.transform import Rotation

    turns = Rotation.from_matrix(used.rotations)
    away = (turns * turns.mean().inv()).as_rotvec()
    spread_deg = np.degrees(np.linalg.svd(away, compute_uv=False)) / np.sqrt(len(away))
    if spread_deg[1] < _LEAST_TURN_DEG:
        raise _undetermined(
            f"the bone turns by {spread_deg[0]:.1f} degrees (rms) about one axis and by "
            f"{spread_deg[1]:.1f} about a second, at least {_LEAST_TURN_DEG:g} is needed"
        )


def _refine(start: _Start, used: BonePoses) -> tuple[_Start, FloatArray, float]:
    """Robust least squares over all unknowns; what is left in the middle picture, mm."""
    from scipy.optimize import least_squares

    fitted = start.motion.knows(used.times_s + start.lag_s)
    seen_mm, times_s = _find_seen(start, used)[fitted], used.times_s[fitted]

    def leave(unknowns: FloatArray) -> FloatArray:
        return (start.predict(unknowns, times_s) - seen_mm).ravel()

    solution = least_squares(
        leave,
        np.zeros(13),
        x_scale="jac",
        loss="soft_l1",
        f_scale=_OUTLIER_MM,
        max_nfev=100,
    )
    squares = 3.0 * (solution.fun**2).reshape(len(times_s), -1).mean(axis=1)
    return start, solution.x, float(np.sqrt(np.median(squares)))


def _find_seen(start: _Start, used: BonePoses) -> FloatArray:
    """(N, K, 3) places of the bone as the poses under test have them."""
    places = start.bone_mm + start.arms_mm
    turned: FloatArray = np.einsum("nij,kj->nki", used.rotations, places)
    return turned + used.places_mm[:, None]


def _choose(
    found: list[tuple[_Start, FloatArray, float]],
) -> tuple[_Start, FloatArray, float]:
    if not found:
        raise _undetermined("no time offset lets half of the recording lie in the tracker's time")
    least_mm = min(fit_mm for _, _, fit_mm in found)
    # Of those that end alike the first, which is the likeliest: last bits must not choose, since
    # the others were solved through the seconds that are scored.
    best = next(one for one in found if one[2] <= _ALIKE * least_mm)
    if best[2] > _MOST_FIT_MM:
        raise _undetermined(
            f"the two motions differ by {best[2]:.1f} mm at the best time offset; is it the "
            "same recording, and did marker and tracker stay fixed"
        )
    lag_s = best[0].lag_s + best[1][12]
    for start, unknowns, fit_mm in found:
        is_other = abs(start.lag_s + unknowns[12] - lag_s) > 0.1
        if is_other and fit_mm < _UNLIKE * best[2]:
            raise _undetermined(
                f"the motion repeats itself, and two time offsets fit as well ({best[2]:.2f} and "
                f"{fit_mm:.2f} mm)"
            )
    return best


def _find_covariance(
    start: _Start, unknowns: FloatArray, used: BonePoses, fitted: NDArray[np.bool_]
) -> FloatArray:
    """(13, 13) of the unknowns; what is left within a block counts as alike (a sandwich)."""
    times_s, blocks = used.times_s[fitted], used.blocks[fitted]
    slopes = _slopes(start, unknowns, times_s)
    left = (start.predict(unknowns, times_s) - _find_seen(start, used)[fitted]).ravel()
    # The weights of the solve's own loss.
    weights = 1.0 / np.sqrt(1.0 + (left / _OUTLIER_MM) ** 2)
    of_row = np.repeat(blocks, len(left) // len(times_s))
    scale = np.linalg.norm(slopes, axis=0)
    scaled = slopes / scale
    bread = np.linalg.pinv(scaled.T @ (weights[:, None] * scaled))
    pulling = scaled * (weights * left)[:, None]
    pulls = np.array([pulling[of_row == one].sum(axis=0) for one in np.unique(blocks)])
    n_blocks = len(pulls)
    filling = pulls.T @ pulls * n_blocks / max(n_blocks - 1, 1)
    covariance: FloatArray = bread @ filling @ bread / np.outer(scale, scale)
    return covariance


def _slopes(start: _Start, unknowns: FloatArray, times_s: FloatArray) -> FloatArray:
    """(rows, 13) of the predicted places, by central differences."""
    columns = []
    for n in range(len(unknowns)):
        step = np.zeros(len(unknowns))
        step[n] = 1e-5
        up, down = (start.predict(unknowns + sign * step, times_s) for sign in (1.0, -1.0))
        columns.append((up - down).ravel() / 2e-5)
    return np.column_stack(columns)
