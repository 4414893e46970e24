"""Processes that do jobs; they end with the process that began them."""

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from typing import TypeVar

from navapp.errors import NavappError

_Item = TypeVar("_Item")


def run_in_processes(
    do: Callable[[_Item], object], items: Sequence[_Item], n_processes: int
) -> Iterator[_Item]:
    """Items, each as soon as it is done; after an error or an interrupt no further one is begun.

    Args:
        do: the job; found again by its name in another process.
        items: what it is done with.
        n_processes: at a time.

    Raises:
        NavappError: a process was killed; what the job itself raises comes as it is.
    """
    if not items:
        return
    # Spawned: a process that was forked from one with threads may hang.
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(
        min(n_processes, len(items)), mp_context=context, initializer=_begin
    ) as pool:
        jobs = {pool.submit(do, item): item for item in items}
        try:
            for job in as_completed(jobs):
                job.result()
                yield jobs[job]
        except BrokenProcessPool as error:
            raise NavappError(
                "a process of the evaluation was killed; what is done is kept",
                remedy="run again, with fewer --processes if memory was short",
            ) from error
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


def _begin() -> None:
    # Ctrl+C reaches all processes of a terminal; the first one lets the others finish.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """Without this, workers whose parent was killed would wait for jobs for ever."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
