"""What is aligned next: a corner of the board as it lies, or the board somewhere else."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from calibration.mirror.alignment_start import AlignedDisplay
from calibration.mirror.alignments import (
    FEWEST_ALIGNMENTS,
    LEAST_RANGE_MM,
    AlignedCalibration,
    choose_next,
    choose_spread,
    compute_gains,
    count_depths,
    has_depth,
)
from calibration.targets.boards import Board
from navapp.control.mirror_alignment.board_place import BoardPlace
from navapp.control.mirror_alignment.first_crosses import is_on_display
from navapp.control.mirror_alignment.kept_crosses import KeptCrosses
from navapp.geometry.display_model import DisplayModel
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import FloatArray

# Before there is a solution: heights of the board against the first one, along the line of sight,
# and alignments at each. The first three that can be had are taken.
_HEIGHTS_MM, _AT_EACH = (0.0, 40.0, -40.0, 80.0, -80.0), 4
_N_HEIGHTS = -(-FEWEST_ALIGNMENTS // _AT_EACH)
SAME_HEIGHT_MM, _NEAR_MM = 14.0, 12.0
# Beyond what is asked for, so that it is surely reached.
_SPARE_MM = 6.0
_NEAR_ASIDE_MM = 20.0
# Better places lie so far aside of the first one, each way: within 60 mm of it.
_ASIDE_MM = 42.0
# The board is moved when that helps so much more than any corner where it lies.
_WORTH_MOVING, _FEWEST_AT_PLACE = 1.5, 3
_AXIS_OF_CAMERAS = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, slots=True, eq=False)
class Goal:
    """A place that the board is wanted at."""

    middle_mm: FloatArray  # (3,) of the board's middle
    axes: FloatArray  # (3, 3) rows: right and down as the eye sees it, away from it
    is_of_height: bool  # the height alone counts
    height_mm: float  # against the first one, along the line of sight
    away_from: str  # what it is lowered from: cameras or eye
    why: str = ""

    def left_mm(self, place_middle_mm: FloatArray) -> FloatArray:
        """(3,) of the way that is left: right, down, away."""
        way: FloatArray = self.axes @ (self.middle_mm - place_middle_mm)
        return way * (0.0, 0.0, 1.0) if self.is_of_height else way

    def is_reached(self, place_middle_mm: FloatArray) -> bool:
        """It is near enough."""
        right, down, away = np.abs(self.left_mm(place_middle_mm))
        return bool(away < _NEAR_MM and max(right, down) < _NEAR_ASIDE_MM)

    def tell(self, place_middle_mm: FloatArray) -> str:
        """The way in words."""
        right, down, away = self.left_mm(place_middle_mm)
        parts = []
        if abs(away) >= _NEAR_MM:
            verb, whither = ("lower", "away from") if away > 0.0 else ("raise", "towards")
            parts.append(f"{verb} the board by {abs(away):.0f} mm, {whither} the {self.away_from}")
        aside = [
            f"{abs(mm):.0f} mm {words[int(mm > 0.0)]}"
            for mm, words in ((right, ("to the left", "to the right")), (down, ("up", "down")))
            if abs(mm) >= _NEAR_ASIDE_MM
        ]
        if aside:
            parts.append(f"move it {' and '.join(aside)} as you see it")
        said = "; ".join(parts) or "hold the board still"
        return f"{said} ({self.why})" if self.why else said


@dataclass(frozen=True, slots=True, eq=False)
class Known:
    """What is known when the next alignment is chosen."""

    kept: KeptCrosses
    model: DisplayModel | None  # solved or rough; None before
    found: AlignedCalibration | None  # None before there is a solution
    flips: tuple[bool, bool]  # columns and rows are shown the other way than the eye reads them

    @property
    def axes(self) -> FloatArray:
        """(3, 3) rows: right and down as the eye sees it, away from it."""
        model = self.model
        if model is None:
            return np.eye(3)
        points = self.kept.alignments.points_mm
        ahead = points.mean(axis=0) - model.eye_mm
        ahead /= np.linalg.norm(ahead)
        right = model.screen.across * (-1.0 if self.flips[0] else 1.0)
        right = right - (right @ ahead) * ahead
        right /= np.linalg.norm(right)
        down = model.screen.down * (-1.0 if self.flips[1] else 1.0)
        down = down - (down @ ahead) * ahead - (down @ right) * right
        return np.vstack([right, down / np.linalg.norm(down), ahead])

    @property
    def away_from(self) -> str:
        """What the third axis leads away from."""
        return "cameras" if self.model is None else "eye"


class Guide:
    """Chooses the next corner, or the next place of the board.

    Args:
        display: that shows the crosses.
        board: that lies at the site.
        rig: of the two cameras.
    """

    def __init__(self, display: AlignedDisplay, board: Board, rig: StereoRig) -> None:
        self._display, self._board, self._rig = display, board, rig
        self._middle_mm = board.points_mm.mean(axis=0)
        self._skipped_corners: set[int] = set()
        self._refused_mm: list[FloatArray] = []  # (3,) of the board's middle
        self._stays = False  # a better place was refused: a corner comes first

    def skip_corner(self, corner: int) -> None:
        """It cannot be had where the board lies."""
        self._skipped_corners.add(corner)

    def skip_goal(self, goal: Goal) -> None:
        """The board cannot be brought to that very place."""
        self._refused_mm.append(goal.middle_mm)
        self._stays = not goal.is_of_height

    def forget_corners(self) -> None:
        """The board lies elsewhere, or an alignment was made: all corners are on offer again."""
        self._skipped_corners.clear()
        self._stays = False

    def middle_of(self, place: BoardPlace) -> FloatArray:
        """(3,) of the board's middle."""
        return place.left_from_board.apply(self._middle_mm)

    def choose(self, known: Known, place: BoardPlace) -> Goal | int | None:
        """A goal for the board, or the id of a corner; None when no corner can be had."""
        if len(known.kept) == 0:
            return self._choose_corner(known, place)
        if known.found is None:
            return self._find_height(known, place) or self._choose_corner(known, place)
        return (
            self._find_depth(known, known.found, place)
            or self._find_better_place(known, known.found, place)
            or self._choose_corner(known, place)
        )

    def _heights(self, known: Known, place: BoardPlace) -> tuple[FloatArray, float]:
        """(N,) of the board at each alignment, and now, against the first one."""
        ahead = known.axes[2]
        middles = known.kept.middles_mm
        now = float((self.middle_of(place) - middles[0]) @ ahead)
        return (middles - middles[0]) @ ahead, now

    def _find_height(self, known: Known, place: BoardPlace) -> Goal | None:
        """Three heights, one after the other."""
        heights, _ = self._heights(known, place)
        goals = [self._goal_at(known, place, height) for height in _HEIGHTS_MM]
        wanted = [goal for goal in goals if not self._is_refused(goal.middle_mm)][:_N_HEIGHTS]
        for goal in wanted:
            if np.count_nonzero(np.abs(heights - goal.height_mm) < SAME_HEIGHT_MM) < _AT_EACH:
                return None if goal.is_reached(self.middle_of(place)) else goal
        return None

    def _find_depth(
        self, known: Known, found: AlignedCalibration, place: BoardPlace
    ) -> Goal | None:
        """Depths that the verdict asks for: beyond the nearer end of the heights so far.

        When both ends were refused, a corner is offered, and after it both ends again: without
        more depth nothing is accepted.
        """
        used = known.kept.alignments.points_mm[found.is_used]
        n_depths, range_mm = count_depths(used, found.model.eye_mm)
        if has_depth(n_depths, range_mm):
            return None
        heights, now = self._heights(known, place)
        more = max(LEAST_RANGE_MM + _SPARE_MM - range_mm, SAME_HEIGHT_MM)
        ends = [float(heights.max()) + more, float(heights.min()) - more]
        goals = [
            goal
            for end in sorted(ends, key=lambda end: abs(end - now))
            if not self._is_refused((goal := self._goal_at(known, place, end)).middle_mm)
        ]
        if not goals:
            self._refused_mm.clear()
            return None
        return None if goals[0].is_reached(self.middle_of(place)) else goals[0]

    def _is_refused(self, middle_mm: FloatArray) -> bool:
        return any(np.linalg.norm(middle_mm - one) < _NEAR_ASIDE_MM for one in self._refused_mm)

    def _goal_at(self, known: Known, place: BoardPlace, height: float) -> Goal:
        """Straight along the line of sight."""
        _, now = self._heights(known, place)
        middle = self.middle_of(place) + (height - now) * known.axes[2]
        return Goal(
            middle, known.axes, is_of_height=True, height_mm=height, away_from=known.away_from
        )

    def _find_better_place(
        self, known: Known, found: AlignedCalibration, place: BoardPlace
    ) -> Goal | None:
        """Where corners would help so much more that the board is worth moving.

        Places around the first one: the site does not wander.
        """
        middle = self.middle_of(place)
        near = np.linalg.norm(known.kept.middles_mm - middle, axis=1) < SAME_HEIGHT_MM
        if self._stays or np.count_nonzero(near) < _FEWEST_AT_PLACE:
            return None
        heights, now = self._heights(known, place)
        goals: list[Goal] = []
        aside = (-_ASIDE_MM, 0.0, _ASIDE_MM)
        for right, down, height in product(aside, aside, (heights.min(), now, heights.max())):
            wanted = known.kept.middles_mm[0] + np.array([right, down, height]) @ known.axes
            goal = Goal(
                wanted, known.axes, False, float(height), "eye", self._third_of(known, wanted)
            )
            if not (goal.is_reached(middle) or self._is_refused(wanted)):
                goals.append(goal)
        corners = place.left_from_board.apply(self._board.points_mm)
        moved = [corners + goal.middle_mm - middle for goal in goals]
        here, *gains = self._best_gains(known, found, [place.points_mm, *moved])
        best = max(range(len(goals)), key=gains.__getitem__, default=None)
        if best is None or not gains[best] > _WORTH_MOVING * here:
            return None
        return goals[best]

    def _best_gains(
        self, known: Known, found: AlignedCalibration, places_mm: Sequence[FloatArray]
    ) -> list[float]:
        """For each place, the largest gain of a corner (N, 3) that can be had there; 0 without one.

        All places at once: a projection costs the same for many points.
        """
        offered = [corners_mm[self._can_be_had(known, corners_mm)] for corners_mm in places_mm]
        points = np.concatenate(offered)
        gains = compute_gains(found, points) if len(points) else np.empty(0)
        ends = np.cumsum([len(corners_mm) for corners_mm in offered])[:-1]
        return [float(of_place.max(initial=0.0)) for of_place in np.split(gains, ends)]

    def _can_be_had(self, known: Known, points_mm: FloatArray) -> NDArray[np.bool_]:
        """(N,) bool: on the display and in both pictures."""
        rig = self._rig
        has = np.ones(len(points_mm), dtype=bool)
        if known.model is not None:
            has &= is_on_display(self._display, known.model.project(points_mm))
        for camera, points in (
            (rig.left, points_mm),
            (rig.right, rig.right_from_left.apply(points_mm)),
        ):
            pixels = camera.project(points)
            size = np.array([camera.width, camera.height])
            has &= (points[:, 2] > 0.0) & ((pixels > 0) & (pixels < size - 1)).all(axis=1)
        return has

    def _third_of(self, known: Known, middle_mm: FloatArray) -> str:
        """Which third of the display is used there."""
        if known.model is None:
            return ""
        share = known.model.project(middle_mm[None])[0][0] / self._display.width_px
        share = 1.0 - share if known.flips[0] else share
        name = ("left", "middle", "right")[int(np.clip(3.0 * share, 0.0, 2.0))]
        return f"use the {name} third of the display"

    def _choose_corner(self, known: Known, place: BoardPlace) -> int | None:
        """The one that helps most; one that was not aligned at this height, if there is one."""
        offered = np.array(
            [k for k, id_ in enumerate(place.ids) if int(id_) not in self._skipped_corners],
            dtype=np.intp,
        )
        offered = offered[self._can_be_had(known, place.points_mm[offered])]
        new = np.array(
            [k for k in offered if int(place.ids[k]) not in self._done_here(known, place)]
        )
        offered = new.astype(np.intp) if len(new) else offered
        if len(offered) == 0:
            return None
        points = place.points_mm[offered]
        if known.found is None:
            best = choose_spread(known.kept.alignments.points_mm, points)
        else:
            best = choose_next(known.found, points)
        return int(place.ids[offered[best]])

    def _done_here(self, known: Known, place: BoardPlace) -> set[int]:
        if len(known.kept) == 0:
            return set()
        heights, now = self._heights(known, place)
        near = np.abs(heights - now) < SAME_HEIGHT_MM
        return {c for c, is_near in zip(known.kept.corners, near, strict=True) if is_near}
