"""The alignments of `navapp calibrate mirror --by-keys`: the operator makes them with keys."""

import argparse
from contextlib import ExitStack
from datetime import date
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from navapp.cli.alignment_files import write_alignments
from navapp.cli.diagnostics import Diagnostics, check_writable
from navapp.cli.mirror_options import USUAL_GLASS_DEG, USUAL_GLASS_MM, find_pitch_mm
from navapp.errors import DeviceError, ResultError, RigError, UsageError

if TYPE_CHECKING:
    from calibration.mirror.alignment_fit import Alignments
    from calibration.mirror.alignment_start import AlignedDisplay
    from calibration.targets.boards import Board
    from navapp.config import Configuration
    from navapp.control.mirror_alignment.alignment import MirrorAlignment
    from navapp.devices import OpenedAlignment
    from navapp.geometry.display_model import ViewingEye
    from navapp.geometry.rig import StereoRig

# Without a screen: so many frames without a new alignment are too many.
_MOST_FRAMES_A_CROSS = 60
_FRAMES_A_TRY = 10
# As in a session without a screen.
_LOST_NS = 10_000_000_000


def alignments_path(options: argparse.Namespace) -> Path:
    """Where the alignments are kept."""
    if options.save_alignments is not None:
        return Path(options.save_alignments)
    return Path(options.out).with_suffix(".alignments.json")


def unfinished_path(options: argparse.Namespace) -> Path:
    """Where they are kept after every cross, until the session has ended."""
    path = alignments_path(options)
    return path.with_name(f"{path.stem}.unfinished{path.suffix}")


def align_by_keys(
    options: argparse.Namespace, configuration: "Configuration", diagnostics: Diagnostics
) -> "tuple[AlignedDisplay, Alignments] | int":
    """Let the operator, or a script without a screen, align crosses; kept in a file.

    Returns:
        The code of what ended the screen, if that was not the operator.

    Raises:
        UsageError: a board without a size.
        ResultError: fewer alignments than a solve needs.
        NavappError: a device, the rig or the board.
    """
    from calibration.mirror.alignments import check_alignments
    from calibration.targets.boards import read_board
    from navapp.devices import open_mirror_alignment

    board = read_board(options.board)
    if board.spacing_mm == 1.0:
        raise UsageError(
            f"board {options.board} is its own unit of length",
            remedy="measure it, and give its lengths in mm",
        )
    if options.rig is not None:
        camera = configuration.camera.model_copy(update={"rig": options.rig})
        configuration = configuration.model_copy(update={"camera": camera})
    check_writable(str(alignments_path(options)))
    with ExitStack() as undo:
        opened = open_mirror_alignment(configuration, board, is_headless=options.headless)
        undo.callback(opened.close)
        _check_rig(opened.rig)
        session = make_session(opened, board, options, configuration)
        undo.callback(_keep, session, options, diagnostics)
        undo.callback(session.close)
        if options.headless:
            _headless(session, opened, diagnostics)
        elif (code := _on_screen(session)) != 0:
            return code
    display, given = session.made
    check_alignments(given)
    return display, given


def check_options(options: argparse.Namespace, configuration: "Configuration") -> None:
    """Refuse what cannot be done, before any device is opened.

    Raises:
        UsageError: the sentence says why.
    """
    from navapp.ui.terminal import check_terminal

    if options.board is None:
        raise UsageError(
            "--by-keys needs the board that lies at the site", remedy="give --board BOARD.json"
        )
    if options.viewing_eye == "camera":
        raise UsageError(
            "--by-keys is done by a person's eye", remedy="give --viewing-eye left or right"
        )
    is_simulated = configuration.camera.backend == "simulated"
    if options.headless and not is_simulated:
        raise UsageError(
            "--headless needs the simulated room: nobody else looks into the mirror",
            remedy="leave --headless away",
        )
    if options.diagonal_inch is None and not is_simulated:
        raise UsageError(
            "the size of the display in inches is not known",
            remedy="give --diagonal-inch D, from corner to corner of the picture",
        )
    if not options.headless:
        check_terminal()


def _check_rig(rig: "StereoRig") -> None:
    """A display can be no better than the rig that it is calibrated with.

    Raises:
        RigError: not accepted by its calibration, or expired.
    """
    from navapp.cli.headless import check_not_expired

    check_not_expired(rig, date.today())
    if rig.quality is not None and not rig.quality.is_accepted:
        raise RigError(
            f"rig {rig.name} was not accepted by its calibration",
            subject=rig.name,
            remedy="calibrate the cameras again before the display",
        )


def make_session(
    opened: "OpenedAlignment",
    board: "Board",
    options: argparse.Namespace,
    configuration: "Configuration",
) -> "MirrorAlignment":
    """The session on opened devices; of a simulated eye it is handed the picture alone."""
    from navapp.control.executors import InlineExecutor, ThreadExecutor
    from navapp.control.mirror_alignment.alignment import MirrorAlignment
    from navapp.control.mirror_alignment.interfaces import AlignmentSettings

    settings = AlignmentSettings(
        _describe_display(opened, options, configuration),
        valid_ms=configuration.display.valid_ms,
        keeps_few=options.save_alignments is not None,
        replaces=options.out if Path(options.out).exists() else "",
    )
    return MirrorAlignment(
        opened.camera,
        opened.display,
        opened.clock,
        board,
        opened.rig,
        settings,
        executor=InlineExecutor() if options.headless else ThreadExecutor("mirror alignment"),
        hand=opened.hand,
        # Without a screen nobody watches what the eye sees.
        eye=None if options.headless else opened.look,
        reopen=opened.reopen,
        store=partial(write_alignments, unfinished_path(options)),
    )


def _describe_display(
    opened: "OpenedAlignment", options: argparse.Namespace, configuration: "Configuration"
) -> "AlignedDisplay":
    """What is told of the display; a simulated one is told by its data sheet."""
    from calibration.mirror.alignment_start import AlignedDisplay

    info, practice = opened.display.info, opened.practice
    pitch_mm = find_pitch_mm(options, (info.width, info.height))
    if pitch_mm is None:
        # `check_options` wants it of every display but a simulated one.
        pitch_mm = 0.0 if practice is None else practice.pitch_mm
    glass_mm = USUAL_GLASS_MM if practice is None else practice.glass_mm
    return AlignedDisplay(
        info.width,
        info.height,
        pitch_mm,
        glass_mm=glass_mm if options.glass_mm is None else options.glass_mm,
        mirror_deg=USUAL_GLASS_DEG if options.glass_deg is None else options.glass_deg,
        reads_upside_down=options.upside_down,
        viewing_eye=_choose_eye(options, configuration),
    )


def _choose_eye(options: argparse.Namespace, configuration: "Configuration") -> "ViewingEye":
    """As told, or the one that is configured to look; otherwise the right one."""
    told: ViewingEye | None = options.viewing_eye
    if told is not None:
        return told
    return "left" if configuration.mirror.eyes == "left" else "right"


def _keep(
    session: "MirrorAlignment", options: argparse.Namespace, diagnostics: Diagnostics
) -> None:
    """Write the alignments, however it ended: there are enough for a solve, or they are wanted."""
    from calibration.mirror.alignments import FEWEST_ALIGNMENTS

    display, given = session.made
    n, path, unfinished = len(given.pixels), alignments_path(options), unfinished_path(options)
    if n >= FEWEST_ALIGNMENTS or (options.save_alignments is not None and n > 0):
        write_alignments(path, display, given)
        unfinished.unlink(missing_ok=True)
    else:
        path = unfinished
    if n > 0 and options.json != "-":
        diagnostics.say(f"{n} alignments are kept in {path}")


def _on_screen(session: "MirrorAlignment") -> int:
    """The operator does it; 0, or the code of what ended the screen."""
    from navapp.cli.guided_screen import run_on_screen
    from navapp.ui.mirror_alignment.app import run_alignment_app

    return run_on_screen(session, "mirror alignment", run_alignment_app)


def _headless(
    session: "MirrorAlignment", opened: "OpenedAlignment", diagnostics: Diagnostics
) -> None:
    """The script: a simulated eye aligns every cross, a simulated hand follows every wish."""
    from calibration.mirror.alignments import MOST_ALIGNMENTS
    from navapp.control.mirror_alignment.states import Leave, Save
    from navapp.control.recent_events import list_new_events

    told, waited, n_kept, next_try = 0, 0, 0, 0
    snapshot = session.snapshot
    well_ns = snapshot.time_ns
    while not snapshot.is_over:
        if snapshot.is_accepted or snapshot.n_kept >= MOST_ALIGNMENTS:
            session.submit(Save() if snapshot.is_accepted else Leave())
        elif snapshot.corner is not None and waited >= next_try:
            is_confirmed = _align(session, opened, snapshot.corner)
            next_try = waited + _FRAMES_A_TRY if is_confirmed else waited
        snapshot = session.step()
        well_ns = well_ns if snapshot.trouble else snapshot.time_ns
        if snapshot.time_ns - well_ns > _LOST_NS:
            raise DeviceError(f"{snapshot.trouble}, but nothing came; {n_kept} alignments are made")
        is_waiting = snapshot.n_kept == n_kept and not snapshot.trouble
        waited, next_try = (waited + 1, next_try) if is_waiting else (0, 0)
        n_kept = snapshot.n_kept
        if waited > _MOST_FRAMES_A_CROSS:
            raise ResultError(
                f"no further cross can be aligned after {n_kept} ({snapshot.instruction})",
                remedy="use a larger board",
            )
        for text in list_new_events(snapshot, told):
            diagnostics.detail(text)
        told = snapshot.n_events


def _align(session: "MirrorAlignment", opened: "OpenedAlignment", corner: int) -> bool:
    """What a person does: see where the cross is and where it goes, move it, confirm.

    Returns:
        Whether it was confirmed.
    """
    from navapp.control.commands import NudgeCross
    from navapp.control.mirror_alignment.states import Confirm, TurnArrows

    snapshot, practice = session.snapshot, opened.practice
    if practice is None or snapshot.cross_px is None:
        return False
    if snapshot.flips[1] != practice.reads_upside_down:
        session.submit(TurnArrows(rows=True))
        return False
    across, down = (practice.aim_px(corner, snapshot.n_kept) - snapshot.cross_px).round()
    session.submit(
        NudgeCross(
            int(-across if snapshot.flips[0] else across), int(-down if snapshot.flips[1] else down)
        )
    )
    session.submit(Confirm())
    return True
