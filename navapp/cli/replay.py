"""`navapp replay`: the same line on a recorded sequence, as fast as it goes."""

import argparse
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from navapp.cli.diagnostics import Diagnostics, check_writable
from navapp.errors import UsageError

if TYPE_CHECKING:
    from drivers.replay_camera import ReplaySettings
    from navapp.cli.recorded_operation import MovedRig
    from navapp.config import Configuration
    from navapp.control.controller import SessionController
    from navapp.control.executors import Executor
    from navapp.control.operators import Operator
    from navapp.control.results import FrameListener
    from navapp.devices import OpenedDevices
    from navapp.geometry.rig import StereoRig
    from navapp.tracking import Method
    from navapp.values import Plan, Prior, StageSpec

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
    parser.add_argument("--prior", metavar="FILE", help="rough start: pose, cone, box (JSON)")
    parser.add_argument("--method", choices=("bimcc", "icp"), help="icp is the paper's baseline")
    parser.add_argument(
        "--bone", metavar="NAME", help="bone to follow (default: the first stage's)"
    )
    parser.add_argument(
        "--also",
        metavar="NAME",
        action="append",
        default=[],
        help="another bone, registered from the prior and followed in turns; repeatable",
    )
    parser.add_argument(
        "--order",
        choices=("forward", "pingpong", "each"),
        default="forward",
        help="pingpong: to and fro; each: every frame is registered on its own from the prior",
    )
    parser.add_argument("--frames", type=int, metavar="N", help="end after N frames")
    parser.add_argument("--start", type=int, default=0, metavar="I", help="first picture's number")
    parser.add_argument("--fps", type=float, metavar="F", help="rate where there are no times (15)")
    parser.add_argument("--split", choices=("side-by-side",), help="one video holds both pictures")
    parser.add_argument("--overlay", metavar="DIR", help="write a picture of every frame")
    parser.add_argument(
        "--allow-unaccepted", action="store_true", help="use a rig that was not accepted"
    )
    parser.add_argument("--json", metavar="FILE", help="result for programs (- is stdout)")


@dataclass(frozen=True, slots=True, eq=False)
class _Replay:
    """What is replayed, and who operates.

    Attributes:
        rig_moved: after which frame the recorded session found this rig moved, and how; None when
            it did not, or another rig is used.
    """

    rig: "StereoRig"
    plan: "Plan"
    prior: "Prior"
    stage: "StageSpec"
    method: "Method"
    operator: "Operator"
    executor: "Executor"
    others: "tuple[StageSpec, ...]" = ()
    is_as_recorded: bool = False
    warnings: tuple[str, ...] = ()
    rig_moved: "MovedRig | None" = None


def run(options: argparse.Namespace, diagnostics: Diagnostics) -> int:
    """Do it."""
    from navapp.cli.headless import FrameLog, check_accepted, check_start, finish, follow
    from navapp.cli.overlay_folder import OverlayFolder
    from navapp.cli.results import frame_to_json, moved_rig_to_json
    from navapp.config import find_file, load
    from navapp.devices import open_recording

    _check(options)
    configuration = load(find_file(options.config))
    settings = _settings(configuration, options)
    replay = _prepare(configuration, options)
    for warning in replay.warnings:
        diagnostics.warn(warning)
    check_accepted(replay.rig, options.allow_unaccepted, diagnostics)
    if not replay.is_as_recorded:
        for stage in (replay.stage, *replay.others):
            check_start(replay.prior, stage)
    opened = open_recording(options.sequence, settings, replay.rig, configuration)
    log = FrameLog(opened.devices.camera.info.n_frames, diagnostics)
    with ExitStack() as undo:
        undo.callback(opened.devices.close)
        listeners: list[FrameListener] = [log]
        if options.overlay is not None:
            listeners.append(undo.enter_context(OverlayFolder(options.overlay)).add)
        controller = _controller(replay, opened, configuration, listeners)
        undo.callback(controller.close)
        seconds = follow(controller, replay.operator, log)
    frames = [frame_to_json(result, {}) for result in log.results]
    rig = (
        None if replay.rig_moved is None else moved_rig_to_json(replay.rig.name, *replay.rig_moved)
    )
    return finish(frames, seconds, controller.failure, options, diagnostics, rig)


def _check(options: argparse.Namespace) -> None:
    """Refuse what is known to be wrong before anything is read."""
    if options.order == "pingpong" and options.frames is None:
        raise UsageError("--order pingpong has no end", remedy="add --frames N")
    if options.order == "each" and options.also:
        raise UsageError(
            "--order each follows no bone from frame to frame", remedy="leave --also out"
        )
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


def _prepare(configuration: "Configuration", options: argparse.Namespace) -> _Replay:
    """Everything but the pictures: the command line's, else the session's, else configured."""
    from navapp.cli.prior_files import read_prior
    from navapp.cli.recorded_operation import moved_rig, operation, warnings
    from navapp.cli.session_folder import is_session, read_session
    from navapp.control.operators import RecordedOperator
    from navapp.control.stages import stage_by_name
    from navapp.geometry.rig_files import read_rig
    from navapp.preop import read_plan
    from navapp.values import Prior

    session = read_session(options.sequence) if is_session(options.sequence) else None
    rig_path = options.rig or (session and session.rig_path) or configuration.camera.rig
    plan_path = options.plan or (session and session.plan_path) or configuration.plan.path
    prior_path = options.prior or (session and session.prior_path) or configuration.plan.prior
    method = options.method or (session and session.method) or configuration.tracking.method
    stage = (session and session.first_stage) or configuration.stages.first
    if plan_path is None:
        raise UsageError("no plan is given", remedy="give --plan (make one with `navapp plan`)")
    if rig_path is None:
        raise UsageError("no rig is given", remedy="give --rig, or [camera] rig")
    plan = read_plan(plan_path)
    first = (
        plan.stage(stage_by_name(stage)) if options.bone is None else _stage_of(options.bone, plan)
    )
    others = tuple(_stage_of(name, plan) for name in dict.fromkeys(options.also))
    if first.bone in {other.bone for other in others}:
        raise UsageError(f"the {first.bone} is followed anyway", remedy="leave --also out")
    operator, executor = operation(session, options)
    return _Replay(
        read_rig(rig_path),
        plan,
        Prior() if prior_path is None else read_prior(prior_path),
        first,
        method,
        operator,
        executor,
        others,
        isinstance(operator, RecordedOperator),
        warnings(session, options),
        moved_rig(session, options),
    )


def _stage_of(bone: str, plan: "Plan") -> "StageSpec":
    """The first stage that follows a bone."""
    from navapp.control.stages import stage_of

    if bone not in plan.bones:
        raise UsageError(f"the plan has no bone '{bone}'", remedy=f"it has {', '.join(plan.bones)}")
    return stage_of(bone, plan)


def _controller(
    replay: _Replay,
    opened: "OpenedDevices",
    configuration: "Configuration",
    listeners: "Sequence[FrameListener]",
) -> "SessionController":
    from navapp.control.controller import SessionController, SessionOptions
    from navapp.control.session import SessionHooks
    from navapp.tracking import TrackerSettings

    return SessionController(
        opened.devices,
        replay.rig,
        replay.plan,
        replay.prior,
        executor=replay.executor,
        options=SessionOptions(
            line=TrackerSettings(replay.method, depth_mm=configuration.camera.depth_mm),
            first_stage=replay.stage,
            overlay_valid_ms=configuration.display.valid_ms,
            others=tuple(stage.bone for stage in replay.others),
            mirror_deg=configuration.mirror.calibrated_deg,
        ),
        hooks=SessionHooks(on_frame=tuple(listeners)),
    )
