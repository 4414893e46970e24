"""Plans the view of the board that a calibration needs next; run in a worker."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calibration.rig.bundle_adjustment import Bundle, solve_bundle
from calibration.rig.dropped_pairs import DroppedPair, find_misfits
from calibration.rig.initial_rig import matrix_of, pose_of, start_poses, start_rig
from calibration.rig.next_view import find_next_view
from calibration.rig.parameters import RigModel, pack, unpack
from calibration.rig.uncertainty import compute_bounds_mm, make_working_points_mm
from calibration.targets.boards import Board
from calibration.targets.detection import SeenBoard
from calibration.targets.seen_pairs import SeenPair
from navapp.geometry.camera import Camera
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import FloatArray, RigidTransform, rotation_from_vector

# With fewer pairs nothing can be solved.
N_STARTING = 4
# The views asked for first: turn about x, y, z in degrees, and the distance as a share of the way
# from the nearest to the farthest surface. Tilts tell focal lengths from distances.
_STARTING = (
    ((0.0, 0.0, 0.0), 0.5),
    ((-35.0, 0.0, 0.0), 0.5),
    ((0.0, 35.0, 0.0), 0.2),
    ((25.0, -25.0, 90.0), 0.8),
)
# Before there is a rig: a lens that sees 49 deg of the room, as most do.
_NOMINAL_FOCAL = 1.1
_SIMPLEST = 4
_MAD_TO_SIGMA = 1.4826
_NEARLY_ALL = 0.95


@dataclass(frozen=True, slots=True, eq=False)
class NextView:
    """The view that is wanted next, and the rig as far as it is known."""

    # where the board should be held; None when no view helps.
    left_from_board: RigidTransform | None
    left: Camera  # camera to measure and draw with: solved, or a guess before
    rig: StereoRig | None = None  # both, once there is one
    solved: Bundle | None = None  # the bundle; where the next one begins
    indices: tuple[int, ...] = ()  # of the pairs in it
    misfits: tuple[DroppedPair, ...] = ()  # pairs that do not fit the others; they are left out
    # predicted 95 % error that half of the working volume stays below.
    bound_mm: float | None = None
    worst_mm: float | None = None  # the same for nearly all of it


def plan_next_view(
    board: Board,
    pairs: Sequence[SeenPair],
    size: tuple[int, int],
    depth_mm: tuple[float, float],
    last: NextView | None = None,
    avoid: Sequence[FloatArray] = (),
) -> NextView:
    """Solve the simplest rig again and ask what it lacks most.

    Args:
        board: in the operator's hands.
        pairs: kept so far.
        size: width and height of a picture, px.
        depth_mm: nearest and farthest surface of the working volume.
        last: where the solve begins.
        avoid: (3, 3) turns of the board that could not be had.
    """
    start = starting_view(board, len(pairs) + len(avoid), depth_mm)
    if len(pairs) < N_STARTING:
        return NextView(start, nominal_camera(size))
    try:
        return _plan_from_rig(board, pairs, size, depth_mm, last, avoid)
    except (ValueError, np.linalg.LinAlgError):
        # These views explain no rig: more of the starting ones may.
        return NextView(start, nominal_camera(size))


def _plan_from_rig(
    board: Board,
    pairs: Sequence[SeenPair],
    size: tuple[int, int],
    depth_mm: tuple[float, float],
    last: NextView | None,
    avoid: Sequence[FloatArray],
) -> NextView:
    """The next view for a rig that can be solved."""
    solved, used, out = _solve(board, pairs, size, last)
    rig = unpack(solved.model, solved.shared)
    bounds = volume_bounds_mm(solved, depth_mm)
    view = find_next_view(board, solved, noise_px(solved), depth_mm, avoid)
    pose = starting_view(board, 0, depth_mm) if view is None else view
    indices = tuple(pair.index for pair in used)
    if len(bounds) == 0:
        return NextView(pose, rig.left, rig, solved, indices, tuple(out))
    middle_mm, worst_mm = float(np.median(bounds)), float(np.quantile(bounds, _NEARLY_ALL))
    return NextView(pose, rig.left, rig, solved, indices, tuple(out), middle_mm, worst_mm)


def _solve(
    board: Board, pairs: Sequence[SeenPair], size: tuple[int, int], last: NextView | None
) -> tuple[Bundle, list[SeenPair], list[DroppedPair]]:
    """The simplest rig of the pairs that fit together."""
    out: list[DroppedPair] = list(last.misfits) if last is not None else []
    used = [pair for pair in pairs if pair.index not in {one.index for one in out}]
    model = RigModel(_SIMPLEST, 0, *size)
    if last is None or last.solved is None:
        shared = pack(model, start_rig(board, used, size))
        poses = start_poses(board, used, model, shared)
    else:
        shared, poses = last.solved.shared, _poses(board, used, last)
    solved = solve_bundle(board, used, model, shared, poses)
    more = find_misfits(board, used, solved)
    if not more or len(used) - len(more) < N_STARTING:
        return solved, used, out
    bad = {one.index for one in more}
    is_good = np.array([pair.index not in bad for pair in used])
    used = [pair for pair in used if pair.index not in bad]
    solved = solve_bundle(board, used, model, solved.shared, solved.left_from_board[is_good])
    return solved, used, out + more


def _poses(board: Board, pairs: Sequence[SeenPair], last: NextView) -> FloatArray:
    """Where the last solve had them, and a first guess of new ones."""
    assert last.solved is not None  # noqa: S101 (for the type checker: the caller looked)
    known = dict(zip(last.indices, last.solved.left_from_board, strict=True))
    new = [pair for pair in pairs if pair.index not in known]
    if new:
        guessed = start_poses(board, new, last.solved.model, last.solved.shared)
        known |= {pair.index: pose for pair, pose in zip(new, guessed, strict=True)}
    return np.array([known[pair.index] for pair in pairs])


def volume_bounds_mm(solved: Bundle, depth_mm: tuple[float, float]) -> FloatArray:
    """(n,) predicted 95 % errors of points of the working volume, from the covariance."""
    model = solved.model
    points_mm = make_working_points_mm(model, solved.shared, depth_mm)
    if len(points_mm) == 0:
        return np.empty(0)
    return compute_bounds_mm(model, solved.shared, solved.rig_covariance, points_mm)


def noise_px(solved: Bundle) -> float:
    """Standard error of a mark's coordinate, from what is left of all of them."""
    residual_px = np.concatenate([part.ravel() for view in solved.residuals_px for part in view])
    return max(_MAD_TO_SIGMA * float(np.median(np.abs(residual_px))), 1e-4)


def starting_view(board: Board, number: int, depth_mm: tuple[float, float]) -> RigidTransform:
    """Left camera from board, in the middle of the left picture; after the last comes the first."""
    turn_deg, share = _STARTING[number % len(_STARTING)]
    roll = rotation_from_vector(np.radians((0.0, 0.0, turn_deg[2])))
    rotation = rotation_from_vector(np.radians((turn_deg[0], turn_deg[1], 0.0))) @ roll
    place = np.array([0.0, 0.0, depth_mm[0] + share * (depth_mm[1] - depth_mm[0])])
    place -= rotation @ board.points_mm.mean(axis=0)
    return RigidTransform.from_parts("left", "board", rotation, place)


def nominal_camera(size: tuple[int, int]) -> Camera:
    """A guess, good enough to say where a board is held."""
    width, height = size
    focal = _NOMINAL_FOCAL * width
    matrix = np.array(
        [[focal, 0.0, 0.5 * (width - 1)], [0.0, focal, 0.5 * (height - 1)], [0.0, 0.0, 1.0]]
    )
    return Camera(matrix, np.zeros(0), width, height)


def measure_pose(board: Board, seen: SeenBoard, camera: Camera) -> RigidTransform | None:
    """Camera from board as one picture tells it; None when it cannot be told."""
    vector = pose_of(board, seen, camera)
    if vector is None:
        return None
    return RigidTransform("left", "board", matrix_of(vector))
