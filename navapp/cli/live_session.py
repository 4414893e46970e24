"""The session of `navapp run`: reads what is given, opens the devices, adds the listeners."""

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
    from navapp.cli.practice_steps import PracticeSteps
    from navapp.config import Configuration
    from navapp.control.board_watch import BoardWatch
    from navapp.control.calibrated_display import CalibratedDisplay
    from navapp.control.check_points import LocateCorners
    from navapp.control.controller import SessionController
    from navapp.control.event_log import SessionHooks
    from navapp.control.eye_preview import EyePreview
    from navapp.control.frame_result import FrameListener
    from navapp.control.specification import SessionSpecification
    from navapp.devices import OpenedDevices


@dataclass(frozen=True, slots=True, eq=False)
class LiveSession:
    """A session that is about to start."""

    configuration: "Configuration"  # with the command line's words in it
    opened: "OpenedDevices"  # devices, and the simulation when there is one
    specification: "SessionSpecification"  # of the session
    board: "Board | None" = None  # whose lengths are known, None when none is configured


def prepare_session(
    configuration: "Configuration",
    options: argparse.Namespace,
    diagnostics: Diagnostics,
    *,
    needs_start: bool = True,
) -> LiveSession:
    """Read everything that is given, then open the devices; closed again when that is refused.

    Args:
        configuration: in force.
        options: of the command line.
        diagnostics: takes warnings.
        needs_start: nobody will draw where the bone is: the prior has to say.

    Raises:
        NavappError: a file, a device or a combination that cannot be used.
    """
    from navapp.cli.headless import check_accepted, check_not_expired, check_start
    from navapp.cli.other_bones import check_others
    from navapp.cli.session_tools import read_tools
    from navapp.control.prior_files import read_prior
    from navapp.control.specification import specify_session
    from navapp.control.stages import stage_by_name
    from navapp.devices import open_live
    from navapp.devices.simulated_plan import make_built_in_plan, make_nominal_prior
    from navapp.preop import read_plan
    from navapp.values import Prior

    given = configuration.plan
    stage = stage_by_name(options.stage or configuration.stages.first)
    plan = None if given.path is None else read_plan(given.path)
    prior = None if given.prior is None else read_prior(given.prior)
    board = _read_board(configuration)
    display = _read_display(configuration, options)
    opened = open_live(
        configuration, is_headless=options.headless, board=board, has_mirror=options.mirror
    )
    with ExitStack() as undo:
        undo.callback(opened.devices.close)
        check_not_expired(opened.rig, date.today())
        check_accepted(opened.rig, options.allow_unaccepted, diagnostics)
        if opened.simulation is not None:
            plan = plan or make_built_in_plan(opened.simulation)
            prior = prior or make_nominal_prior(opened.simulation)
        if plan is None:
            raise UsageError("no plan is given", remedy="give --plan, or [plan] path")
        stage = plan.stage(stage)
        specification = specify_session(
            configuration,
            opened.rig,
            plan,
            prior or Prior(),
            stage,
            is_live=True,
            others=check_others(options.also, plan, stage, is_live=True),
            calibrated_display=display,
            has_gates=True,
            tools=read_tools(configuration.tools.files, opened.rig, diagnostics),
        )
        if needs_start:
            check_start(specification.prior, stage.bone)
        undo.pop_all()
    return LiveSession(configuration, opened, specification, board)


def _read_display(
    configuration: "Configuration", options: argparse.Namespace
) -> "CalibratedDisplay | None":
    """The display in the mirror that the configuration names.

    Raises:
        NavappError: its file.
    """
    from navapp.control.calibrated_display import CalibratedDisplay
    from navapp.geometry.display_model_files import read_display_model

    path = configuration.display.model
    if path is None:
        return None
    mirror, model = configuration.mirror, read_display_model(path)
    if model.viewing_eye != "camera" and mirror.eyes not in ("both", model.viewing_eye):
        raise ConfigurationError(
            f"the display is calibrated for the {model.viewing_eye} eye",
            subject="mirror.eyes",
            remedy=f'set it to "{model.viewing_eye}" or "both", or calibrate the other eye',
        )
    return CalibratedDisplay(
        model,
        mirror.check_minutes,
        allows_unaccepted=options.allow_unaccepted,
        eyes=mirror.eyes,
    )


def _read_board(configuration: "Configuration") -> "Board | None":
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


def make_controller(
    session: LiveSession, *, is_inline: bool, on_frame: "Sequence[FrameListener]", undo: ExitStack
) -> "SessionController":
    """The controller with its listeners and, when asked for, its recorder."""
    from navapp.control.controller import SessionController
    from navapp.control.executors import InlineExecutor, ThreadExecutor

    hooks, steps = _make_hooks(session, on_frame, undo), _make_practice_steps(session)
    if steps is not None:
        on_command = (*hooks.on_command, steps.on_command)
        hooks = replace(hooks, on_stage=(steps.enter_stage,), on_command=on_command)
    controller = SessionController(
        session.opened.devices,
        session.specification,
        executor=InlineExecutor() if is_inline else ThreadExecutor(),
        other_executor=InlineExecutor() if is_inline else ThreadExecutor("other bone"),
        hooks=hooks,
        board_watch=_make_board_watch(session, is_inline=is_inline),
        locate_corners=_make_locator(session),
        eye=_make_eye(session, is_inline=is_inline),
    )
    if steps is not None:
        steps.connect(controller.submit)
    return controller


def _make_practice_steps(session: LiveSession) -> "PracticeSteps | None":
    """What makes in the simulated room what the operator confirms; None without such a room."""
    from navapp.cli.practice_steps import PracticeSteps, read_thicknesses

    simulation = session.opened.simulation
    if simulation is None:
        return None
    plan, room = session.specification.plan, simulation.states
    # A step that the session would refuse is not made in the room either.
    shared = {
        name
        for name, step in plan.content.steps.items()
        if name in room.names and step.bone in plan.bones
    }
    return PracticeSteps(room, shared, read_thicknesses(plan, simulation.caliper, shared))


def _make_locator(session: LiveSession) -> "LocateCorners | None":
    """What finds the board for the check of the mirror; None without a board or a mirror."""
    if session.board is None or session.specification.display is None:
        return None
    from calibration.rig.corner_locator import CornerLocator

    return CornerLocator(session.board, session.opened.rig)


def _make_eye(session: LiveSession, *, is_inline: bool) -> "EyePreview | None":
    """What shows the operator the simulated mirror; None without one."""
    from navapp.control.executors import InlineExecutor, ThreadExecutor
    from navapp.control.eye_preview import EyePreview

    look = session.opened.look
    if look is None:
        return None
    return EyePreview(look, InlineExecutor() if is_inline else ThreadExecutor("eye"))


def _make_board_watch(session: LiveSession, *, is_inline: bool) -> "BoardWatch | None":
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


def _make_hooks(
    session: LiveSession, on_frame: "Sequence[FrameListener]", undo: ExitStack
) -> "SessionHooks":
    """Who is told: the caller, and the recorder when there is one."""
    from navapp.cli.session_folder import discard_if_empty, start_recording
    from navapp.control.event_log import SessionHooks

    configuration, opened = session.configuration, session.opened
    hooks = SessionHooks(
        on_frame=tuple(on_frame),
        reopen_camera=opened.reopen_camera,
    )
    folder = configuration.recording.folder
    if folder is None:
        return hooks
    recorder = start_recording(folder, configuration, session.specification)
    undo.callback(discard_if_empty, folder)
    undo.callback(recorder.close)
    return replace(
        hooks,
        on_frame=(*hooks.on_frame, recorder.on_frame),
        on_event=(recorder.on_event,),
        on_command=(recorder.on_command,),
        on_take_over=(recorder.on_take_over,),
        on_other_take_over=(recorder.on_other_take_over,),
        recorder=recorder,
    )
