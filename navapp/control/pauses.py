"""Pauses between attempts to open a lost device.

Short at first, so that what recovers soon is back soon; then longer, because every attempt costs
the device or its bus something.
"""


class Pauses:
    """Each twice as long as the one before, up to the longest."""

    def __init__(self, first_s: float, longest_s: float) -> None:
        self._first_s, self._longest_s = first_s, longest_s
        self._next_s = first_s

    def take_s(self) -> float:
        """The pause before the next attempt, in s."""
        pause_s = self._next_s
        self._next_s = min(2.0 * pause_s, self._longest_s)
        return pause_s

    def begin_again(self) -> None:
        """The device is back: the next loss is a new one."""
        self._next_s = self._first_s
