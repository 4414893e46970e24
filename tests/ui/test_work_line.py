"""The line of long work, with and without a known end."""

import math

from navapp.control.states import Progress, SessionState
from navapp.ui.work_line import WorkLine
from tests.ui import snapshots
from tests.ui.test_panels import lines_of, view_of


def test_work_whose_end_is_not_known_has_no_bar():
    (known,) = lines_of(WorkLine(), view_of(snapshots.starting()), 100, 1)
    assert "42 %" in known
    progress = Progress("compiling kernels: 57 so far", math.nan)
    (line,) = lines_of(WorkLine(), view_of(snapshots.starting(progress=progress)), 100, 1)
    assert line.strip() == "compiling kernels: 57 so far"


def test_a_registration_can_be_cancelled_while_kernels_are_compiled():
    progress = Progress("compiling kernels: 57 so far", math.nan)
    snapshot = snapshots.starting(progress=progress, state=SessionState.REGISTERING)
    for width in (100, 40):
        (line,) = lines_of(WorkLine(), view_of(snapshot), width, 1)
        assert line.endswith("  c cancel")
        assert len(line) <= width
