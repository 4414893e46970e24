"""The display as the alignments tell it so far, solved beside the loop."""

from dataclasses import replace

import numpy as np

from calibration.mirror.alignment_start import AlignedDisplay
from calibration.mirror.alignments import FEWEST_ALIGNMENTS, AlignedCalibration
from navapp.control.executors import Executor, Job
from navapp.control.mirror_alignment.first_crosses import make_rough_model
from navapp.control.mirror_alignment.guidance import Known
from navapp.control.mirror_alignment.interfaces import Solve
from navapp.control.mirror_alignment.kept_crosses import KeptCrosses
from navapp.control.mirror_alignment.states import DisplayVerdict
from navapp.errors import NavappError
from navapp.geometry.display_model import DisplayModel


class DisplaySolution:
    """Solves anew whenever an alignment was made or forgotten.

    Args:
        display: that shows the crosses.
        executor: runs the solve.
        solve: the display from alignments.

    Attributes:
        display: with what the arrows told.
        flips: columns and rows are shown the other way than the eye reads them.
        found: the newest solution; None before, and while the alignments changed since.
        trouble: why there is none though there are enough alignments.
    """

    def __init__(self, display: AlignedDisplay, executor: Executor, solve: Solve) -> None:
        self.display, self._executor, self._solve = display, executor, solve
        # Seen by one mirror, either columns or rows are read the other way.
        self.flips = not display.reads_upside_down, display.reads_upside_down
        self.found: AlignedCalibration | None = None
        self.trouble = ""
        self._rough: DisplayModel | None = None
        self._job: Job[AlignedCalibration] | None = None

    @property
    def is_under_way(self) -> bool:
        """A solve runs."""
        return self._job is not None

    def know(self, kept: KeptCrosses) -> Known:
        """What the choice of the next alignment may use."""
        model = self._rough if self.found is None else self.found.model
        return Known(kept, model, self.found, self.flips)

    def begin(self, kept: KeptCrosses) -> None:
        """The alignments have changed."""
        self.cancel()
        self.found, self.trouble, made, display = None, "", kept.alignments, self.display
        self._rough = make_rough_model(display, made)
        if self._rough is not None:
            self.flips = self._rough.flips_columns, self._rough.flips_rows
        if len(made.pixels) < FEWEST_ALIGNMENTS:
            return
        self._job = Job(lambda report: self._solve(display, made))
        self._executor.start(self._job)

    def take(self) -> bool:
        """Take a solve over that has finished; whether one has."""
        job = self._job
        if job is None or not job.is_finished:
            return False
        self._job = None
        if isinstance(job.error, NavappError | np.linalg.LinAlgError):
            self.trouble = str(job.error)
        elif job.error is not None:
            raise job.error
        self.found = job.result
        if self.found is not None:
            self.flips = self.found.model.flips_columns, self.found.model.flips_rows
        return True

    def turn(self, kept: KeptCrosses, *, columns: bool, rows: bool) -> None:
        """The cross went the other way; once the display is solved, both belong together."""
        if self._rough is not None or self.found is not None:
            columns = rows = columns or rows
        self.flips = self.flips[0] ^ columns, self.flips[1] ^ rows
        if rows:
            self.display = replace(self.display, reads_upside_down=self.flips[1])
            self.begin(kept)

    def cancel(self) -> None:
        """What runs is not wanted any more."""
        if self._job is not None:
            self._job.cancel()
            self._job = None

    @property
    def verdict(self) -> DisplayVerdict | None:
        """Of the newest solution."""
        if self.found is None or self.found.model.quality is None:
            return None
        quality, is_used = self.found.model.quality, self.found.is_used
        return DisplayVerdict(
            float("nan") if quality.error_mm is None else quality.error_mm,
            quality.is_accepted,
            quality.reasons,
            int(is_used.sum()),
            tuple(int(k) for k in np.flatnonzero(~is_used)),
            self.found.alignment_sd_px,
        )
