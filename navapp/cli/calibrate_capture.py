"""`navapp calibrate capture`: guided capture of a stereo rig's pictures, then the rig."""

import argparse
import json
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from navapp.cli.diagnostics import Diagnostics, check_writable, write_json
from navapp.errors import DeviceError, ResultError, UsageError

if TYPE_CHECKING:
    from calibration.rig.rig_solution import Calibration
    from calibration.targets.boards import Board
    from calibration.targets.seen_pairs import SeenPair
    from drivers.interfaces import CameraInfo
    from navapp.config import CalibrationSection
    from navapp.control.capture.capture import Capture
    from navapp.control.capture.folder import CaptureFolder
    from navapp.control.capture.states import CaptureSnapshot, Outcome
    from navapp.devices import OpenedCapture
    from navapp.geometry.rig import StereoRig
    from navapp.ui.tutorial.guide import Guide

_EXAMPLE = """\
examples:
  navapp calibrate capture --board board.json --out capture/             the simulated rig
  navapp calibrate capture --board board.json --out capture/ --headless  without a screen
  navapp --config mine.toml calibrate capture --board board.json --out capture/

The folder gets every pair as soon as it is kept, the board, and after the solve report.html and,
when the rig is accepted, rig.yml. Without a screen a simulated hand follows every wish.
"""
# Without a screen: some twenty views in a row that cannot be had.
_MOST_FRAMES_A_PAIR = 600
# As in a session without a screen.
_LOST_NS = 10_000_000_000


def add_parser(subparsers: Any) -> None:
    """Declare the part."""
    parser = subparsers.add_parser(
        "capture",
        help="guided capture on the configured camera; by default on the simulated rig",
        epilog=_EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--board", required=True, metavar="BOARD.json", help="what is shown")
    parser.add_argument("--out", required=True, metavar="DIR", help="new folder for everything")
    parser.add_argument(
        "--headless", action="store_true", help="no screen; a simulated hand follows every wish"
    )
    parser.add_argument(
        "--pairs",
        type=int,
        metavar="N",
        help="enough with N pairs (default: [calibration] stop_capture_mm decides)",
    )
    parser.add_argument("--json", metavar="FILE", help="result for programs (- is stdout)")
    parser.set_defaults(guide=None)  # of `navapp tutorial`, beside the pictures


def run(options: argparse.Namespace, diagnostics: Diagnostics) -> int:
    """Capture, solve, judge; the exit code."""
    from calibration.targets.boards import read_board
    from navapp.config import find_file, load
    from navapp.control.capture.folder import CaptureFolder
    from navapp.control.capture.next_view import N_STARTING
    from navapp.devices import open_capture

    check_writable(options.json)
    if options.pairs is not None and options.pairs < N_STARTING:
        raise UsageError(f"--pairs must be at least {N_STARTING}: fewer cannot be solved")
    configuration = load(find_file(options.config))
    if options.headless and configuration.camera.backend != "simulated":
        raise UsageError(
            "--headless needs the simulated rig: nobody else holds the board",
            remedy="leave --headless away",
        )
    board, folder = read_board(options.board), CaptureFolder(Path(options.out))
    folder.begin(json.loads(Path(options.board).read_text(encoding="utf-8")))
    with ExitStack() as undo:
        undo.callback(folder.discard_if_empty)
        opened = open_capture(configuration, board, is_headless=options.headless)
        undo.callback(opened.camera.close)
        solver = _Solver(board, opened.camera.info, configuration.calibration, folder)
        capture = _capture(opened, solver, options)
        undo.callback(capture.close)
        if options.headless:
            _headless(capture, diagnostics)
        elif (code := _on_screen(capture, options.guide)) != 0:
            return code
        last = capture.snapshot
    return _finish(last, solver, options, diagnostics)


def _capture(opened: "OpenedCapture", solver: "_Solver", options: argparse.Namespace) -> "Capture":
    from navapp.control.capture.capture import Capture
    from navapp.control.capture.interfaces import CaptureSettings
    from navapp.control.executors import InlineExecutor, ThreadExecutor

    section = solver.section
    return Capture(
        opened.camera,
        opened.clock,
        solver.board,
        CaptureSettings(section.working_depth_mm, section.stop_capture_mm, n_pairs=options.pairs),
        executor=InlineExecutor() if options.headless else ThreadExecutor(),
        store=solver.folder,
        solve=solver,
        hand=opened.hand,
        reopen=opened.reopen,
    )


class _Solver:
    """Solves the rig of a capture, judges it and writes its files."""

    def __init__(
        self,
        board: "Board",
        info: "CameraInfo",
        section: "CalibrationSection",
        folder: "CaptureFolder",
    ) -> None:
        self.board, self._info, self.section, self.folder = board, info, section, folder
        self.found: tuple[Calibration, StereoRig] | None = None

    def __call__(self, pairs: "list[SeenPair]", report: Callable[[float], None]) -> "Outcome":
        from calibration.report.html_report import write_report
        from calibration.rig.acceptance import Limits
        from calibration.rig.rig_solution import solve_rig
        from navapp.cli.calibrate_stereo import with_record
        from navapp.control.capture.states import Outcome
        from navapp.geometry.rig_files import write_rig

        section, info, folder = self.section, self._info, self.folder.path
        limits = Limits(accept_mm=section.accept_mm, depth_mm=section.working_depth_mm)
        size = (info.width, info.height)
        found = solve_rig(self.board, pairs, size, limits=limits, on_progress=report)
        rig = replace(with_record(found, section, folder.name), serials=info.serials)
        write_report(folder / "report.html", replace(found, rig=rig), limits)
        is_accepted = rig.quality is not None and rig.quality.is_accepted
        path = folder / "rig.yml"
        if is_accepted:
            write_rig(path, rig)
        else:
            # One of an earlier solve would be taken for this one.
            path.unlink(missing_ok=True)
        self.found = found, rig
        reasons = () if rig.quality is None else rig.quality.reasons
        return Outcome(is_accepted, tuple(reasons))


def _headless(capture: "Capture", diagnostics: Diagnostics) -> None:
    """The script: follow every wish, finish when it is enough."""
    from navapp.control.capture.states import Finish, Follow
    from navapp.control.recent_events import list_new_events

    capture.submit(Follow(is_on=True))
    told, n_kept, n_waited, well_ns = 0, 0, 0, capture.snapshot.time_ns
    snapshot = capture.step()
    while not snapshot.is_enough:
        n_waited = 0 if snapshot.n_kept > n_kept else n_waited + 1
        n_kept = snapshot.n_kept
        well_ns = well_ns if snapshot.trouble else snapshot.time_ns
        if snapshot.time_ns - well_ns > _LOST_NS:
            raise DeviceError(f"{snapshot.trouble}, but nothing came; {n_kept} pairs are kept")
        if n_waited > _MOST_FRAMES_A_PAIR:
            raise ResultError(
                f"no wanted view can be taken after {n_kept} pairs ({snapshot.instruction})",
                remedy="use a larger board, or solve what is kept with `navapp calibrate stereo`",
            )
        snapshot = capture.step()
        for text in list_new_events(snapshot, told):
            bound = snapshot.bound_mm
            diagnostics.detail(f"{text}{'' if bound is None else f' ({bound:.2f} mm)'}")
        told = snapshot.n_events
    capture.submit(Finish())
    while snapshot.outcome is None:
        snapshot = capture.step()


def _on_screen(capture: "Capture", guide: "Guide[CaptureSnapshot] | None") -> int:
    """The operator does it; 0, or the code of what ended the screen."""
    from navapp.cli.guided_screen import run_on_screen
    from navapp.ui.capture.app import run_capture_app

    if guide is None:
        return run_on_screen(capture, "capture", run_capture_app)
    from navapp.ui.tutorial.apps import TutorialCaptureApp

    make_app = partial(TutorialCaptureApp, guide)
    return run_on_screen(capture, "capture", partial(run_capture_app, make_app=make_app))


def _finish(
    last: "CaptureSnapshot",
    solver: _Solver,
    options: argparse.Namespace,
    diagnostics: Diagnostics,
) -> int:
    """Tell and write the result; the exit code."""
    from navapp.cli.calibrate_stereo import make_content, tell

    figures = {
        "pairs_kept": last.n_kept,
        "enough": last.is_enough,
        "predicted_mm": {"median": last.bound_mm, "p95": last.worst_mm},
    }
    if solver.found is not None:
        figures |= make_content(*solver.found)
    write_json(options.json, "calibrate capture", figures)
    if solver.found is not None and options.json != "-":
        tell(*solver.found, diagnostics)
    if solver.found is None:
        why = "" if last.outcome is None else f" ({'; '.join(last.outcome.sentences)})"
        raise ResultError(
            f"no rig was solved{why}; {last.n_kept} pairs are kept in {options.out}",
            remedy="solve them with `navapp calibrate stereo`, or capture again",
        )
    quality = solver.found[1].quality
    if quality is not None and not quality.is_accepted:
        raise ResultError(
            f"the rig is not accepted: {'; '.join(quality.reasons)}",
            remedy=f"see {options.out}/report.html, and show the board as the reasons ask",
        )
    return 0
