"""Processes that do jobs; they end with the process that began them."""

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing.connection import Connection
from typing import TypeVar

from navapp.errors import NavappError

_Item = TypeVar("_Item")


def run_in_processes(
    do: Callable[[_Item], object], items: Sequence[_Item], n_processes: int
) -> Iterator[_Item]:
    """Items, each as soon as it is done; from the main thread.

    After an error or an interrupt the processes are ended at once, whatever they are at.

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
    # Nothing is ever written: it ends when this process closes it, or is killed.
    reader, writer = context.Pipe(duplex=False)
    n_processes = min(n_processes, len(items))
    with (
        reader,
        writer,
        ProcessPoolExecutor(n_processes, context, initializer=_begin, initargs=(reader,)) as pool,
    ):
        with _without_interrupts():
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
            if not all(job.done() for job in jobs):
                writer.close()
            pool.shutdown(wait=True, cancel_futures=True)


@contextmanager
def _without_interrupts() -> Iterator[None]:
    """Processes that are begun in it ignore ctrl+c, which reaches all of a terminal."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _begin(reader: Connection) -> None:
    threading.Thread(target=_end_with, args=(reader,), daemon=True).start()


def _end_with(reader: Connection) -> None:
    """Without this, workers whose parent was killed would wait for jobs for ever."""
    reader.poll(None)
    os._exit(1)
