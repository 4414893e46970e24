"""Moves a simulated hand to where the board is wanted."""

from navapp.control.capture.interfaces import BoardHand
from navapp.geometry.transform import RigidTransform

# A hand that was not good enough after so long goes there again, then gives up.
_PATIENCE_NS, _MOST_TRIES = 3_000_000_000, 2


class HandControl:
    """Tells a hand where to go, while it is on.

    Args:
        hand: that holds the board; None: somebody's own.
    """

    def __init__(self, hand: BoardHand | None) -> None:
        self._hand = hand
        self.is_on = False
        self._moved_at_ns: int | None = None
        self._n_tries = 0

    @property
    def has_hand(self) -> bool:
        """There is one to be told."""
        return self._hand is not None

    def switch(self, *, is_on: bool) -> None:
        """Begin, or leave the hand to the keys."""
        self.is_on = is_on
        self.begin()

    def begin(self) -> None:
        """There is a new place to go to."""
        self._moved_at_ns, self._n_tries = None, 0

    def nudge(
        self, shift_mm: tuple[float, float, float], turn_rad: tuple[float, float, float]
    ) -> None:
        """Move the hand a little; it no longer follows."""
        if self._hand is not None:
            self.is_on = False
            self._hand.nudge(shift_mm, turn_rad)

    def step(self, wanted: RigidTransform, now_ns: int) -> bool:
        """Go on; False when the place was tried often enough."""
        if self._hand is None or not self.is_on:
            return True
        if self._moved_at_ns is not None and now_ns - self._moved_at_ns <= _PATIENCE_NS:
            return True
        if self._n_tries == _MOST_TRIES:
            return False
        self._n_tries += 1
        self._moved_at_ns = now_ns
        self._hand.move_to(wanted)
        return True
