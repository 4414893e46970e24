"""`navapp replay`: the same line on a recorded sequence, as fast as it goes."""

import argparse
import time
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from navapp.cli.diagnostics import Diagnostics, check_writable, write_json
from navapp.errors import InputError, ResultError, UsageError

if TYPE_CHECKING:
    from navapp.cli.session_folder import RecordedSession
    from navapp.config import Configuration
    from navapp.control.executors import Executor
    from navapp.control.operators import Operator
    from navapp.control.results import FrameResult
    from navapp.geometry.rig import StereoRig
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
    parser.add_argument("--prior", metavar="FILE", help="rough start pose (JSON)")
    parser.add_argument("--method", choices=("bimcc", "icp"), help="icp is the paper's baseline")
    parser.add_argument("--bone", metavar="NAME", help="bone to follow (default femur)")
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
    """What is replayed, and who operates."""

    rig: "StereoRig"
    plan: "Plan"
    prior: "Prior"
    stage: "StageSpec"
    method: str
    operator: "Operator"
    executor: "Executor"


def run(options: argparse.Namespace, diagnostics: Diagnostics) -> int:
    """Do it."""
    from navapp.cli.run import check_accepted
    from navapp.config import find_file, load

    _check(options)
    configuration = load(find_file(options.config))
    replay = _prepare(configuration, options)
    check_accepted(replay.rig, options.allow_unaccepted, diagnostics)
    frames, seconds = _follow(replay, configuration, options, diagnostics)
    _finish(frames, seconds, options, diagnostics)
    return 0


def _check(options: argparse.Namespace) -> None:
    if options.frames is not None and options.frames < 1:
        raise UsageError("--frames must be at least 1")
    if options.fps is not None and not options.fps > 0.0:
        raise UsageError("--fps must be positive")
    if options.order == "pingpong" and options.frames is None:
        raise UsageError("--order pingpong has no end", remedy="add --frames N")
    check_writable(options.json)
    overlay = options.overlay
    if overlay is not None and Path(overlay).exists() and not Path(overlay).is_dir():
        raise InputError(f"{overlay} is not a folder", remedy="choose another --overlay")


def _prepare(configuration: "Configuration", options: argparse.Namespace) -> _Replay:
    """Everything but the pictures; what the command line says wins over the session's own."""
    from navapp.cli.session_folder import is_session, read_session
    from navapp.cli.sessions import read_prior
    from navapp.control.executors import InlineExecutor
    from navapp.control.operators import ReplayOperator
    from navapp.control.stages import stage_by_name
    from navapp.devices import configured_rig
    from navapp.geometry.rig import read_rig
    from navapp.preop import read_plan
    from navapp.values import Prior

    session = read_session(options.sequence) if is_session(options.sequence) else None
    rig = read_rig(options.rig) if options.rig else None
    plan_path = options.plan or configuration.plan.path
    plan = read_plan(plan_path) if plan_path and not (session and not options.plan) else None
    prior_path = options.prior or (None if session else configuration.plan.prior)
    prior = read_prior(prior_path) if prior_path else None
    if session is not None:
        rig, plan = rig or session.rig, plan or session.plan
    if plan is None:
        raise UsageError("no plan is given", remedy="give --plan (make one with `navapp plan`)")
    rig = rig or configured_rig(configuration)
    bone = options.bone or "femur"
    if options.bone is not None and bone not in plan.bones:
        raise UsageError(f"the plan has no bone '{bone}'", remedy=f"it has {', '.join(plan.bones)}")
    if session is not None and not _changes_operation(options):
        return _as_recorded(session, rig, plan, prior or session.prior, options)
    if prior is None and session is not None:
        prior = session.prior
    return _Replay(
        rig,
        plan,
        prior or Prior(),
        _stage_of(bone) or stage_by_name(configuration.stages.first),
        options.method or configuration.tracking.method,
        ReplayOperator(each_frame=options.order == "each"),
        InlineExecutor(),
    )


def _changes_operation(options: argparse.Namespace) -> bool:
    """Whether the recorded operator's commands cannot be given again."""
    return bool(
        options.prior or options.bone or options.method or options.start
        or options.order != "forward"
    )  # fmt: skip


def _as_recorded(
    session: "RecordedSession",
    rig: "StereoRig",
    plan: "Plan",
    prior: "Prior",
    options: argparse.Namespace,
) -> _Replay:
    """With the recorded operator: the same poses come out."""
    from navapp.control.executors import RecordedExecutor
    from navapp.control.operators import RecordedOperator
    from navapp.control.stages import stage_by_name

    return _Replay(
        rig,
        plan,
        prior,
        stage_by_name(session.first_stage),
        session.method,
        RecordedOperator(session.events.commands),
        RecordedExecutor(session.events.take_overs),
    )


def _stage_of(bone: str) -> "StageSpec | None":
    """The first stage that follows a bone."""
    from navapp.control.stages import STAGES

    return next((stage for stage in STAGES if stage.bone == bone), None)


def _follow(
    replay: _Replay,
    configuration: "Configuration",
    options: argparse.Namespace,
    diagnostics: Diagnostics,
) -> tuple[list[dict[str, Any]], float]:
    """Run the line over the sequence."""
    from navapp.cli.sessions import frame_to_json
    from navapp.control.controller import SessionController, SessionOptions
    from navapp.control.runner import run_headless
    from navapp.devices import Recording, open_recording
    from navapp.tracking import LineSettings

    recording = Recording(
        options.sequence,
        order="pingpong" if options.order == "pingpong" else "forward",
        n_frames=options.frames,
        start=options.start,
        rate_hz=options.fps or configuration.camera.rate_hz,
        is_side_by_side=options.split is not None,
    )
    opened = open_recording(recording, replay.rig, configuration)
    n_frames = opened.devices.camera.info.n_frames
    frames: list[dict[str, Any]] = []
    overlay = None if options.overlay is None else Path(options.overlay)

    def keep(result: "FrameResult") -> None:
        frames.append(frame_to_json(result, None))
        if overlay is not None:
            _write_overlay(overlay, len(frames) - 1, result)
        if n_frames:
            diagnostics.progress("frames", len(frames) / n_frames)

    with ExitStack() as undo:
        undo.callback(opened.devices.close)
        controller = SessionController(
            opened.devices,
            replay.rig,
            replay.plan,
            replay.prior,
            executor=replay.executor,
            options=SessionOptions(
                line=LineSettings(
                    method="icp" if replay.method == "icp" else "bimcc",
                    depth_mm=configuration.camera.depth_mm,
                ),
                first_stage=replay.stage,
                rig_name=replay.rig.name,
            ),
            hooks=_hooks(keep),
        )
        undo.callback(controller.close)
        started = time.perf_counter()
        run_headless(controller, replay.operator)
        return frames, time.perf_counter() - started


def _hooks(keep: Any) -> Any:
    from navapp.control.controller import SessionHooks

    return SessionHooks(on_frame=(keep,))


def _write_overlay(folder: Path, number: int, result: "FrameResult") -> None:
    import cv2

    from navapp.geometry.ply import write_whole

    folder.mkdir(parents=True, exist_ok=True)
    _, encoded = cv2.imencode(".jpg", result.picture.image, [cv2.IMWRITE_JPEG_QUALITY, 92])
    write_whole(folder / f"overlay_{number:04d}.jpg", encoded.tobytes())


def _finish(
    frames: list[dict[str, Any]],
    seconds: float,
    options: argparse.Namespace,
    diagnostics: Diagnostics,
) -> None:
    from navapp.cli.sessions import summarise, summary_text

    summary = summarise(frames, seconds)
    write_json(options.json, "replay", {"frames": frames, "summary": summary})
    if options.json != "-":
        diagnostics.say(summary_text(summary))
    if summary["ok"] == 0:
        raise ResultError("no frame was OK", remedy="see the reasons in --json")
