"""Growing pauses between attempts to open a lost device.

The first ones are short, so that a device which recovers soon is back soon. Later ones are longer,
because every attempt costs the device or its bus something.
"""


class Backoff:
    """Pauses that double up to the longest.

    Args:
        first_s: the first pause, s.
        longest_s: no pause is longer, s.
    """

    def __init__(self, first_s: float, longest_s: float) -> None:
        self._first_s, self._longest_s = first_s, longest_s
        self._next_s = first_s

    def next_pause_s(self) -> float:
        """The pause before the next attempt, in s; the one after it is longer."""
        pause_s = self._next_s
        self._next_s = min(2.0 * pause_s, self._longest_s)
        return pause_s

    def reset(self) -> None:
        """The device is back: begin with the first pause again."""
        self._next_s = self._first_s
