"""Runs work whose kernels may have to be compiled first, and says so only then."""

import time
from collections.abc import Callable
from typing import TypeVar

from navapp.cli.diagnostics import Diagnostics

T = TypeVar("T")

# Of shorter work, reading the kernels from the cache is a good part: it is done once more, too.
_SHORT_S = 2.0


def tell_kernels(diagnostics: Diagnostics) -> Callable[[int, str], None]:
    """What a watch calls at every kernel: it counts on a terminal, and says one line elsewhere."""

    def tell(count: int, name: str) -> None:
        if diagnostics.has_live_line:
            diagnostics.tell_live(f"compiling kernels, once on a machine: {count} ({name})")
        elif count == 1:
            diagnostics.note("compiling kernels, once on a machine")

    return tell


def run_compiled(work: Callable[[], T], diagnostics: Diagnostics) -> T:
    """The work's answer, its own timings without compilation.

    When kernels were compiled meanwhile, or when it is short, the work is done once more: both
    answers are the same, and only the second one's timings say how long the work takes.
    """
    from navapp.geometry.compilation import watch_compilation

    started = time.perf_counter()
    with watch_compilation(tell_kernels(diagnostics)) as compilation:
        answer = work()
    if compilation.count:
        diagnostics.tell_live(f"kernels compiled: {compilation.count}", is_last=True)
    is_short = time.perf_counter() - started < _SHORT_S
    return work() if compilation.count or is_short else answer
