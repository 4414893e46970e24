"""How far an evaluation is, and about how long it will still take."""

import time
from collections.abc import Callable

from navapp.cli.diagnostics import Diagnostics


class CampaignProgress:
    """Tells of a campaign: a bar on a terminal, elsewhere a line each tenth of it.

    Args:
        n_tests: that are run some at a time.
        n_processes: so many; the tests behind those are run one at a time.
        diagnostics: takes what is told.
        clock: seconds.
    """

    def __init__(
        self,
        n_tests: int,
        n_processes: int,
        diagnostics: Diagnostics,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._n_tests, self._n_processes = n_tests, n_processes
        self._diagnostics, self._clock = diagnostics, clock
        self._begun: tuple[float, float] | None = None  # when, and how much had been done
        self._n_tenths = 0

    def tell(self, n_done: int, n_all: int, name: str) -> None:
        """So many of how many tests are done; the first call is before the first one that is run.

        Args:
            n_done: of them.
            n_all: with those that are run one at a time.
            name: of the last one; empty before the first.
        """
        now_s, done, whole = self._clock(), self._weigh(n_done), self._weigh(n_all)
        if self._begun is None:
            self._begun, self._n_tenths = (now_s, done), int(10.0 * done / whole)
            if n_done:
                self._diagnostics.note(f"{n_done} of {n_all} tests were done before")
            return
        self._diagnostics.detail(f"{n_done} of {n_all}: {name}")
        began_s, before = self._begun
        left_s = (now_s - began_s) * (whole - done) / max(done - before, 1e-9)
        left = f", about {_name_time(left_s)} left" if n_done < n_all else ""
        share = done / whole
        if self._diagnostics.has_live_line:
            self._diagnostics.progress("evaluating", share, left)
        elif not self._diagnostics.is_verbose and int(10.0 * share) > self._n_tenths:
            self._n_tenths = int(10.0 * share)
            self._diagnostics.note(f"{n_done} of {n_all} tests are done{left}")

    def _weigh(self, n_done: int) -> float:
        """In tests that are run some at a time: one that is run alone takes as long as some."""
        return min(n_done, self._n_tests) + self._n_processes * max(0, n_done - self._n_tests)


def _name_time(seconds: float) -> str:
    """As coarse as it is known."""
    return f"{seconds:.0f} s" if seconds < 90.0 else f"{seconds / 60.0:.0f} min"
