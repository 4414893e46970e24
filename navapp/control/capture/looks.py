"""One look at a frame: where the board is in both pictures, and whether the pair may be kept."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calibration.targets.boards import Board
from calibration.targets.detection import SeenBoard, find_board
from calibration.targets.seen_pairs import SeenPair
from drivers.frames import StereoFrame
from navapp.control.capture.states import Check
from navapp.geometry.bands import beside
from navapp.geometry.rectification import luma

# Both pictures must share as many marks.
_FEWEST_COMMON = 12
# An edge that is so much wider is placed half as well (its slope carries the information).
_WORST_BLUR = 1.4
# Exposure and the time between both pictures together move a mark by less than its noise:
# 10 ms at this speed are 0.05 px.
_FASTEST_PX_S = 5.0
# Marks that fall on other parts of their pixels err independently.
_LEAST_NEW_PX = 5.0


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """What one frame shows of the board.

    Attributes:
        frame: that was looked at.
        left, right: None where the board is not seen.
    """

    frame: StereoFrame
    left: SeenBoard | None
    right: SeenBoard | None

    def pair(self, index: int) -> SeenPair | None:
        """As a pair of that number; None when a camera does not see the board."""
        if self.left is None or self.right is None:
            return None
        return SeenPair(index, self.left, self.right)


def look_at(frame: StereoFrame, board: Board) -> Look:
    """Find the board in both pictures, side by side."""
    with beside(lambda: find_board(luma(frame.right), board)) as right:
        left = find_board(luma(frame.left), board)
        return Look(frame, left, right.result())


class Shutter:
    """Decides whether a look is worth keeping; remembers the sharpest and the last one."""

    def __init__(self) -> None:
        self._sharpest = [np.inf, np.inf]
        self._last: Look | None = None

    def forget_last(self) -> None:
        """The next look follows on none: how fast the board is cannot be told from before."""
        self._last = None

    def checks(self, look: Look, kept: Sequence[SeenPair]) -> tuple[Check, ...]:
        """Seen, sharp, still, new: all must hold."""
        last, self._last = self._last, look
        pair = look.pair(-1)
        if pair is None:
            missing = [
                side for side, seen in (("left", look.left), ("right", look.right)) if seen is None
            ]
            return (Check("seen", is_met=False, text=f"not by the {' and '.join(missing)} camera"),)
        n_common = len(pair.common()[0])
        return (
            Check("seen", n_common >= _FEWEST_COMMON, f"{n_common} marks by both"),
            self._sharp(pair),
            _still(look, last),
            _new(pair, kept),
        )

    def _sharp(self, pair: SeenPair) -> Check:
        blurs = (pair.left.blur_px, pair.right.blur_px)
        self._sharpest = [min(a, b) for a, b in zip(self._sharpest, blurs, strict=True)]
        ratio = max(blur / best for blur, best in zip(blurs, self._sharpest, strict=True))
        return Check("sharp", ratio <= _WORST_BLUR, f"{max(blurs):.1f} px")


def _still(look: Look, last: Look | None) -> Check:
    if last is None or last.left is None or last.right is None:
        return Check("still", is_met=False)
    seconds = (look.frame.captured_ns - last.frame.captured_ns) / 1e9
    moved = [moved_px(a, b) for a, b in ((look.left, last.left), (look.right, last.right))]
    if None in moved or not seconds > 0.0:
        return Check("still", is_met=False)
    speed = max(one for one in moved if one is not None) / seconds
    return Check("still", speed <= _FASTEST_PX_S, f"{min(speed, 999.0):.0f} px/s")


def _new(pair: SeenPair, kept: Sequence[SeenPair]) -> Check:
    for other in kept:
        moved = [moved_px(pair.left, other.left), moved_px(pair.right, other.right)]
        if all(one is not None and one < _LEAST_NEW_PX for one in moved):
            return Check("new", is_met=False, text=f"as {other.index}")
    return Check("new", is_met=True)


def moved_px(a: SeenBoard | None, b: SeenBoard | None) -> float | None:
    """Root mean square distance of the marks that both show; None when they share too few."""
    if a is None or b is None:
        return None
    _, in_a, in_b = np.intersect1d(a.ids, b.ids, return_indices=True)
    if len(in_a) < _FEWEST_COMMON // 2:
        return None
    return float(np.sqrt(((a.pixels[in_a] - b.pixels[in_b]) ** 2).sum(axis=1).mean()))
