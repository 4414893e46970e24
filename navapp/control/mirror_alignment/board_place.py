"""Where the corners of the board are, from both cameras, and whether it rests there."""

from collections import deque
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from calibration.rig.corner_locator import locate_marks
from calibration.targets.boards import Board
from navapp.control.capture.board_view import BoardView
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import FloatArray, RigidTransform

# A place is told by as many corners.
_FEWEST_CORNERS = 6
# A corner's place is believed to no better than this: marks and rig leave as much.
_LEAST_SD_MM = 0.05
# At rest: so many looks in a row whose corners stay within so much of each other.
_N_STILL, _STILL_MM = 2, 0.4
_N_REMEMBERED = 5
_MOST_PAUSE_NS = 3_000_000_000


@dataclass(frozen=True, slots=True, eq=False)
class BoardPlace:
    """The board's corners at one instant, in the left camera's frame."""

    time_ns: int  # of the pictures' capture
    ids: NDArray[np.intp]  # (n,) rows of `Board.points_mm`, ascending
    points_mm: FloatArray  # (n, 3)
    sds_mm: FloatArray  # (n,) standard error of a coordinate
    left_from_board: RigidTransform  # of all of them together

    def point_of(self, corner: int) -> FloatArray | None:
        """(3,) mm of a corner; None when it is not seen by both cameras."""
        found = np.flatnonzero(self.ids == corner)
        return self.points_mm[found[0]] if len(found) else None

    def moved_mm(self, other: "BoardPlace", corner: int | None = None) -> float:
        """Median distance of the corners of both; infinite when they share too few.

        Args:
            other: an earlier place.
            corner: whose own way counts when it is longer: a turn moves the rim farther than most.
        """
        _, a, b = np.intersect1d(self.ids, other.ids, return_indices=True)
        if len(a) < _FEWEST_CORNERS:
            return float("inf")
        usual_mm = float(np.median(np.linalg.norm(self.points_mm[a] - other.points_mm[b], axis=1)))
        point_mm = None if corner is None else self.point_of(corner)
        if point_mm is None:
            return usual_mm
        # By the poses, in which all corners have a say: one corner alone is seen less well.
        before_mm = other.left_from_board.apply(self.left_from_board.inverse().apply(point_mm))
        return max(usual_mm, float(np.linalg.norm(point_mm - before_mm)))


def locate_board(view: BoardView, board: Board, rig: StereoRig) -> BoardPlace | None:
    """Triangulate all corners that both cameras see; None when these are too few."""
    pair = view.to_pair(0)
    if pair is None:
        return None
    ids, points = locate_marks(rig, pair)
    if len(ids) < _FEWEST_CORNERS:
        return None
    sigma_px = np.hypot(
        pair.left.sigma_px[np.isin(pair.left.ids, ids)],
        pair.right.sigma_px[np.isin(pair.right.ids, ids)],
    )
    pose = RigidTransform.fit("left", "board", points, board.points_mm[ids])
    time_ns = view.frame.captured_ns
    return BoardPlace(time_ns, ids, points, _sds_mm(rig, points[:, 2], sigma_px), pose)


def _sds_mm(rig: StereoRig, depths_mm: FloatArray, sigma_px: FloatArray) -> FloatArray:
    """(n,) of a coordinate, the mean of the three directions; `sigma_px` of a disparity."""
    baseline_mm = float(np.linalg.norm(rig.right_from_left.translation_mm))
    aside = depths_mm / rig.left.focal_px * sigma_px / np.sqrt(2.0)
    ahead = depths_mm**2 / (rig.left.focal_px * baseline_mm) * sigma_px
    told: FloatArray = np.sqrt((2.0 * aside**2 + ahead**2) / 3.0 + _LEAST_SD_MM**2)
    return told


class BoardLooks:
    """The newest places of the board, as long as it rests."""

    def __init__(self) -> None:
        self._resting: deque[BoardPlace] = deque(maxlen=_N_REMEMBERED)

    @property
    def newest(self) -> BoardPlace | None:
        """None when it is not seen now."""
        return self._resting[-1] if self._resting else None

    @property
    def steady(self) -> BoardPlace | None:
        """The newest place, with those corners alone that were seen in every look at rest."""
        newest = self.newest
        if newest is None:
            return None
        kept = np.ones(len(newest.ids), dtype=bool)
        for place in self._resting:
            kept &= np.isin(newest.ids, place.ids)
        return replace(
            newest,
            ids=newest.ids[kept],
            points_mm=newest.points_mm[kept],
            sds_mm=newest.sds_mm[kept],
        )

    @property
    def is_still(self) -> bool:
        """It has been at rest for some looks."""
        return len(self._resting) >= _N_STILL

    def add(self, place: BoardPlace | None) -> None:
        """Take a look; one from elsewhere, or after a pause, begins anew."""
        if place is None:
            self.forget()
            return
        first = self._resting[0] if self._resting else None
        if first is not None and (
            place.moved_mm(first) > _STILL_MM
            or place.time_ns - self._resting[-1].time_ns > _MOST_PAUSE_NS
        ):
            self.forget()
        self._resting.append(place)

    def forget(self) -> None:
        """Nothing is known of where it is."""
        self._resting.clear()

    def average(self, corner: int, since_ns: int) -> tuple[FloatArray, float] | None:
        """(3,) mm of a corner and its standard error, over the looks since then.

        None when the newest look does not show it. The error counts as that of one look: what
        the marks err while the board rests is the same in all of them.
        """
        newest = self.newest
        last = None if newest is None else newest.point_of(corner)
        if newest is None or last is None:
            return None
        before = [
            point
            for place in list(self._resting)[:-1]
            if place.time_ns >= since_ns and (point := place.point_of(corner)) is not None
        ]
        sd_mm = float(newest.sds_mm[newest.ids == corner][0])
        return np.mean([*before, last], axis=0), sd_mm
