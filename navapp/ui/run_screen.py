"""Runs the operator's screen in the terminal from start to end."""

import asyncio
import os
import sys
import traceback
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from navapp.control.states import DeviceHealth, EventLevel, SessionState, Snapshot
from navapp.errors import DeviceError, NavappError, RigError
from navapp.preop import PlanView
from navapp.ui.app import NavigationApp
from navapp.ui.background import Background
from navapp.ui.pictures.graphics import Graphics, Wish, find_graphics
from navapp.ui.quiet_app import drive, say
from navapp.ui.session import Session
from navapp.ui.symbols import choose_symbols
from navapp.ui.terminal import check_terminal, own_terminal
from navapp.ui.tutorial.apps import TutorialApp
from navapp.ui.tutorial.guide import Guide
from navapp.values import Reason


def run_screen(
    session: Session,
    log_path: Path,
    title: str = "navapp",
    *,
    pictures: Wish = "blocks",
    hints: Sequence[str] = (),
    guide: Guide[Snapshot] | None = None,
    background: Background | None = None,
    plan: PlanView | None = None,
) -> int:
    """Run the screen until it ends, then stop the session, whatever happened.

    Args:
        session: that runs already.
        log_path: takes what libraries print meanwhile, and the traceback of a failure.
        title: first word of the title line.
        pictures: how the terminal gets them.
        hints: told when it starts.
        guide: of the tutorial, shown above the picture.
        background: settings and calibrations, for the pages that show them.
        plan: for the page that shows it.

    Returns:
        Exit code; 128 and the number of the signal that ended it. After a failure one sentence is
        on the standard error.
    """
    failure: Exception | None = None
    try:
        check_terminal()
        graphics = find_graphics(pictures, os.environ)
        with own_terminal(log_path):
            symbols = choose_symbols(getattr(sys.__stdout__, "encoding", None), os.environ)
            if symbols.is_ascii and not graphics.has_pixels:
                graphics = Graphics(words=graphics.words)
            told = (*hints, *(() if graphics.has_pixels else (f"pictures are {graphics.words}",)))
            make_app = NavigationApp if guide is None else partial(TutorialApp, guide)
            app = make_app(
                session,
                title,
                symbols=symbols,
                graphics=graphics,
                hints=told,
                background=background,
                plan=plan,
            )
            code = asyncio.run(drive(app))
            failure = app.failure
            if failure is not None:
                traceback.print_exception(failure, file=sys.stderr)
            elif code == 0:
                failure = _fault(session.snapshot())
    except Exception as error:  # noqa: BLE001 (any failure ends in one sentence)
        failure = error
    finally:
        session.stop()
    if failure is None:
        return code
    return say(failure, log_path)


def _fault(snapshot: Snapshot) -> NavappError | None:
    """The fault that the session ended in, with its last alarm's text."""
    if snapshot.state is not SessionState.FAULT:
        return None
    if snapshot.rig_alarm:
        return RigError(snapshot.rig_alarm, remedy=Reason.RIG_MOVED.remedy)
    alarms = [event.text for event in snapshot.events if event.level is EventLevel.ALARM]
    text = alarms[-1] if alarms else "the session ended in a fault"
    is_device = any(device.health is DeviceHealth.LOST for device in snapshot.devices)
    return DeviceError(text) if is_device else NavappError(text)
