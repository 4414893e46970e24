"""`navapp run`: the application on the configured devices."""

import argparse
import time
import tomllib
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from navapp.cli.diagnostics import Diagnostics, check_writable, write_json
from navapp.errors import ConfigurationError, InputError, ResultError, RigError, UsageError

if TYPE_CHECKING:
    from navapp.config import Configuration
    from navapp.control.controller import SessionController
    from navapp.control.operators import ScriptStep
    from navapp.control.results import FrameResult
    from navapp.devices import OpenedDevices, Simulation
    from navapp.values import Plan, Prior, StageSpec

_NOTHING = np.empty((0, 0, 3), dtype=np.uint8)

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
    except tomllib.TOMLDecodeError as error:
        raise ConfigurationError(
            f"operator's script {path} is not valid TOML", subject=path, remedy=str(error)
        ) from error


def _prepare(
    configuration: "Configuration", options: argparse.Namespace, diagnostics: Diagnostics
) -> _Session:
    """Open the devices; everything that can be refused is refused before."""
    from navapp.cli.sessions import read_prior
    from navapp.control.stages import stage_by_name
    from navapp.devices import open_live
    from navapp.preop import read_plan

    stage = stage_by_name(options.stage or configuration.stages.first)
    plan = None if configuration.plan.path is None else read_plan(configuration.plan.path)
    prior = None if configuration.plan.prior is None else read_prior(configuration.plan.prior)
    if plan is None and configuration.camera.backend != "simulated":
        raise UsageError("no plan is given", remedy="give --plan, or [plan] path")
    opened = open_live(configuration, is_headless=options.headless)
    with ExitStack() as undo:
        undo.callback(opened.devices.close)
        check_accepted(opened.rig, options.allow_unaccepted, diagnostics)
        if opened.simulation is not None:
            plan = plan or built_in_plan(opened.simulation)
            prior = prior or nominal_prior(opened.simulation)
        undo.pop_all()
    from navapp.values import Prior

    if plan is None:
        raise UsageError("no plan is given", remedy="give --plan, or [plan] path")
    return _Session(configuration, opened, plan, prior or Prior(), stage)


def check_accepted(rig: Any, is_allowed: bool, diagnostics: Diagnostics) -> None:
    """Refuse a rig that its calibration did not accept, unless it is allowed.

    Raises:
        RigError: not accepted and not allowed.
    """
    if rig.quality is None:
        if not rig.name.startswith("sim:"):
            diagnostics.warn(f"rig {rig.name} carries no quality record; it is taken as given")
        return
    if rig.quality.is_accepted:
        return
    why = "; ".join(rig.quality.reasons) or "no reason is recorded"
    if not is_allowed:
        raise RigError(
            f"rig {rig.name} was not accepted by its calibration ({why})",
            subject=rig.name,
            remedy="calibrate again, or add --allow-unaccepted: no frame is OK then",
        )
    diagnostics.warn(f"rig {rig.name} was not accepted ({why}): no frame will be OK")


def built_in_plan(simulation: "Simulation") -> "Plan":
    """The plan of the simulated patient: the surfaces that a perfect CT would have given."""
    from navapp.geometry.mesh import TriangleMesh
    from navapp.values import BoneModel, Plan

    # Normals as any reader of the plan's files computes them, so that a replay finds the same.
    bones = {
        name: BoneModel(name, TriangleMesh(mesh.vertices_mm, mesh.faces), simulation.side)
        for name, mesh in simulation.bones.items()
    }
    return Plan(bones, simulation.targets, simulation.curves, name="sim:plan")


def nominal_prior(simulation: "Simulation") -> "Prior":
    """How the simulated knee was meant to lie on the table."""
    from navapp.values import Prior

    return Prior(
        {"femur": simulation.nominal_left_from_femur},
        simulation.approach_axis,
        simulation.approach_half_angle_deg,
    )


def _controller(
    session: _Session,
    *,
    is_inline: bool,
    on_frame: "list[Any]",
    undo: ExitStack,
) -> "SessionController":
    """The controller with its listeners and, when asked for, its recorder."""
    from navapp.cli.session_folder import start_recording
    from navapp.control.controller import SessionController, SessionHooks, SessionOptions
    from navapp.control.executors import InlineExecutor, ThreadExecutor
    from navapp.tracking import LineSettings

    configuration, opened = session.configuration, session.opened
    simulation = opened.simulation
    hooks = SessionHooks(
        on_frame=tuple(on_frame),
        on_stage=() if simulation is None else (simulation.set_stage,),
        reopen_camera=opened.reopen_camera,
    )
    if configuration.recording.folder is not None:
        recorder = start_recording(
            configuration.recording.folder,
            configuration,
            opened.rig,
            session.plan,
            session.prior,
            session.stage.name,
        )
        undo.callback(recorder.close)
        hooks = replace(
            hooks,
            on_frame=(*hooks.on_frame, recorder.on_frame),
            on_event=(recorder.on_event,),
            on_command=(recorder.on_command,),
            on_take_over=(recorder.on_take_over,),
        )
    return SessionController(
        opened.devices,
        opened.rig,
        session.plan,
        session.prior,
        executor=InlineExecutor() if is_inline else ThreadExecutor(),
        options=SessionOptions(
            line=LineSettings(
                method=configuration.tracking.method, depth_mm=configuration.camera.depth_mm
            ),
            first_stage=session.stage,
            overlay_valid_ms=configuration.display.valid_ms,
            rig_name=opened.rig.name,
        ),
        hooks=hooks,
    )


def _run_headless(
    session: _Session,
    script: "tuple[ScriptStep, ...]",
    options: argparse.Namespace,
    diagnostics: Diagnostics,
) -> int:
    from navapp.cli.sessions import frame_to_json, summarise, summary_text
    from navapp.control.operators import ScriptedOperator
    from navapp.control.runner import run_headless

    results: list[FrameResult] = []

    def keep(result: "FrameResult") -> None:
        # Pictures are not kept: a long session must not grow.
        frame = replace(
            result.frame, left=result.frame.left[:1, :1], right=result.frame.right[:1, :1]
        )
        results.append(
            replace(result, frame=frame, picture=replace(result.picture, image=_NOTHING))
        )
        if options.frames:
            diagnostics.progress("frames", len(results) / options.frames)

    started = time.perf_counter()
    with ExitStack() as undo:
        undo.callback(session.opened.devices.close)
        controller = _controller(session, is_inline=True, on_frame=[keep], undo=undo)
        undo.callback(controller.close)
        run_headless(
            controller,
            ScriptedOperator(script),
            lambda: options.frames is not None and len(results) >= options.frames,
        )
    seconds = time.perf_counter() - started
    frames = [frame_to_json(result, _tre_mm(result, session)) for result in results]
    summary = summarise(frames, seconds)
    write_json(options.json, "run", {"frames": frames, "summary": summary})
    if options.json != "-":
        diagnostics.say(summary_text(summary))
    if summary["ok"] == 0:
        raise ResultError("no frame was OK", remedy="see the reasons in --json")
    return 0


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
    import platformdirs

    from navapp.control.runner import SessionRunner
    from navapp.control.states import Quit
    from navapp.ui.app import run_app

    log_folder = Path(platformdirs.user_log_dir("navapp", appauthor=False))
    log_folder.mkdir(parents=True, exist_ok=True)
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
        code = run_app(runner, log_folder / "navapp.log")
    if runner.error is not None:
        raise runner.error
    return code
