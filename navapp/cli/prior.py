"""`navapp prior`: a start for a first registration, from choices on a picture."""

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from navapp.cli.diagnostics import Diagnostics, check_writable, write_json
from navapp.errors import InputError, ResultError, UsageError

if TYPE_CHECKING:
    from drivers.frames import StereoFrame
    from navapp.config import Configuration
    from navapp.control.specification import SessionSpecification
    from navapp.geometry.rig import StereoRig
    from navapp.values import Pick, Plan, Prior, StageSpec, TrackedFrame

_EXAMPLE = """\
examples:
  navapp prior pairs/ --plan P --rig rig.yml --box 520,210,260,240 --out prior.json
  navapp prior pairs/ --plan P --rig rig.yml --out prior.json \\
      --points femur/notch=640,330 femur/medial_condyle=590,350 femur/trochlea=642,250
  navapp --config mine.toml prior - --plan P --rig rig.yml --box 520,210,260,240 --out prior.json

A box goes around what is seen of the bone in the left picture, as x, y, width, height; points are
landmarks of the plan, three or more, where they are seen. The bone is registered in the first pair
from them, and what came of it is told. `navapp run` draws a box without a file: key b.
"""
_TIMEOUT_S = 10.0


def add_parser(subparsers: Any) -> None:
    """Declare the verb."""
    parser = subparsers.add_parser(
        "prior",
        help="a start for the first registration, from a box or landmarks in a picture",
        epilog=_EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "sequence", metavar="SEQ", help="folder of pairs, LEFT.mp4,RIGHT.mp4; - is the camera"
    )
    parser.add_argument("--plan", metavar="P", required=True, help="plan folder")
    parser.add_argument("--rig", metavar="R", required=True, help="rig file")
    parser.add_argument("--out", metavar="FILE", required=True, help="prior to write")
    parser.add_argument("--box", metavar="X,Y,W,H", help="around the bone in the left picture, px")
    parser.add_argument(
        "--points", metavar="NAME=U,V", nargs="+", default=[], help="landmarks in it, px"
    )
    parser.add_argument("--bone", metavar="NAME", default="femur", help="default: femur")
    parser.add_argument("--start", type=int, default=0, metavar="I", help="first picture's number")
    parser.add_argument("--replace", action="store_true", help="replace FILE when it exists")
    parser.add_argument("--json", metavar="FILE", help="result for programs (- is stdout)")


def run(options: argparse.Namespace, diagnostics: Diagnostics) -> int:
    """Do it."""
    from navapp.cli.headless import check_accepted
    from navapp.config import find_file, load
    from navapp.control.prior_files import prior_to_json
    from navapp.control.specification import specify_session
    from navapp.geometry.rig_files import read_rig
    from navapp.preop import read_plan
    from navapp.values import Status

    _check(options)
    configuration = load(find_file(options.config))
    plan, rig = read_plan(options.plan), read_rig(options.rig)
    prior = _make_prior(options, plan, rig)
    stage = _stage_of(plan, options.bone)
    check_accepted(rig, True, diagnostics)
    # The paper's methods need a rough pose.
    specification = specify_session(
        configuration, rig, plan, prior, stage, is_live=False, method="bimcc"
    )
    tracked = _register(specification, _read_pair(options, configuration, rig), diagnostics)
    text = json.dumps(prior_to_json(prior), indent=1) + "\n"
    Path(options.out).write_text(text, encoding="utf-8")
    status = Status.LOST if tracked is None else tracked.verdict.status
    reasons = [] if tracked is None else [one.value for one in tracked.verdict.reasons]
    bound_mm = None if tracked is None else tracked.verdict.predicted_tre_mm
    content = {"out": options.out, "status": status.name, "reasons": reasons}
    write_json(options.json, "prior", {**content, "predicted_tre_mm": bound_mm})
    if status is not Status.OK:
        why = "; ".join(reasons) or "the bone was not found"
        raise ResultError(
            f"{options.out} is written, but no pose is OK from it in this picture: {why}",
            remedy="compare the choices with the picture, or take another one",
        )
    if options.json != "-":
        diagnostics.say(f"{options.out}: the {options.bone} is found, error <= {bound_mm:.2f} mm")
    return 0


def _check(options: argparse.Namespace) -> None:
    """Refuse what is known to be wrong before anything is read."""
    if options.box is None and not options.points:
        raise UsageError("nothing tells where the bone is", remedy="give --box or --points")
    if options.box is not None and options.points:
        raise UsageError("--box and --points are two starts", remedy="give one of them")
    if options.sequence == "-" and options.start:
        raise UsageError("--start is of a recording", remedy="leave it away with -")
    for path in (options.out, options.json):
        check_writable(path)
    if Path(options.out).exists() and not options.replace:
        raise InputError(
            f"{options.out} exists",
            subject=options.out,
            remedy="name another file, or add --replace",
        )


def _make_prior(options: argparse.Namespace, plan: "Plan", rig: "StereoRig") -> "Prior":
    """The start that was chosen.

    Raises:
        UsageError: it cannot be meant.
    """
    from navapp.values import FEWEST_PICKS, Prior, find_crowded

    size = f"{rig.width}x{rig.height}"
    if options.box is not None:
        x, y, width, height = _numbers("--box", options.box, 4)
        is_inside = x < rig.width and y < rig.height and x + width > 0 and y + height > 0
        if width < 1 or height < 1 or not is_inside:
            raise UsageError(
                f"--box {options.box} is no box in a picture of {size}",
                remedy="give x, y, width, height in px",
            )
        return Prior(box=(int(x), int(y), int(width), int(height)))
    picks = tuple(_pick(one, options.bone, plan, rig) for one in options.points)
    if len({pick.name for pick in picks}) < max(len(picks), FEWEST_PICKS):
        raise UsageError(
            f"{len(picks)} points do not tell a pose",
            remedy=f"give {FEWEST_PICKS} or more, each landmark once",
        )
    if (crowded := find_crowded(picks)) is not None:
        raise UsageError(
            f"{' and '.join(crowded)} are at one place of the picture",
            remedy="give landmarks that lie apart",
        )
    return Prior(picks=picks)


def _pick(text: str, bone: str, plan: "Plan", rig: "StereoRig") -> "Pick":
    from navapp.values import Pick

    name, equals, place = text.partition("=")
    if not equals:
        raise UsageError(f"--points takes NAME=U,V, not '{text}'")
    u, v = _numbers("--points", place, 2)
    if not (0 <= u < rig.width and 0 <= v < rig.height):
        raise UsageError(
            f"--points {text} is not in a picture of {rig.width}x{rig.height}",
            remedy="give column and row in px",
        )
    known = plan.landmarks_of(bone)
    if name not in known:
        raise UsageError(
            f"the plan has no landmark '{name}' of the {bone}",
            remedy=f"choose of {', '.join(sorted(known))}" if known else "give --box instead",
        )
    return Pick(name, bone, (u, v), known[name])


def _numbers(option: str, text: str, n: int) -> list[float]:
    try:
        values = [float(word) for word in text.split(",")]
    except ValueError:
        values = []
    if len(values) != n or not all(abs(value) < 1e6 for value in values):
        raise UsageError(f"{option} takes {n} numbers with commas, not '{text}'")
    return values


def _stage_of(plan: "Plan", bone: str) -> "StageSpec":
    """The first stage that shows a bone."""
    from navapp.control.stages import STAGES

    stages = [stage for stage in map(plan.stage, STAGES) if stage.bone == bone]
    if bone not in plan.bones or not stages:
        raise UsageError(
            f"the plan has no model of the {bone}", remedy=f"choose of {', '.join(plan.bones)}"
        )
    return stages[0]


def _read_pair(
    options: argparse.Namespace, configuration: "Configuration", rig: "StereoRig"
) -> "StereoFrame":
    """The first pair of the recording, or one of the camera."""
    from drivers.replay_camera import ReplaySettings
    from navapp.config import Configuration
    from navapp.devices import open_live, open_recording

    if options.sequence == "-":
        # Of all devices only the cameras are asked.
        camera = configuration.camera.model_copy(update={"rig": options.rig})
        opened = open_live(Configuration(camera=camera), is_headless=True)
    else:
        settings = ReplaySettings(n_frames=1, start=options.start)
        opened = open_recording(options.sequence, settings, rig, configuration)
    try:
        return opened.devices.camera.read(_TIMEOUT_S)
    finally:
        opened.devices.close()


def _register(
    specification: "SessionSpecification", frame: "StereoFrame", diagnostics: Diagnostics
) -> "TrackedFrame | None":
    """The best answer; None when there is none at all."""
    from navapp.control.trackers import Trackers

    trackers = Trackers(
        specification.rig,
        specification.plan,
        specification.prior,
        specification.tracker_settings,
    )

    def tell(share: float) -> None:
        diagnostics.progress("searching", share)

    answers = trackers.register(specification.stage, frame, tell)
    return answers[0] if answers else None
