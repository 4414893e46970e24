"""The alignment at one moment, for the screen."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibration.mirror.alignments import MOST_ALIGNMENTS, advise, count_depths
from calibration.targets.boards import Board
from drivers.frames import StereoFrame
from navapp.control.capture.board_view import BoardView
from navapp.control.mirror_alignment.aimed_corner import AimedCorner
from navapp.control.mirror_alignment.board_place import BoardLooks
from navapp.control.mirror_alignment.corner_previews import preview_seen
from navapp.control.mirror_alignment.guidance import Goal, Guide
from navapp.control.mirror_alignment.kept_crosses import KeptCrosses
from navapp.control.mirror_alignment.solution import DisplaySolution
from navapp.control.mirror_alignment.states import AlignmentPhase, AlignmentSnapshot
from navapp.values.pictures import EyeLook


@dataclass(frozen=True, slots=True, eq=False)
class Parts:
    """What an alignment consists of."""

    time_ns: int
    phase: AlignmentPhase
    names: tuple[str, str]  # of camera and display
    board: Board
    frame: StereoFrame | None  # the newest
    view: BoardView | None  # the newest
    eye: EyeLook | None  # a simulated one
    has_hand: bool
    is_following: bool
    looks: BoardLooks
    guide: Guide
    goal: Goal | None
    aimed: AimedCorner | None
    cross_px: tuple[int, int] | None
    solution: DisplaySolution
    kept: KeptCrosses
    events: tuple[str, ...]
    n_events: int
    trouble: str
    question: str


def make_snapshot(parts: Parts) -> AlignmentSnapshot:
    """For the screen."""
    corner = None if parts.aimed is None else parts.aimed.corner
    sides = (None, None) if parts.view is None else (parts.view.left, parts.view.right)
    counts = [0 if side is None else len(side.ids) for side in sides]
    n_depths, range_mm = _count_depths(parts)
    display = parts.solution.display
    return AlignmentSnapshot(
        time_ns=parts.time_ns,
        phase=parts.phase,
        camera=parts.names[0],
        display=parts.names[1],
        eye=display.viewing_eye,
        has_hand=parts.has_hand,
        is_following=parts.is_following,
        pictures=_pictures(parts, corner),
        has_eye=parts.eye is not None,
        n_seen=(counts[0], counts[1], len(parts.board.points_mm)),
        corner=corner,
        row_column=(0, 0) if corner is None else row_and_column(parts.board, corner),
        cross_px=parts.cross_px,
        flips=parts.solution.flips,
        is_upside_down=display.reads_upside_down,
        moved_mm=None if parts.aimed is None else parts.aimed.moved_mm(parts.looks.newest),
        is_still=parts.looks.is_still,
        instruction=_instruct(parts),
        n_kept=len(parts.kept),
        n_depths=n_depths,
        range_mm=range_mm,
        used=_count_used(parts),
        verdict=parts.solution.verdict,
        events=parts.events,
        n_events=parts.n_events,
        trouble=parts.trouble,
    )


def row_and_column(board: Board, corner: int) -> tuple[int, int]:
    """Of a corner, from 1; the first one is at the board's own upper left."""
    columns = board.columns - int(board.has_squares)
    return corner // columns + 1, corner % columns + 1


def name_corner(board: Board, corner: int) -> str:
    """Its row and column, in words."""
    row, column = row_and_column(board, corner)
    return f"row {row}, column {column}"


def _pictures(
    parts: Parts, corner: int | None
) -> tuple[NDArray[np.uint8], NDArray[np.uint8]] | None:
    frame = None if parts.frame is None else (parts.frame.left, parts.frame.right)
    both = preview_seen(parts.view, frame, corner)
    if both is None or parts.eye is None:
        return both
    return both[0], parts.eye(corner, len(parts.kept))


def _count_depths(parts: Parts) -> tuple[int, float]:
    """How many depths the alignments lie at, over how many mm: from the eye, or from the camera."""
    if len(parts.kept) == 0:
        return 0, 0.0
    model = parts.solution.know(parts.kept).model
    found, points = parts.solution.found, parts.kept.alignments.points_mm
    if found is not None:
        # As the verdict counts: without strays.
        points = points[found.is_used]
    far_mm = 1e6 * np.array([0.0, 0.0, -1.0])
    return count_depths(points, far_mm if model is None else model.eye_mm)


def _count_used(parts: Parts) -> NDArray[np.int64]:
    """(3, 3) alignments in each ninth of the display, as the eye reads it."""
    used = np.zeros((3, 3), np.int64)
    display, flips = parts.solution.display, parts.solution.flips
    for u, v in parts.kept.alignments.pixels:
        column = min(int(3.0 * u / display.width_px), 2)
        row = min(int(3.0 * v / display.height_px), 2)
        used[2 - row if flips[1] else row, 2 - column if flips[0] else column] += 1
    return used


def _instruct(parts: Parts) -> str:
    """What to do next, one sentence."""
    if parts.question:
        return parts.question
    if parts.phase is AlignmentPhase.SOLVING:
        return "solving"
    if parts.aimed is not None:
        name = name_corner(parts.board, parts.aimed.corner)
        found = parts.solution.found
        if parts.aimed.is_confirmed:
            return f"hold still: {name} is measured"
        if len(parts.kept) == 0:
            eye = parts.solution.display.viewing_eye
            return (
                f"move the cross onto {name} as the {eye} eye alone sees it, with your head at "
                "rest, then ENTER"
            )
        if found is None:
            return f"move the cross onto {name}, then ENTER"
        quality = found.model.quality
        if quality is not None and quality.is_accepted:
            return f"this is enough: s saves; or move the cross onto {name}, then ENTER"
        if len(parts.kept) >= MOST_ALIGNMENTS:
            return advise(found, len(parts.kept))
        return f"move the cross onto {name}, then ENTER"
    place = parts.looks.newest
    if place is None:
        return "put the board where both cameras see it, and the eye sees the display before it"
    if parts.goal is not None:
        return parts.goal.tell(parts.guide.middle_of(place))
    if not parts.looks.is_still:
        return "hold the board still"
    return "no corner of the board can be had here: move the board"
