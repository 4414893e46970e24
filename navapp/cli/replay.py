"""`navapp replay`: tracking on a recorded sequence, as fast as it goes."""

import argparse
from contextlib import ExitStack
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from navapp.cli.diagnostics import Diagnostics, check_writable
from navapp.cli.methods import add_method
from navapp.errors import UsageError

if TYPE_CHECKING:
    from drivers.replay_camera import ReplaySettings
    from navapp.cli.headless import FrameLog
    from navapp.cli.recorded_operation import MovedRig
    from navapp.config import Configuration
    from navapp.control.executors import Executor
    from navapp.control.frame_result import FrameListener
    from navapp.control.operators import Operator
    from navapp.control.specification import SessionSpecification
    from navapp.devices import OpenedDevices
    from navapp.errors import NavappError
    from navapp.values import Plan, StageSpec

_EXAMPLE = """\
examples:
  navapp replay sessions/01                      a recorded session, with its own plan and operator
  navapp replay pairs/ --rig rig.yml --plan P --prior prior.json --overlay O --json poses.json
  navapp replay left.mp4,right.mp4 --rig rig.yml --plan P --prior prior.json
"""


def add_parser(subparsers: Any) -> None:
    """Declare the verb."""
    parser = subparsers.add_parser(
        "replay",
        help="the same line on a session folder, a folder of pairs, or videos",
        epilog=_EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("sequence", metavar="SEQ", help="folder, or LEFT.mp4,RIGHT.mp4")
    parser.add_argument("--plan", metavar="P", help="plan folder (a session brings its own)")
    parser.add_argument("--rig", metavar="R", help="rig file (a session brings its own)")
    parser.add_argument(
        "--prior", metavar="FILE", help="where the bone is (JSON; `navapp prior` makes it)"
    )
    add_method(parser)
    parser.add_argument(
        "--follow-refused",
        action="store_true",
        help="carry on poses that the judge refuses, to measure them; they stay refused",
    )
    parser.add_argument(
        "--bone", metavar="NAME", help="bone to follow (default: the first stage's)"
    )
    parser.add_argument(
        "--also",
        metavar="NAME",
        action="append",
        default=[],
        help="another bone, followed in turns: the tibia is found from the femur, others from the "
        "prior; repeatable",
    )
    parser.add_argument(
        "--cut",
        metavar="PLANE",
        action="append",
        default=[],
        help="a planned cut that has been made: its bone is gone, its face is measured; repeatable",
    )
    parser.add_argument(
        "--order",
        choices=("forward", "pingpong", "each"),
        default="forward",
        help="pingpong: to and fro; each: every frame is registered on its own from the prior",
    )
    parser.add_argument(
        "--truth",
        metavar="T",
        help="poses of the bones: every frame has a line with its error (other kinds of truth: "
        "`navapp evaluate --recording`)",
    )
    parser.add_argument("--frames", type=int, metavar="N", help="end after N frames")
    parser.add_argument("--start", type=int, default=0, metavar="I", help="first picture's number")
    parser.add_argument("--fps", type=float, metavar="F", help="rate where there are no times (15)")
    parser.add_argument("--split", choices=("side-by-side",), help="one video holds both pictures")
    parser.add_argument("--overlay", metavar="DIR", help="write a picture of every frame")
    parser.add_argument("--png", action="store_true", help="lossless pictures in --overlay")
    parser.add_argument("--video", metavar="FILE.mp4", help="write the pictures as a video")
    parser.add_argument(
        "--layers",
        metavar="NAME,...",
        help="layers of the overlay that are drawn (default: those of the stage)",
    )
    parser.add_argument(
        "--allow-unaccepted", action="store_true", help="use a rig that was not accepted"
    )
    parser.add_argument("--json", metavar="FILE", help="result for programs (- is stdout)")


@dataclass(frozen=True, slots=True, eq=False)
class _Replay:
    """What is replayed, and who operates."""

    specification: "SessionSpecification"  # of the session
    operator: "Operator"  # gives the commands
    executor: "Executor"  # runs first registrations
    other_executor: "Executor"  # runs searches for other bones
    # commands and results of searches come when they came in the recording.
    is_as_recorded: bool = False
    warnings: tuple[str, ...] = ()  # for a person, before the replay begins
    # after which frame the recorded session found this rig moved, and how; None when it did not, or
    # another rig is used.
    rig_moved: "MovedRig | None" = None


def run(options: argparse.Namespace, diagnostics: Diagnostics) -> int:
    """Do it."""
    from navapp.cli.headless import FrameLog, check_accepted, check_start, report_result
    from navapp.cli.replay_truth import read_replay_truth
    from navapp.cli.results import frame_to_json, rig_alarm_to_json
    from navapp.config import find_file, load
    from navapp.control.beside_femur import may_start_from
    from navapp.devices import open_recording

    _check(options)
    diagnostics.note(f"replaying {options.sequence}")
    configuration = load(find_file(options.config))
    settings = _settings(configuration, options)
    replay = _prepare(configuration, options, diagnostics)
    for warning in replay.warnings:
        diagnostics.warn(warning)
    specification = replay.specification
    rig = specification.rig
    check_accepted(rig, options.allow_unaccepted, diagnostics)
    if not replay.is_as_recorded:
        first = specification.stage.bone
        for bone in (first, *specification.others):
            if not may_start_from(bone, first):
                check_start(specification.prior, bone)
    truth = read_replay_truth(options, specification.plan, specification.stage.bone)
    opened = open_recording(options.sequence, settings, rig, configuration)
    describe = None if truth is None else truth.tell
    log = FrameLog(opened.devices.camera.info.n_frames, diagnostics, describe)
    seconds, failure = _run_session(replay, opened, log, options, settings.rate_hz, diagnostics)
    frames = [
        frame_to_json(result, {} if truth is None else truth.measure(result))
        for result in log.results
    ]
    moved = replay.rig_moved
    told = None if moved is None else rig_alarm_to_json(rig.name, *moved)
    measured = [result.measured for result in log.results]
    limbs = [result.limb for result in log.results]
    return report_result(frames, seconds, failure, options, diagnostics, told, measured, limbs)


def _run_session(
    replay: _Replay,
    opened: "OpenedDevices",
    log: "FrameLog",
    options: argparse.Namespace,
    rate_hz: float,
    diagnostics: Diagnostics,
) -> "tuple[float, NavappError | None]":
    """Handle all frames; the seconds that they took, and the fault in which the session ended."""
    from navapp.cli.headless import run_session
    from navapp.cli.overlay_files import OverlayFolder, OverlayVideo
    from navapp.control.controller import SessionController
    from navapp.control.event_log import SessionHooks

    with ExitStack() as undo:
        undo.callback(opened.devices.close)
        listeners: list[FrameListener] = [log]
        if options.overlay is not None:
            folder = OverlayFolder(options.overlay, is_lossless=options.png)
            listeners.append(undo.enter_context(folder).add)
        if options.video is not None:
            listeners.append(undo.enter_context(OverlayVideo(options.video, rate_hz)).add)
        controller = SessionController(
            opened.devices,
            replay.specification,
            executor=replay.executor,
            other_executor=replay.other_executor,
            hooks=SessionHooks(on_frame=tuple(listeners)),
        )
        undo.callback(controller.close)
        seconds = run_session(controller, replay.operator, log, diagnostics)
    return seconds, controller.failure


def _check(options: argparse.Namespace) -> None:
    """Refuse what is known to be wrong before anything is read."""
    if options.order == "pingpong" and options.frames is None:
        raise UsageError("--order pingpong has no end", remedy="add --frames N")
    if options.png and options.overlay is None:
        raise UsageError("--png is of the pictures of --overlay", remedy="add --overlay DIR")
    _layers(options.layers)
    check_writable(options.json)


def _settings(configuration: "Configuration", options: argparse.Namespace) -> "ReplaySettings":
    """How the sequence is walked through."""
    from drivers.replay_camera import ReplaySettings

    return ReplaySettings(
        # Whether every frame stands for itself is the operator's business, not the camera's.
        order="pingpong" if options.order == "pingpong" else "forward",
        n_frames=options.frames,
        start=options.start,
        rate_hz=configuration.camera.rate_hz if options.fps is None else options.fps,
        is_side_by_side=options.split is not None,
    )


def _prepare(
    configuration: "Configuration", options: argparse.Namespace, diagnostics: Diagnostics
) -> _Replay:
    """Everything but the pictures: the command line's, else the session's, else configured."""
    from navapp.cli.recorded_operation import (
        choose_operator,
        find_drawn_start,
        find_moved_rig,
        list_warnings,
    )
    from navapp.cli.session_folder import is_session, read_session
    from navapp.cli.session_tools import read_tools
    from navapp.control.executors import InlineExecutor, RecordedExecutor
    from navapp.control.operators import RecordedOperator
    from navapp.control.prior_files import read_prior
    from navapp.control.specification import specify_session
    from navapp.geometry.rig_files import read_rig
    from navapp.preop import read_plan
    from navapp.values import Prior

    session = read_session(options.sequence) if is_session(options.sequence) else None
    rig_path = options.rig or (session and session.rig_path) or configuration.camera.rig
    plan_path = options.plan or (session and session.plan_path) or configuration.plan.path
    prior_path = options.prior or (session and session.prior_path) or configuration.plan.prior
    stage = (session and session.first_stage) or configuration.stages.first
    if plan_path is None:
        raise UsageError("no plan is given", remedy="give --plan (make one with `navapp plan`)")
    if rig_path is None:
        raise UsageError("no rig is given", remedy="give --rig, or [camera] rig")
    plan = read_plan(plan_path)
    first, others = _stages(options, plan, stage)
    method = options.method or (None if session is None else session.method)
    is_recorded_so = session is not None and session.follows_refused
    rig = read_rig(rig_path)
    tool_files = configuration.tools.files if session is None else session.tool_files
    specification = specify_session(
        configuration,
        rig,
        plan,
        Prior() if prior_path is None else read_prior(prior_path),
        first,
        is_live=False,
        method=method,
        follows_refused=options.follow_refused or is_recorded_so or None,
        others=others,
        is_each=options.order == "each",
        layers=_layers(options.layers),
        made_steps=tuple(dict.fromkeys(options.cut)),
        tools=read_tools(tool_files, rig, diagnostics),
    )
    operator, executor = choose_operator(session, options, specification.follows_refused)
    other_executor: Executor = InlineExecutor()
    is_as_recorded = isinstance(operator, RecordedOperator)
    if is_as_recorded and session is not None:
        # Who only follows has nobody to answer for conditions.
        specification = replace(
            specification,
            others=session.others,
            is_live=True,
            has_gates=session.has_gates,
            check_minutes=session.check_minutes,
        )
        other_executor = RecordedExecutor(session.events.other_take_overs)
    if session is not None and not is_as_recorded and not options.prior:
        start = find_drawn_start(session, specification.prior, first.bone)
        specification = replace(specification, prior=start)
    if session is None:
        # Nothing is late: every frame tells what it can.
        specification = replace(specification, frames_between_faces=1)
    return _Replay(
        specification,
        operator,
        executor,
        other_executor,
        is_as_recorded,
        list_warnings(session, options),
        find_moved_rig(session, options),
    )


def _layers(names: str | None) -> tuple[str, ...] | None:
    """The layers of a list of names; None for the stage's own."""
    from navapp.overlay import LAYERS

    if names is None:
        return None
    layers = tuple(name.strip() for name in names.split(",") if name.strip())
    unknown = [name for name in layers if name not in LAYERS]
    if unknown:
        known = ", ".join(LAYERS)
        raise UsageError(f"there is no layer '{unknown[0]}'", remedy=f"choose of {known}")
    return layers


def _stages(
    options: argparse.Namespace, plan: "Plan", name: str
) -> "tuple[StageSpec, tuple[str, ...]]":
    """The stage to start in, that of `--bone` or else the named one; and the bones of `--also`."""
    from navapp.cli.other_bones import check_others, find_stage_of
    from navapp.control.stages import stage_by_name

    is_named = options.bone is None
    first = plan.stage(stage_by_name(name)) if is_named else find_stage_of(options.bone, plan)
    return first, check_others(options.also, plan, first)
