"""The session of `navapp run`: what is given is read, devices are opened, listeners joined."""

import argparse
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from datetime import date
from typing import TYPE_CHECKING

from navapp.cli.diagnostics import Diagnostics
from navapp.errors import ConfigurationError, UsageError

if TYPE_CHECKING:
    from calibration.targets.boards import Board
    from navapp.config import Configuration
    from navapp.control.board_watch import BoardWatch
    from navapp.control.controller import SessionController
    from navapp.control.results import FrameListener
    from navapp.control.session import SessionHooks
    from navapp.devices import OpenedDevices
    from navapp.values import Plan, Prior, StageSpec


@dataclass(frozen=True, slots=True, eq=False)
class LiveSession:
    """A session that is about to start.

    Attributes:
        configuration: with the command line's words in it.
        opened: devices, and the simulation when there is one.
        plan, prior: of the patient.
        stage: to start in.
        board: whose lengths are known, None when none is configured.
    """

    configuration: "Configuration"
    opened: "OpenedDevices"
    plan: "Plan"
    prior: "Prior"
    stage: "StageSpec"
    board: "Board | None" = None


def prepared(
    configuration: "Configuration", options: argparse.Namespace, diagnostics: Diagnostics
) -> LiveSession:
    """Read everything that is given, then open the devices; closed again when that is refused.

    Raises:
        NavappError: a file, a device or a combination that cannot be used.
    """
    from navapp.cli.headless import check_accepted, check_not_expired, check_start
    from navapp.cli.prior_files import read_prior
    from navapp.cli.simulated_patient import make_built_in_plan, make_nominal_prior
    from navapp.control.stages import stage_by_name
    from navapp.devices import open_live
    from navapp.preop import read_plan
    from navapp.values import Prior

    given = configuration.plan
    stage = stage_by_name(options.stage or configuration.stages.first)
    plan = None if given.path is None else read_plan(given.path)
    prior = None if given.prior is None else read_prior(given.prior)
    board = _board(configuration)
    opened = open_live(configuration, is_headless=options.headless, board=board)
    with ExitStack() as undo:
        undo.callback(opened.devices.close)
        check_not_expired(opened.rig, date.today())
        check_accepted(opened.rig, options.allow_unaccepted, diagnostics)
        if opened.simulation is not None:
            plan = plan or make_built_in_plan(opened.simulation)
            prior = prior or make_nominal_prior(opened.simulation)
        if plan is None:
            raise UsageError("no plan is given", remedy="give --plan, or [plan] path")
        prior = prior or Prior()
        stage = plan.stage(stage)
        if options.headless:
            check_start(prior, stage)
        undo.pop_all()
    return LiveSession(configuration, opened, plan, prior, stage, board)


def _board(configuration: "Configuration") -> "Board | None":
    """The board that the configuration names.

    Raises:
        InputError: its file; ConfigurationError: its lengths are not known in mm.
    """
    from calibration.targets.boards import read_board

    path = configuration.calibration.board
    if path is None:
        if configuration.camera.simulated.board_s is not None:
            raise ConfigurationError(
                "there is no board to be shown",
                subject="calibration.board",
                remedy="name its file in [calibration] board",
            )
        return None
    board = read_board(path)
    if board.spacing_mm == 1.0:
        raise ConfigurationError(
            f"board {path} is its own unit of length",
            subject="calibration.board",
            remedy="measure it, and give its lengths in mm",
        )
    return board


def controller_of(
    session: LiveSession, *, is_inline: bool, on_frame: "Sequence[FrameListener]", undo: ExitStack
) -> "SessionController":
    """The controller with its listeners and, when asked for, its recorder."""
    from navapp.control.controller import SessionController, SessionOptions
    from navapp.control.executors import InlineExecutor, ThreadExecutor
    from navapp.tracking import LineSettings, LocatorSettings

    configuration, opened = session.configuration, session.opened
    return SessionController(
        opened.devices,
        opened.rig,
        session.plan,
        session.prior,
        executor=InlineExecutor() if is_inline else ThreadExecutor(),
        options=SessionOptions(
            line=LineSettings(
                LocatorSettings(method=configuration.tracking.method),
                depth_mm=configuration.camera.depth_mm,
            ),
            first_stage=session.stage,
            overlay_valid_ms=configuration.display.withdrawn_ms,
            is_recording=configuration.recording.folder is not None,
            mirror_deg=configuration.mirror.calibrated_deg,
        ),
        hooks=_listening(session, on_frame, undo),
        board_watch=_board_watch(session, is_inline=is_inline),
    )


def _board_watch(session: LiveSession, *, is_inline: bool) -> "BoardWatch | None":
    """What measures the rig whenever the board is seen; None without a board."""
    if session.board is None:
        return None
    from calibration.rig.known_length import LengthMeter
    from navapp.control.board_watch import BoardWatch
    from navapp.control.executors import InlineExecutor, ThreadExecutor

    return BoardWatch(
        LengthMeter(session.board, session.opened.rig),
        session.configuration.calibration.worst_length,
        InlineExecutor() if is_inline else ThreadExecutor("rig watch"),
        session.opened.devices.clock.now_ns,
    )


def _listening(
    session: LiveSession, on_frame: "Sequence[FrameListener]", undo: ExitStack
) -> "SessionHooks":
    """Who is told: the caller, the simulated room, and the recorder when there is one."""
    from navapp.cli.session_folder import discard_if_empty, start_recording
    from navapp.control.session import SessionHooks

    configuration, opened = session.configuration, session.opened
    hooks = SessionHooks(
        on_frame=tuple(on_frame),
        on_stage=() if opened.simulation is None else (opened.simulation.set_stage,),
        reopen_camera=opened.reopen_camera,
    )
    folder = configuration.recording.folder
    if folder is None:
        return hooks
    recorder = start_recording(
        folder,
        configuration,
        opened.rig,
        session.plan,
        session.prior,
        first_stage=session.stage.name,
    )
    undo.callback(discard_if_empty, folder)
    undo.callback(recorder.close)
    return replace(
        hooks,
        on_frame=(*hooks.on_frame, recorder.on_frame),
        on_event=(recorder.on_event,),
        on_command=(recorder.on_command,),
        on_take_over=(recorder.on_take_over,),
    )
