"""Decides which pairs of a camera with its own pairing are new and recent enough to return."""

from dataclasses import dataclass


@dataclass(slots=True)
class PairGate:
    """Accepts new and recent pairs of one instant, and counts the others."""

    max_skew_ns: int  # greatest difference of the capture times in a pair
    max_age_ns: int  # greatest age of a pair
    heard_ns: int  # when the last new pair came, good or not
    n_unpaired: int = 0  # pictures in pairs that were too far apart
    n_stale: int = 0  # pairs that were too old
    _last_ns: int = -1

    def admits(self, captured_ns: int, skew_ns: int, now_ns: int) -> bool:
        """Whether a pair goes through; one that is known or from the future is no pair."""
        if not self._last_ns < captured_ns <= now_ns:
            return False
        self._last_ns, self.heard_ns = captured_ns, now_ns
        if abs(skew_ns) > self.max_skew_ns:
            self.n_unpaired += 2
            return False
        if now_ns - captured_ns > self.max_age_ns:
            self.n_stale += 1
            return False
        return True
