"""Jobs side by side, on the two threads of one shared pool."""

import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from typing import TypeVar

_Answer = TypeVar("_Answer")

_N_THREADS = 2
_lock = threading.Lock()
_pools: list[ThreadPoolExecutor] = []
_here = threading.local()


def _mark() -> None:
    _here.is_of_pool = True


def pool() -> ThreadPoolExecutor:
    """The pool of two threads, made at first use; its jobs must not wait for other jobs of it."""
    with _lock:
        if not _pools:
            _pools.append(ThreadPoolExecutor(_N_THREADS, initializer=_mark))
        return _pools[0]


def run_both(first: Callable[[], object], second: Callable[[], object]) -> None:
    """Run two jobs side by side and wait for both; the first error is raised.

    A thread of the pool runs them one after the other: if both threads waited for others of the
    pool, none would be left to do the work.
    """
    if getattr(_here, "is_of_pool", False):
        first()
        second()
        return
    jobs = [pool().submit(first), pool().submit(second)]
    errors = [job.exception() for job in jobs]
    for error in errors:
        if error is not None:
            raise error


@contextmanager
def beside(job: Callable[[], _Answer]) -> Iterator["Future[_Answer]"]:
    """A job on a thread of the pool while the caller goes on; it is over when the block is left.

    A thread of the pool does it itself, at once. Its error is raised at the end of the block at the
    latest; an error of the block itself goes before it.
    """
    future = _begun(job)
    try:
        yield future
    except BaseException:
        if not future.cancel():
            future.exception()
        raise
    future.result()


def _begun(job: Callable[[], _Answer]) -> "Future[_Answer]":
    if not getattr(_here, "is_of_pool", False):
        return pool().submit(job)
    done: Future[_Answer] = Future()
    try:
        done.set_result(job())
    except Exception as error:  # noqa: BLE001 - as an executor does
        done.set_exception(error)
    return done


def in_row_bands(height: int, job: Callable[[int, int], object], every: int = 8) -> None:
    """Run `job(first_row, last_row)` for the upper and the lower half of the rows.

    Args:
        height: number of rows.
        job: of some rows.
        every: the lower half begins at a multiple of this: a job for every n-th row meets its rows.
    """
    middle = height // (2 * every) * every
    run_both(lambda: job(0, middle), lambda: job(middle, height))
