"""Runs work whose kernels may have to be compiled first, and says so only then."""

import sys
import time
from collections.abc import Callable
from typing import TypeVar

from navapp.cli.diagnostics import Diagnostics

T = TypeVar("T")

# Of shorter work, reading the kernels from the cache is a good part: it is done once more, too.
_SHORT_S = 2.0


def run_compiled(work: Callable[[], T], diagnostics: Diagnostics) -> T:
    """The work's answer, its own timings without compilation.

    When kernels were compiled meanwhile, or when it is short, the work is done once more: both
    answers are the same, and only the second one's timings say how long the work takes.
    """
    from navapp.geometry.compilation import watch_compilation

    is_terminal = sys.stderr.isatty()

    def tell(count: int, name: str) -> None:
        if is_terminal and not diagnostics.is_quiet:
            sys.stderr.write(f"\r\x1b[Kcompiling kernels, once on a machine: {count} ({name})")
            sys.stderr.flush()
        elif count == 1:
            diagnostics.note("compiling kernels, once on a machine")

    started = time.perf_counter()
    with watch_compilation(tell) as compilation:
        answer = work()
    if compilation.count and is_terminal and not diagnostics.is_quiet:
        sys.stderr.write("\n")
    is_short = time.perf_counter() - started < _SHORT_S
    return work() if compilation.count or is_short else answer
