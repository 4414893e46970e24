"""Pictures of the guided screens; look at a difference before accepting it."""

from collections.abc import Callable
from typing import Any

import pytest

from navapp.ui.accuracy_test.app import AccuracyApp
from navapp.ui.capture.app import CaptureApp
from navapp.ui.mirror_alignment.app import AlignmentApp
from navapp.ui.symbols import UNICODE
from navapp.ui.tool_calibration.app import ToolApp
from tests.ui.accuracy_test.test_app import WAITING
from tests.ui.capture.test_app import SEEKING
from tests.ui.guided import Session
from tests.ui.mirror_alignment.test_app import ALIGNING
from tests.ui.terminals import SIZES
from tests.ui.tool_calibration.test_app import PIVOTING

SCREENS: dict[str, tuple[type[Any], Any]] = {
    "capture": (CaptureApp, SEEKING),
    "mirror": (AlignmentApp, ALIGNING),
    "tool": (ToolApp, PIVOTING),
    "accuracy": (AccuracyApp, WAITING),
}


@SIZES
@pytest.mark.parametrize("screen", list(SCREENS))
def test_screen(screen: str, size: tuple[int, int], snap_compare: Callable[..., bool]) -> None:
    make_app, snapshot = SCREENS[screen]
    app = make_app(Session(snapshot), symbols=UNICODE, polls_per_s=0)

    async def look(pilot: Any) -> None:
        await pilot.pause()
        pilot.app.poll()
        await pilot.pause()

    assert snap_compare(app, terminal_size=size, run_before=look)
