"""Work on two threads: the one that asks, and one helper."""

import threading
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from typing import Generic, Self, TypeVar

_Answer = TypeVar("_Answer")
_Other = TypeVar("_Other")
_Item = TypeVar("_Item")
Rows = tuple[int, int]

_lock = threading.Lock()
_pools: list[ThreadPoolExecutor] = []
_here = threading.local()


def _mark() -> None:
    _here.is_alone = True


def pool() -> ThreadPoolExecutor:
    """The one helper, made at first use; its jobs may wait for none that was begun after them."""
    with _lock:
        if not _pools:
            _pools.append(ThreadPoolExecutor(1, initializer=_mark))
        return _pools[0]


class Job(Generic[_Answer]):
    """Work that is offered to the helper.

    If the helper has not begun when the answer is asked for, the thread that asks does the work.
    As a context manager nothing of it runs on when the block is left: the job is waited for, or
    dropped if the block raises.
    """

    def __init__(self, work: Callable[[], _Answer]) -> None:
        self._work = work
        # The helper itself has nobody beside it.
        is_alone = getattr(_here, "is_alone", False)
        self._begun: Future[_Answer] | None = None if is_alone else pool().submit(work)
        self._taken: list[_Answer] = []
        self._asking = threading.Lock()

    def result(self) -> _Answer:
        """The answer, or what went wrong, raised; whoever asks at the same time waits for it."""
        with self._asking:
            if not self._taken:
                if self._begun is None or self._begun.cancel():
                    self._taken.append(self._work())
                else:
                    self._taken.append(self._begun.result())
            return self._taken[0]

    @property
    def is_fetched(self) -> bool:
        """The answer was asked for and is there."""
        return bool(self._taken)

    def drop(self) -> None:
        """The answer is not wanted: never begun, or waited for; its errors are not raised."""
        if self._begun is not None and not self._begun.cancel():
            self._begun.exception()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is None:
            self.result()
        else:
            self.drop()


def begin_on_helper(work: Callable[[], _Answer]) -> Job[_Answer]:
    """Begin a job on the helper, if it is free before the answer is asked for."""
    return Job(work)


def run_both(first: Callable[[], _Answer], second: Callable[[], _Other]) -> tuple[_Answer, _Other]:
    """Run two jobs side by side and wait for both answers; the first one's error goes before."""
    with begin_on_helper(second) as other:
        answer = first()
    return answer, other.result()


def map_both(
    job: Callable[[_Item], _Answer], items: Sequence[_Item], on_progress: Callable[[float], None]
) -> list[_Answer]:
    """The answers for all items, in order; either thread does every second one.

    The asking thread tells the fraction done before each of its items; what that raises stops both.
    """
    found: dict[int, _Answer] = {}

    def run(first: int) -> None:
        for number in range(first, len(items), 2):
            if first == 0:
                on_progress(number / len(items))
            found[number] = job(items[number])

    run_both(partial(run, 0), partial(run, 1))
    on_progress(1.0)
    return [found[number] for number in range(len(items))]


def in_row_bands(
    height: int,
    job: Callable[[Rows], object],
    every: int = 8,
    middle: int | None = None,
    first: int = 0,
) -> None:
    """Run `job((first row, row after the last))` for the upper and the lower half of the rows.

    Args:
        height: number of rows.
        job: of some rows.
        every: the lower half begins at a multiple of this: a job for every n-th row meets its rows.
        middle: row before which half of the work lies; by default half of the rows.
        first: number of the first row.
    """
    middle = (height // 2 if middle is None else middle) // every * every
    middle, last = first + middle, first + height
    run_both(partial(job, (first, middle)), partial(job, (middle, last)))


def in_two_shares(job: Callable[[int, int], object]) -> None:
    """Run `job(first_row, step)` for the even and for the odd rows: both have as much to do."""
    run_both(partial(job, 0, 2), partial(job, 1, 2))
