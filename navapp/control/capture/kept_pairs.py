"""The pairs that were kept, in memory and in their store."""

import numpy as np
from numpy.typing import NDArray

from calibration.rig.acceptance import find_occupied_cells
from calibration.targets.seen_pairs import SeenPair
from navapp.control.capture.board_view import BoardView
from navapp.control.capture.interfaces import PairStore


class KeptPairs:
    """Adds and drops; the number of a dropped pair is not given again.

    Args:
        store: of the raw pictures.
        size: width and height of a picture, px.
    """

    def __init__(self, store: PairStore, size: tuple[int, int]) -> None:
        self._store, self._size = store, size
        self._pairs: list[SeenPair] = []
        self._next_index = 0
        self.covered = self._cells()

    def __len__(self) -> int:
        return len(self._pairs)

    @property
    def pairs(self) -> list[SeenPair]:
        """A list of the caller's own."""
        return list(self._pairs)

    def add(self, view: BoardView) -> SeenPair | None:
        """Keep a view; None when one of the cameras does not see the board.

        Raises:
            InputError: the pictures cannot be written; then nothing is kept.
        """
        pair = view.to_pair(self._next_index)
        if pair is not None:
            self._store.keep(pair.index, view.frame)
            self._next_index += 1
            self._pairs.append(pair)
            self.covered = self._cells()
        return pair

    def drop_last(self) -> SeenPair | None:
        """Forget the last pair and its pictures; None when there is none."""
        if not self._pairs:
            return None
        pair = self._pairs.pop()
        self._store.drop(pair.index)
        self.covered = self._cells()
        return pair

    def _cells(self) -> NDArray[np.bool_]:
        """(2, 6, 8) cells of the left and right picture with marks in them."""
        sides = (
            [pair.left.pixels for pair in self._pairs],
            [pair.right.pixels for pair in self._pairs],
        )
        return np.stack(
            [find_occupied_cells(np.vstack([np.empty((0, 2)), *one]), self._size) for one in sides]
        )
