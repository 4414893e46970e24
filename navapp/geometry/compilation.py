"""Tells when kernels are compiled, which happens once on a machine for every kind of call.

Kernels that are in the cache are read from there and not told.
"""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager


class Compilation:
    """How many kernels were compiled since the watch began, by any thread."""

    def __init__(self) -> None:
        self._count = 0
        self._n_running = 0
        self._lock = threading.Lock()

    @property
    def count(self) -> int:
        """So many were begun."""
        return self._count

    @property
    def is_running(self) -> bool:
        """One is being compiled at this moment."""
        return self._n_running > 0

    def begin(self) -> int:
        """One more is compiled; answers with the count."""
        with self._lock:
            self._count += 1
            self._n_running += 1
            return self._count

    def end(self) -> None:
        """One is done."""
        with self._lock:
            self._n_running -= 1


@contextmanager
def watch_compilation(
    on_kernel: Callable[[int, str], None] = lambda _count, _name: None,
) -> Iterator[Compilation]:
    """Count the kernels that are compiled inside the block.

    Args:
        on_kernel: called by the compiling thread when one is begun, with count and name.
    """
    from numba.core import event

    compilation = Compilation()

    class Listener(event.Listener):  # type: ignore[misc]
        def on_start(self, event: event.Event) -> None:
            on_kernel(compilation.begin(), event.data["dispatcher"].py_func.__name__)

        def on_end(self, event: event.Event) -> None:
            compilation.end()

    listener = Listener()
    event.register("numba:compile", listener)
    try:
        yield compilation
    finally:
        event.unregister("numba:compile", listener)
