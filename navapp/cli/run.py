"""`navapp run`: the application on the configured devices."""

import argparse
import tempfile
import tomllib
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING, Any

from navapp.cli.diagnostics import Diagnostics, check_writable
from navapp.errors import ConfigurationError, InputError, UsageError

if TYPE_CHECKING:
    from navapp.config import Configuration
    from navapp.control.controller import SessionController, SessionHooks
    from navapp.control.operators import ScriptStep
    from navapp.control.results import FrameListener, FrameResult
    from navapp.devices import OpenedDevices
    from navapp.values import Plan, Prior, StageSpec

_EXAMPLE = """\
examples:
  navapp run                                     the simulated rig, in the terminal
  navapp run --headless --frames 120 --json -    the same without a screen, with a scripted operator
  navapp run --plan P --rig rig.yml --prior prior.json --record sessions/01
"""


def add_parser(subparsers: Any) -> None:
    """Declare the verb."""
    parser = subparsers.add_parser(
        "run",
        help="the application on the configured devices; by default on the simulated rig",
        epilog=_EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--plan", metavar="P", help="plan folder")
    parser.add_argument("--rig", metavar="R", help="rig file")
    parser.add_argument("--prior", metavar="FILE", help="rough start pose (JSON)")
    parser.add_argument("--headless", action="store_true", help="no screen; a scripted operator")
    parser.add_argument("--frames", type=int, metavar="N", help="end after N frames")
    parser.add_argument("--stage", metavar="S", help="stage to start in, name or number")
    parser.add_argument("--record", metavar="DIR", help="record the session into a new folder")
    parser.add_argument("--operator", metavar="SCRIPT.toml", help="the scripted operator's script")
    parser.add_argument(
        "--allow-unaccepted", action="store_true", help="use a rig that was not accepted"
    )
    parser.add_argument("--json", metavar="FILE", help="result for programs (- is stdout)")


@dataclass(frozen=True, slots=True, eq=False)
class _Session:
    """A session that is about to start."""

    configuration: "Configuration"
    opened: "OpenedDevices"
    plan: "Plan"
    prior: "Prior"
    stage: "StageSpec"


def run(options: argparse.Namespace, diagnostics: Diagnostics) -> int:
    """Do it."""
    from navapp.config import find_file, load

    if options.frames is not None and options.frames < 1:
        raise UsageError("--frames must be at least 1")
    if options.operator and not options.headless:
        raise UsageError("--operator needs --headless", remedy="add --headless")
    check_writable(options.json)
    configuration = _with_options(load(find_file(options.config)), options)
    script = _script(options.operator)
    session = _prepare(configuration, options, diagnostics)
    if options.headless:
        return _run_headless(session, script, options, diagnostics)
    return _run_screen(session, options, diagnostics)


def _with_options(configuration: "Configuration", options: argparse.Namespace) -> "Configuration":
    """The configuration with the command line's words in it."""
    camera, plan, recording = configuration.camera, configuration.plan, configuration.recording
    if options.rig:
        camera = camera.model_copy(update={"rig": options.rig})
    if options.plan:
        plan = plan.model_copy(update={"path": options.plan})
    if options.prior:
        plan = plan.model_copy(update={"prior": options.prior})
    if options.record:
        recording = recording.model_copy(update={"folder": options.record})
    return configuration.model_copy(update={"camera": camera, "plan": plan, "recording": recording})


def _script(path: str | None) -> "tuple[ScriptStep, ...]":
    from navapp.control.operators import DEFAULT_SCRIPT, read_script

    if path is None:
        return DEFAULT_SCRIPT
    try:
        return read_script(tomllib.loads(Path(path).read_text(encoding="utf-8")), path)
    except OSError as error:
        raise InputError(
            f"operator's script {path} cannot be read ({error.strerror})",
            subject=path,
            remedy="give an existing TOML file",
        ) from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigurationError(
            f"operator's script {path} is not valid TOML", subject=path, remedy=str(error)
        ) from error


def _prepare(
    configuration: "Configuration", options: argparse.Namespace, diagnostics: Diagnostics
) -> _Session:
    """Read everything that is given, then open the devices; closed again when that is refused."""
    from navapp.cli.headless import check_accepted, check_not_expired, check_start
    from navapp.cli.prior_files import read_prior
    from navapp.cli.simulated_patient import built_in_plan, nominal_prior
    from navapp.control.stages import stage_by_name
    from navapp.devices import open_live
    from navapp.preop import read_plan
    from navapp.values import Prior

    given = configuration.plan
    stage = stage_by_name(options.stage or configuration.stages.first)
    plan = None if given.path is None else read_plan(given.path)
    prior = None if given.prior is None else read_prior(given.prior)
    opened = open_live(configuration, is_headless=options.headless)
    with ExitStack() as undo:
        undo.callback(opened.devices.close)
        check_not_expired(opened.rig, date.today())
        check_accepted(opened.rig, options.allow_unaccepted, diagnostics)
        if opened.simulation is not None:
            plan = plan or built_in_plan(opened.simulation)
            prior = prior or nominal_prior(opened.simulation)
        if plan is None:
            raise UsageError("no plan is given", remedy="give --plan, or [plan] path")
        prior = prior or Prior()
        if options.headless:
            check_start(prior, stage)
        undo.pop_all()
    return _Session(configuration, opened, plan, prior, stage)


def _controller(
    session: _Session, *, is_inline: bool, on_frame: "Sequence[FrameListener]", undo: ExitStack
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
            overlay_valid_ms=configuration.display.valid_ms,
            is_recording=configuration.recording.folder is not None,
        ),
        hooks=_listening(session, on_frame, undo),
    )


def _listening(
    session: _Session, on_frame: "Sequence[FrameListener]", undo: ExitStack
) -> "SessionHooks":
    """Who is told: the caller, the simulated room, and the recorder when there is one."""
    from navapp.cli.session_folder import discard_if_empty, start_recording
    from navapp.control.controller import SessionHooks

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


def _run_headless(
    session: _Session,
    script: "tuple[ScriptStep, ...]",
    options: argparse.Namespace,
    diagnostics: Diagnostics,
) -> int:
    from navapp.cli.headless import FrameLog, finish, follow
    from navapp.cli.results import frame_to_json
    from navapp.control.operators import ScriptedOperator

    log = FrameLog(options.frames, diagnostics)
    with ExitStack() as undo:
        undo.callback(session.opened.devices.close)
        controller = _controller(session, is_inline=True, on_frame=[log], undo=undo)
        undo.callback(controller.close)
        seconds = follow(controller, ScriptedOperator(script), log)
    frames = [frame_to_json(result, _tre_mm(result, session)) for result in log.results]
    return finish(frames, seconds, controller.lost_device, options, diagnostics)


def _tre_mm(result: "FrameResult", session: _Session) -> float | None:
    """Join a frame with the truth, after the run."""
    from navapp.evaluation import mean_tre_mm

    simulation, tracked = session.opened.simulation, result.tracked
    if simulation is None or tracked is None or tracked.left_from_bone is None:
        return None
    if tracked.bone not in simulation.oracle.bodies:
        return None
    true = simulation.oracle.left_from_body(tracked.bone, result.frame.captured_ns)
    targets = session.plan.targets_of(result.stage.targets)
    return mean_tre_mm(tracked.left_from_bone, true, session.plan.bones[tracked.bone], targets)


def _run_screen(session: _Session, options: argparse.Namespace, diagnostics: Diagnostics) -> int:
    from navapp.control.runner import SessionRunner
    from navapp.control.states import Quit
    from navapp.ui.app import run_app

    n_frames = 0

    def count(result: "FrameResult") -> None:
        nonlocal n_frames
        n_frames += 1
        if options.frames is not None and n_frames == options.frames:
            controller.submit(Quit())

    with ExitStack() as undo:
        undo.callback(session.opened.devices.close)
        controller = _controller(session, is_inline=False, on_frame=[count], undo=undo)
        runner = SessionRunner(controller)
        undo.callback(runner.stop)
        runner.start()
        code = run_app(runner, log_folder() / "navapp.log")
    if runner.error is not None:
        raise runner.error
    return code


def log_folder() -> Path:
    """Where the screen's log goes: the user's log folder, else the one for temporary files."""
    import platformdirs

    folder = Path(platformdirs.user_log_dir("navapp", appauthor=False))
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return Path(tempfile.gettempdir())
    return folder
