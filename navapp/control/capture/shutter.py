"""The automatic shutter: whether a pair of pictures of the board is worth keeping."""

from collections.abc import Sequence

import numpy as np

from calibration.targets.detection import SeenBoard
from calibration.targets.seen_pairs import SeenPair
from navapp.control.capture.board_view import BoardView
from navapp.control.capture.states import Check

# Both pictures must share as many marks.
_FEWEST_COMMON = 12
# An edge that is so much wider is placed half as well (its slope carries the information).
_WORST_BLUR = 1.4
# Exposure and the time between both pictures together move a mark by less than its noise:
# 10 ms at this speed are 0.05 px.
_FASTEST_PX_S = 5.0
# Marks that fall on other parts of their pixels err independently.
_LEAST_NEW_PX = 5.0


class Shutter:
    """Checks whether a view is worth keeping; remembers the sharpest and the last one."""

    def __init__(self) -> None:
        self._sharpest = [np.inf, np.inf]
        self._last: BoardView | None = None

    def forget_last(self) -> None:
        """Forget the last view: how fast the board moves is not told from it any more."""
        self._last = None

    def check(self, view: BoardView, kept: Sequence[SeenPair]) -> tuple[Check, ...]:
        """Seen, sharp, still, new: a view is worth keeping when all are met."""
        last, self._last = self._last, view
        pair = view.to_pair(-1)
        if pair is None:
            missing = [
                side for side, seen in (("left", view.left), ("right", view.right)) if seen is None
            ]
            return (Check("seen", is_met=False, text=f"not by the {' and '.join(missing)} camera"),)
        n_common = len(pair.common()[0])
        return (
            Check("seen", n_common >= _FEWEST_COMMON, f"{n_common} marks by both"),
            self._check_sharp(pair),
            _check_still(view, last),
            _check_new(pair, kept),
        )

    def _check_sharp(self, pair: SeenPair) -> Check:
        blurs = (pair.left.blur_px, pair.right.blur_px)
        self._sharpest = [min(a, b) for a, b in zip(self._sharpest, blurs, strict=True)]
        ratio = max(blur / best for blur, best in zip(blurs, self._sharpest, strict=True))
        return Check("sharp", ratio <= _WORST_BLUR, f"{max(blurs):.1f} px")


def _check_still(view: BoardView, last: BoardView | None) -> Check:
    if last is None or last.left is None or last.right is None:
        return Check("still", is_met=False)
    seconds = (view.frame.captured_ns - last.frame.captured_ns) / 1e9
    moved = [motion_px(a, b) for a, b in ((view.left, last.left), (view.right, last.right))]
    if None in moved or not seconds > 0.0:
        return Check("still", is_met=False)
    speed = max(one for one in moved if one is not None) / seconds
    return Check("still", speed <= _FASTEST_PX_S, f"{min(speed, 999.0):.0f} px/s")


def _check_new(pair: SeenPair, kept: Sequence[SeenPair]) -> Check:
    for other in kept:
        moved = [motion_px(pair.left, other.left), motion_px(pair.right, other.right)]
        if all(one is not None and one < _LEAST_NEW_PX for one in moved):
            return Check("new", is_met=False, text=f"as {other.index}")
    return Check("new", is_met=True)


def motion_px(a: SeenBoard | None, b: SeenBoard | None) -> float | None:
    """Root mean square distance of the marks that both show; None when they share too few."""
    if a is None or b is None:
        return None
    _, in_a, in_b = np.intersect1d(a.ids, b.ids, return_indices=True)
    if len(in_a) < _FEWEST_COMMON // 2:
        return None
    return float(np.sqrt(((a.pixels[in_a] - b.pixels[in_b]) ** 2).sum(axis=1).mean()))
