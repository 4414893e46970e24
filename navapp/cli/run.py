"""`navapp run`: the application on the configured devices."""

import argparse
import os
import tempfile
import tomllib
from contextlib import ExitStack
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING, Any

from navapp.cli.diagnostics import Diagnostics, check_writable
from navapp.cli.live_session import LiveSession, make_controller, prepare_session
from navapp.cli.methods import add_method
from navapp.cli.practice_mirror import add_practice_mirror
from navapp.errors import ConfigurationError, InputError, ResultError, UsageError

if TYPE_CHECKING:
    from navapp.config import Configuration
    from navapp.control.frame_result import FrameResult
    from navapp.control.scripted_operator import ScriptStep
    from navapp.preop import PlanView
    from navapp.ui.background import Background

_EXAMPLE = """\
examples:
  navapp run                                     the simulated rig, in the terminal
  navapp run --mirror                            the same with a display in a half-silvered mirror
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
    parser.add_argument(
        "--prior", metavar="FILE", help="where the bone is (JSON; `navapp prior` makes it)"
    )
    parser.add_argument(
        "--mirror",
        action="store_true",
        help="practise with a simulated display in a half-silvered mirror",
    )
    parser.add_argument(
        "--also",
        metavar="NAME",
        action="append",
        default=[],
        help="another bone, found from the accepted one and followed in turns: the tibia",
    )
    parser.add_argument("--headless", action="store_true", help="no screen; a scripted operator")
    parser.add_argument(
        "--window",
        action="store_true",
        help="show the display's picture at full resolution in a window of the desktop",
    )
    parser.add_argument(
        "--pictures",
        choices=("auto", "kitty", "sixel", "blocks"),
        help="how the terminal gets pictures; auto: the best that it answers for",
    )
    parser.add_argument("--frames", type=int, metavar="N", help="end after N frames")
    parser.add_argument("--stage", metavar="S", help="stage to start in, name or number")
    add_method(parser)
    parser.add_argument("--record", metavar="DIR", help="record the session into a new folder")
    parser.add_argument("--operator", metavar="SCRIPT.toml", help="the scripted operator's script")
    parser.add_argument(
        "--allow-unaccepted", action="store_true", help="use a rig that was not accepted"
    )
    parser.add_argument("--json", metavar="FILE", help="result for programs (- is stdout)")
    parser.set_defaults(guide=None)  # of `navapp tutorial`, beside the picture


def run(options: argparse.Namespace, diagnostics: Diagnostics) -> int:
    """Do it."""
    from navapp.config import find_file, load

    if options.frames is not None and options.frames < 1:
        raise UsageError("--frames must be at least 1")
    if options.operator and not options.headless:
        raise UsageError("--operator needs --headless", remedy="add --headless")
    if options.window and options.mirror:
        raise UsageError(
            "the simulated mirror has a simulated display",
            remedy="leave out --window, and press y to see what the eye sees",
        )
    check_writable(options.json)
    configuration = _with_options(load(find_file(options.config)), options)
    if options.headless:
        length = f"{options.frames} frames" if options.frames else "until it is interrupted"
        diagnostics.note(f"session without a screen, {configuration.camera.backend}: {length}")
    script = _script(options.operator)
    with ExitStack() as undo:
        if options.mirror:
            configuration = add_practice_mirror(configuration, undo)
        first = next((step for step in script if step.do == "register"), None)
        draws_box = first is not None and first.box is not None
        session = prepare_session(
            configuration, options, diagnostics, needs_start=options.headless and not draws_box
        )
    if options.headless:
        return _run_headless(session, script, options, diagnostics)
    return _run_screen(session, options, diagnostics)


def _with_options(configuration: "Configuration", options: argparse.Namespace) -> "Configuration":
    """The configuration with the command line's words in it."""
    camera, plan, recording = configuration.camera, configuration.plan, configuration.recording
    tracking, display, ui = configuration.tracking, configuration.display, configuration.ui
    if options.window and display.model is not None:
        raise UsageError(
            "a display in the mirror covers an output from edge to edge, and is no window",
            remedy="leave out --window, or [display] model",
        )
    if options.window:
        plain = {"backend": "desktop", "flip_horizontally": False, "flip_vertically": False}
        display = display.model_copy(update=plain)
    if options.pictures:
        ui = ui.model_copy(update={"pictures": options.pictures})
    if options.rig:
        camera = camera.model_copy(update={"rig": options.rig})
    if options.plan:
        plan = plan.model_copy(update={"path": options.plan})
    if options.prior:
        plan = plan.model_copy(update={"prior": options.prior})
    if options.record:
        recording = recording.model_copy(update={"folder": options.record})
    if options.method:
        tracking = tracking.model_copy(update={"method": options.method})
    return configuration.model_copy(
        update={
            "camera": camera,
            "display": display,
            "plan": plan,
            "recording": recording,
            "tracking": tracking,
            "ui": ui,
        }
    )


def _script(path: str | None) -> "tuple[ScriptStep, ...]":
    from navapp.control.scripted_operator import DEFAULT_SCRIPT, read_script

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


def _run_headless(
    session: LiveSession,
    script: "tuple[ScriptStep, ...]",
    options: argparse.Namespace,
    diagnostics: Diagnostics,
) -> int:
    from navapp.cli.headless import FrameLog, report_result, run_session
    from navapp.cli.operation_table import list_steps
    from navapp.cli.results import frame_to_json, rig_to_json
    from navapp.control.scripted_operator import ScriptedOperator

    log, operator = FrameLog(options.frames, diagnostics), ScriptedOperator(script)
    with ExitStack() as undo:
        undo.callback(session.opened.devices.close)
        controller = make_controller(session, is_inline=True, on_frame=[log], undo=undo)
        undo.callback(controller.close)
        seconds = run_session(controller, operator, log, diagnostics)
    frames = [frame_to_json(result, _tre_mm(result, session)) for result in log.results]
    rig = rig_to_json(controller.snapshot)
    measured = [result.measured for result in log.results]
    failure = controller.failure
    told = operator.failure or (operator.unfinished if options.operator else "")
    if failure is None and told:
        failure = ResultError(told, remedy="see the frames in --json")
    limbs = [result.limb for result in log.results]
    simulation = session.opened.simulation
    truth = None if simulation is None else simulation.oracle
    steps = list_steps(session.specification.plan, controller.steps_of, truth)
    return report_result(
        frames, seconds, failure, options, diagnostics, rig, measured, limbs, steps
    )


def _tre_mm(result: "FrameResult", session: LiveSession) -> dict[str, float | None]:
    """Join a frame with the truth, after the run: by bone, of those whose pose is known."""
    from navapp.control.stages import stage_of
    from navapp.evaluation import compute_mean_tre_mm

    simulation, plan = session.opened.simulation, session.specification.plan
    if simulation is None:
        return {}
    answers = [(result.stage, result.tracked)]
    answers += [(stage_of(name, plan), tracked) for name, tracked in result.others.items()]
    errors_mm: dict[str, float | None] = {}
    for stage, tracked in answers:
        pose = None if tracked is None else tracked.left_from_bone
        if pose is not None and stage.bone in simulation.oracle.bodies:
            true = simulation.oracle.left_from_seen_body(stage.bone, result.frame.captured_ns)
            targets = plan.targets_of(stage.targets)
            errors_mm[stage.bone] = compute_mean_tre_mm(pose, true, plan.bones[stage.bone], targets)
    return errors_mm


def _run_screen(session: LiveSession, options: argparse.Namespace, diagnostics: Diagnostics) -> int:
    from navapp.cli.session_end import KeptFiles
    from navapp.control.commands import Quit
    from navapp.control.runner import SessionRunner
    from navapp.ui.run_screen import run_screen

    n_frames = 0

    def count(result: "FrameResult") -> None:
        nonlocal n_frames
        n_frames += 1
        if options.frames is not None and n_frames == options.frames:
            controller.submit(Quit())

    with ExitStack() as undo:
        undo.callback(session.opened.devices.close)
        plan = _plan_view(session)
        log = log_folder() / "navapp.log"
        kept = KeptFiles.begin(session.configuration.recording.folder, log)
        controller = make_controller(session, is_inline=False, on_frame=[count], undo=undo)
        runner = SessionRunner(controller)
        undo.callback(runner.stop)
        runner.start()
        code = run_screen(
            runner,
            log,
            pictures=session.configuration.ui.pictures,
            hints=_hints(session, options),
            background=_background(session, options),
            plan=plan,
            guide=options.guide,
        )
    is_whole = controller.snapshot.is_recording
    kept.tell(n_frames, is_whole=is_whole, diagnostics=diagnostics)
    if runner.error is not None:
        raise runner.error
    return code


def _plan_view(session: LiveSession) -> "PlanView":
    """The plan to look at; that of the simulated rig has surfaces alone."""
    from navapp.preop import make_plan_view, read_plan_view

    path, plan = session.configuration.plan.path, session.specification.plan
    return make_plan_view(plan) if path is None else read_plan_view(path, plan)


def _background(session: LiveSession, options: argparse.Namespace) -> "Background":
    from navapp.config import find_file
    from navapp.ui.background import Background

    source = find_file(options.config)
    return Background(
        session.configuration,
        session.specification,
        date.today(),
        "" if source is None else str(source),
    )


def _hints(session: LiveSession, options: argparse.Namespace) -> list[str]:
    """What an operator should know of who has a desktop and looks at a terminal only."""
    has_desktop = bool(os.environ.get("DISPLAY")) and not options.mirror
    if has_desktop and session.configuration.display.backend == "simulated":
        return ["navapp run --window shows the picture at full resolution on this desktop"]
    return []


def log_folder() -> Path:
    """Where the screen's log goes: the user's log folder, else the one for temporary files."""
    import platformdirs

    folder = Path(platformdirs.user_log_dir("navapp", appauthor=False))
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return Path(tempfile.gettempdir())
    return folder
