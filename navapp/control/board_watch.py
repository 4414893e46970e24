"""A board of known size, looked for beside the frames: what the rig makes of its lengths."""

from collections import deque
from collections.abc import Callable

from drivers.frames import Image, StereoFrame
from navapp.control.executors import Executor, Job
from navapp.control.length_check import MOST_LOOKS, Finding, Length, LengthCheck, pooled

# Often enough for a board that is shown for some seconds; a slow look takes at most a tenth of the
# time, so that the line keeps its cores.
_PERIOD_NS, _LEAST_PERIODS_OF_A_LOOK = 2_000_000_000, 10
# Looks of one showing belong together.
_SHOWING_NS = 10_000_000_000

# Of the left and the right picture; None where not both of them show the board.
MeasureLength = Callable[[Image, Image], Length | None]


class BoardWatch:
    """One look at a time, in an executor of its own: no frame waits for it.

    Args:
        measure: finds the board in a pair and measures it.
        worst_share: of a length that may be wrong.
        executor: runs the looks; closed with the watch.

    Attributes:
        newest: the newest look at the board, with those of the same showing; None before one.
    """

    def __init__(self, measure: MeasureLength, worst_share: float, executor: Executor) -> None:
        self._measure, self._worst, self._executor = measure, worst_share, executor
        self._job: Job[Length | None] | None = None
        self._began_ns, self._due_ns = 0, 0
        self._lengths: deque[Length] = deque(maxlen=2 * MOST_LOOKS)
        self._is_told = False
        self.newest: LengthCheck | None = None

    def look(self, frame: StereoFrame) -> None:
        """Begin, when it is time and no look runs."""
        if self._job is not None or frame.captured_ns < self._due_ns:
            return
        self._began_ns = frame.captured_ns
        self._job = Job(lambda report: self._measure(frame.left, frame.right))
        self._executor.start(self._job)

    def take_over(self, now_ns: int) -> LengthCheck | None:
        """A check that is to be told: the first of a showing that is judged, or one that is off.

        A bug in the look is not hidden: it is raised.
        """
        job = self._job
        if job is None or not job.is_finished:
            return None
        self._job = None
        took_ns = now_ns - self._began_ns
        self._due_ns = self._began_ns + max(_PERIOD_NS, _LEAST_PERIODS_OF_A_LOOK * took_ns)
        if job.error is not None:
            raise job.error
        return None if job.result is None else self._added(job.result)

    def close(self) -> None:
        """Wait for a look that still runs."""
        self._executor.close()

    def _added(self, length: Length) -> LengthCheck | None:
        last = self.newest
        if last is not None and self._began_ns - last.captured_ns > _SHOWING_NS:
            self._lengths.clear()
            self._is_told = False
        self._lengths.append(length)
        self.newest = pooled(tuple(self._lengths), self._began_ns, self._worst)
        is_news = self.newest.is_judged and not self._is_told
        self._is_told = self._is_told or is_news
        return self.newest if is_news or self.newest.finding is Finding.OFF else None
