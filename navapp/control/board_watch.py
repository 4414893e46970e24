"""Measures a board of known size with the session's rig, while frames are handled."""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from drivers.frames import Image, StereoFrame
from navapp.control.executors import Executor, Job
from navapp.control.length_check import MOST_LOOKS, Finding, Length, LengthCheck, pool_lengths

# Often enough for a board that is shown for some seconds; a slow look takes at most a tenth of the
# time, so that tracking keeps its cores.
_PERIOD_NS, _LEAST_PERIODS_OF_A_LOOK = 2_000_000_000, 10
# Looks at a board that is shown belong together until it was not seen for so long, or for so many
# periods.
_SHOWING_NS, _SHOWING_PERIODS = 10_000_000_000, 2.5

# Of the left and the right picture; None where not both of them show the board.
MeasureLength = Callable[[Image, Image], Length | None]


@dataclass(frozen=True, slots=True)
class _Look:
    """What was measured, None where the board was not seen; and how long that took."""

    length: Length | None
    took_ns: int


class BoardWatch:
    """Looks for the board in one frame at a time, in an executor of its own: no frame waits for it.

    Args:
        measure: finds the board in a pair and measures it.
        worst_share: of a length that may be wrong.
        executor: runs the looks; closed with the watch.
        now_ns: the session's clock, by which looks are timed.

    Attributes:
        newest: the newest look at the board, with those of the same showing; None before one.
        judged: the newest that says something of the rig; None before one.
    """

    def __init__(
        self,
        measure: MeasureLength,
        worst_share: float,
        executor: Executor,
        now_ns: Callable[[], int],
    ) -> None:
        self._measure, self._worst, self._executor = measure, worst_share, executor
        self._now_ns = now_ns
        self._job: Job[_Look] | None = None
        self._began_ns, self._due_ns = 0, 0
        self._lengths: deque[Length] = deque(maxlen=MOST_LOOKS)
        self._is_told = False
        self.newest: LengthCheck | None = None
        self.judged: LengthCheck | None = None

    def look(self, frame: StereoFrame) -> None:
        """Begin, when it is time and no look runs."""
        if self._job is not None or frame.captured_ns < self._due_ns:
            return
        self._began_ns = frame.captured_ns
        self._job = Job(lambda report: self._measure_and_time(frame))
        self._executor.start(self._job)

    def take_over(self) -> LengthCheck | None:
        """A check that is to be told: the first of a showing that is judged, or one that is off.

        A bug in the look is not hidden: it is raised.
        """
        job = self._job
        if job is None or not job.is_finished:
            return None
        self._job = None
        if job.error is not None:
            raise job.error
        if job.result is None:
            return None
        period_ns = max(_PERIOD_NS, _LEAST_PERIODS_OF_A_LOOK * job.result.took_ns)
        self._due_ns = self._began_ns + period_ns
        return None if job.result.length is None else self._add(job.result.length, period_ns)

    def close(self) -> None:
        """Wait for a look that still runs."""
        self._executor.close()

    def _measure_and_time(self, frame: StereoFrame) -> "_Look":
        # The measurement alone is timed, not the wait until a frame takes its result over.
        started_ns = self._now_ns()
        length = self._measure(frame.left, frame.right)
        return _Look(length, self._now_ns() - started_ns)

    def _add(self, length: Length, period_ns: int) -> LengthCheck | None:
        last = self.newest
        longest_ns = max(_SHOWING_NS, _SHOWING_PERIODS * period_ns)
        if last is not None and self._began_ns - last.captured_ns > longest_ns:
            self._lengths.clear()
            self._is_told = False
        self._lengths.append(length)
        self.newest = pool_lengths(tuple(self._lengths), self._began_ns, self._worst)
        if self.newest.is_judged:
            self.judged = self.newest
        is_news = self.newest.is_judged and not self._is_told
        self._is_told = self._is_told or is_news
        return self.newest if is_news or self.newest.finding is Finding.OFF else None
