"""Pairs pictures of two unsynchronised cameras by their times."""

import threading
from collections import deque
from dataclasses import dataclass

from drivers.frames import Image

# A camera whose partner stalls must not fill the memory.
_MOST_WAITING = 4


@dataclass(frozen=True, slots=True, eq=False)
class TimedPicture:
    """A picture and when it was taken."""

    picture: Image  # (H, W) or (H, W, 3) uint8
    captured_ns: int  # mid exposure


class PairMatcher:
    """Pairs each picture with the nearest one of the other eye; what finds no partner is counted.

    The limit must be below half of the frame period: then no picture has two partners within it,
    and the nearest is known as soon as it comes. Both reader threads call it.
    """

    def __init__(self, max_skew_ns: int) -> None:
        """Start empty.

        Args:
            max_skew_ns: greatest difference of the capture times of a pair.
        """
        self._max_skew_ns = max_skew_ns
        self._waiting: tuple[deque[TimedPicture], deque[TimedPicture]] = (deque(), deque())
        self._lock = threading.Lock()
        self._n_unpaired = 0
        # A picture that stays alone stands between two of the other eye.
        self._misses_ns: deque[int] = deque(maxlen=2)

    @property
    def n_unpaired(self) -> int:
        """Pictures that were dropped without a partner."""
        return self._n_unpaired

    @property
    def last_miss_ns(self) -> int | None:
        """How far apart the last two pictures were that could not be paired; None before."""
        return min(self._misses_ns, default=None)

    def add(self, eye: int, picture: TimedPicture) -> tuple[TimedPicture, TimedPicture] | None:
        """Take the next picture of an eye (0 left, 1 right); the newest pair that it completes."""
        pair = None
        with self._lock:
            left, right = self._waiting
            self._waiting[eye].append(picture)
            if len(self._waiting[eye]) > _MOST_WAITING:
                self._drop(eye)
            while left and right:
                skew_ns = right[0].captured_ns - left[0].captured_ns
                if abs(skew_ns) <= self._max_skew_ns:
                    pair = left.popleft(), right.popleft()
                else:
                    self._misses_ns.append(abs(skew_ns))
                    # The other eye only goes on from here: the older one stays alone.
                    self._drop(0 if skew_ns > 0 else 1)
        return pair

    def _drop(self, eye: int) -> None:
        self._waiting[eye].popleft()
        self._n_unpaired += 1
