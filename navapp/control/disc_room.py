"""How fast a recording fills its disc, and for how long there is room."""

import shutil
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from navapp.errors import InputError

# Other programs need a disc with room as well; a session begins with some minutes' room.
LEAST_FREE_BYTES = 500_000_000
LEAST_FREE_TO_BEGIN_BYTES = 2_000_000_000
_PERIOD_NS = 1_000_000_000
# The rate is a mean over so many periods.
_N_PERIODS = 10
# Minutes are told below this.
_LONG_HOURS = 10.0
_REMEDY = "free room on that disc, or record into a folder on another one"


@dataclass(frozen=True, slots=True)
class RoomLeft:
    """Figures of a recording."""

    written_bytes: int
    free_bytes: int
    bytes_per_s: float | None  # None before there is a figure

    @property
    def minutes_left(self) -> float | None:
        """Until the recording would be stopped; None while that is not known."""
        if not self.bytes_per_s:
            return None
        return max(self.free_bytes - LEAST_FREE_BYTES, 0) / self.bytes_per_s / 60.0

    @property
    def words(self) -> str:
        """For people."""
        parts = [f"{self.written_bytes / 1e6:.0f} MB written"]
        if self.bytes_per_s is not None:
            parts.append(f"{self.bytes_per_s / 1e6:.1f} MB/s")
        parts.append(f"{self.free_bytes / 1e9:.1f} GB free")
        if self.minutes_left is not None:
            hours = self.minutes_left / 60.0
            is_long = hours >= _LONG_HOURS
            parts.append(f"room for {hours:.0f} h" if is_long else f"room for {60 * hours:.0f} min")
        return ", ".join(parts)


def measure_free_bytes(folder: Path) -> int:
    """Of the disc that a folder lies on, or will lie on."""
    while not folder.exists() and folder != folder.parent:
        folder = folder.parent
    return shutil.disk_usage(folder).free


def check_room_to_begin(
    folder: Path, measure_free: Callable[[Path], int] = measure_free_bytes
) -> None:
    """Refuse to begin a recording that would soon be stopped.

    Raises:
        InputError: too little is free.
    """
    free_bytes = measure_free(folder.resolve())
    if free_bytes < LEAST_FREE_TO_BEGIN_BYTES:
        raise InputError(
            f"only {free_bytes / 1e9:.1f} GB are free for the recording in {folder}, "
            f"{LEAST_FREE_TO_BEGIN_BYTES / 1e9:.0f} GB are needed to begin",
            subject=str(folder),
            remedy=_REMEDY,
        )


class DiscRoom:
    """Watches the disc of a recording; looks once a second.

    Args:
        folder: of the recording.
        count_written: bytes so far.
        measure_free: of the disc.
        now_ns: real time: discs do not wait for a simulated one.
    """

    def __init__(
        self,
        folder: Path,
        count_written: Callable[[], int],
        *,
        measure_free: Callable[[Path], int] = measure_free_bytes,
        now_ns: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        self.folder = folder
        self._count_written = count_written
        self._measure_free = measure_free
        self._now_ns = now_ns
        self._looks: deque[tuple[int, int]] = deque(maxlen=_N_PERIODS + 1)
        self._free_bytes = 0
        self._look(now_ns())

    @property
    def left(self) -> RoomLeft:
        """As of the last look."""
        (first_ns, first), (last_ns, last) = self._looks[0], self._looks[-1]
        rate = (last - first) / (last_ns - first_ns) * 1e9 if last_ns > first_ns else None
        return RoomLeft(last, self._free_bytes, rate)

    def check(self) -> None:
        """Look when it is time.

        Raises:
            InputError: the disc is nearly full.
        """
        now_ns = self._now_ns()
        if now_ns - self._looks[-1][0] < _PERIOD_NS:
            return
        self._look(now_ns)
        if self._free_bytes < LEAST_FREE_BYTES:
            raise InputError(
                f"the disc of {self.folder} is nearly full, "
                f"{self._free_bytes / 1e9:.1f} GB are free",
                subject=str(self.folder),
                remedy=_REMEDY,
            )

    def _look(self, now_ns: int) -> None:
        self._looks.append((now_ns, self._count_written()))
        self._free_bytes = self._measure_free(self.folder)
