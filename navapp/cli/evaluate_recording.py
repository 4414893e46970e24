"""`navapp evaluate --recording`: the methods on a recording whose truth is known."""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from navapp.cli.campaign_options import choose_methods
from navapp.cli.diagnostics import Diagnostics, check_writable, write_json
from navapp.errors import ResultError, SequenceError, UsageError

if TYPE_CHECKING:
    from navapp.cli.session_folder import RecordedSession
    from navapp.config import Configuration
    from navapp.evaluation.recording.study import Studied, Study
    from navapp.tracking import Method

_TRUTH, _PRIOR, _RIG = "truth.json", "prior.json", "rig.yml"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options of a recording."""
    group = parser.add_argument_group(
        "a recording instead of simulated knees (docs/phantom-study.md)"
    )
    group.add_argument(
        "--recording",
        metavar="SEQ",
        help="session folder, folder of pairs, LEFT.mp4,RIGHT.mp4; or a folder of such folders "
        "that each have truth.json and prior.json",
    )
    group.add_argument("--rig", metavar="R", help="rig file (a session brings its own)")
    group.add_argument("--plan", metavar="P", help="plan folder (a session brings its own)")
    group.add_argument(
        "--truth", metavar="T", help="where the bone was (default: truth.json in SEQ)"
    )
    group.add_argument(
        "--prior", metavar="FILE", help="where the bone is searched (default: prior.json in SEQ)"
    )
    group.add_argument("--bone", metavar="NAME", help="bone to follow (the first stage's)")
    group.add_argument("--fps", type=float, metavar="F", help="rate where there are no times (15)")
    group.add_argument(
        "--allow-unaccepted", action="store_true", help="use a rig that was not accepted"
    )


@dataclass(frozen=True, slots=True)
class _Sequence:
    """A recording and the files that belong to it."""

    name: str
    source: str
    truth_path: str
    prior_path: str | None  # None: that of the session or the configuration


def run_recording(options: argparse.Namespace, diagnostics: Diagnostics) -> int:
    """Run the evaluation, and return the exit code."""
    from navapp.config import find_file, load
    from navapp.evaluation.recording.report import check_folder, write_report

    check_writable(options.json)
    if options.fps is not None and not 0.0 < options.fps < float("inf"):
        raise UsageError(f"a rate of {options.fps:g} Hz is none", remedy="give a positive --fps")
    folder = check_folder(options.out)
    configuration = load(find_file(options.config))
    # All files are read before the first recording is followed: that takes long.
    given = [
        _read(sequence, options, configuration, diagnostics)
        for sequence in _list_sequences(options, diagnostics)
    ]
    studied, failures = _study_all(given, choose_methods(options), diagnostics)
    content = write_report(folder, studied)
    write_json(str(folder / "evaluate.json"), "evaluate", content)
    write_json(options.json, "evaluate", content)
    if options.json != "-":
        _say(content["rows"], options.out, diagnostics)
    if not any(row["ok_share"] > 0.0 for row in content["rows"]):
        raise ResultError("no frame was OK", remedy=f"see the reasons in {folder / 'frames.csv'}")
    if failures:
        raise ResultError(
            f"{len(failures)} of {len(given)} recordings could not be evaluated",
            remedy="see the warnings; the results are of the others",
        )
    return 0


def _study_all(
    given: "Sequence[_Given]", methods: "Sequence[Method]", diagnostics: Diagnostics
) -> "tuple[list[Studied], list[ResultError]]":
    """Every recording that can be evaluated, and why others cannot.

    Raises:
        ResultError: the only one cannot be, or none can.
    """
    studied: list[Studied] = []
    failures: list[ResultError] = []
    for one in given:
        try:
            studied.append(_study(one, methods, diagnostics))
        except ResultError as error:
            if len(given) == 1:
                raise
            diagnostics.warn(f"{one.study.name} is left out: {error}")
            failures.append(error)
    if not studied:
        raise failures[0]
    return studied, failures


def _list_sequences(options: argparse.Namespace, diagnostics: Diagnostics) -> list[_Sequence]:
    """The recording itself, or those in the folder."""
    from navapp.cli.session_folder import is_session

    path = Path(options.recording)
    if not path.exists() and "," not in options.recording:
        raise SequenceError(
            f"there is no recording {path}",
            subject=str(path),
            remedy="give a session folder, a folder of pairs, or two videos LEFT,RIGHT",
        )
    inner = sorted(found.parent for found in path.glob(f"*/{_TRUTH}")) if path.is_dir() else []
    ready = [one for one in inner if (one / _PRIOR).is_file() or is_session(one)]
    if ready:
        for name in ("truth", "prior"):
            if getattr(options, name) is not None:
                raise UsageError(
                    f"{path} holds several recordings, each with its own {name}.json",
                    subject=str(path),
                    remedy=f"leave --{name} out, or name one of them with --recording",
                )
        for one in (one for one in inner if one not in ready):
            diagnostics.warn(f"{one} is left out: nothing says where the bone is ({_PRIOR})")
        return [
            _Sequence(
                f"{path.name}/{one.name}", str(one), str(one / _TRUTH), _find_beside(one, _PRIOR)
            )
            for one in ready
        ]
    truth_path = options.truth or _find_beside(path, _TRUTH)
    if truth_path is None:
        raise UsageError(
            f"nothing says where the bone was in {path}",
            subject=str(path),
            remedy="give --truth FILE (docs/phantom-study.md shows three kinds)",
        )
    prior_path = options.prior or _find_beside(path, _PRIOR)
    return [_Sequence(path.name, options.recording, truth_path, prior_path)]


def _find_beside(path: Path, name: str) -> str | None:
    return str(path / name) if (path / name).is_file() else None


@dataclass(frozen=True, slots=True, eq=False)
class _Given:
    """What a recording is evaluated with."""

    source: str  # of its pictures
    study: "Study"
    rate_hz: float  # where there are no times


def _read(
    sequence: _Sequence,
    options: argparse.Namespace,
    configuration: "Configuration",
    diagnostics: Diagnostics,
) -> _Given:
    """All but the pictures, checked against each other and against the pictures' numbers."""
    from navapp.cli.headless import check_accepted, check_start
    from navapp.cli.other_bones import find_stage_of
    from navapp.cli.recorded_operation import find_drawn_start
    from navapp.cli.replay_truth import check_recorded_truth
    from navapp.cli.session_folder import is_session, read_session
    from navapp.control.prior_files import read_prior
    from navapp.control.stages import stage_by_name
    from navapp.evaluation.recording.study import Study
    from navapp.evaluation.recording.truth_files import read_truth
    from navapp.geometry.rig_files import read_rig
    from navapp.preop import read_plan
    from navapp.values import Prior

    session = read_session(sequence.source) if is_session(sequence.source) else None
    rig_path, plan_path = _find_rig_and_plan(sequence, session, options, configuration)
    truth, plan, rig = read_truth(sequence.truth_path), read_plan(plan_path), read_rig(rig_path)
    check_accepted(rig, options.allow_unaccepted, diagnostics)
    first = (session and session.first_stage) or configuration.stages.first
    named = options.bone is not None
    stage = find_stage_of(options.bone, plan) if named else plan.stage(stage_by_name(first))
    prior_path = sequence.prior_path or (session and session.prior_path) or configuration.plan.prior
    prior = Prior() if prior_path is None else read_prior(prior_path)
    if session is not None and options.prior is None:
        prior = find_drawn_start(session, prior, stage.bone)
    check_start(prior, stage.bone)
    check_recorded_truth(truth, sequence.truth_path, sequence.source, stage.bone)
    rate_hz = configuration.camera.rate_hz if options.fps is None else options.fps
    study = Study(sequence.name, truth, configuration, rig, plan, prior, stage)
    return _Given(sequence.source, study, rate_hz)


def _study(given: _Given, methods: "Sequence[Method]", diagnostics: Diagnostics) -> "Studied":
    from navapp.evaluation.recording.study import open_frames, study

    name = given.study.name
    told = _Progress(name, len(methods), diagnostics)
    with open_frames(given.source, given.study.rig, given.rate_hz, told) as frames:
        diagnostics.note(f"{name}: {len(frames)} pairs, {', '.join(methods)}")
        return study(given.study, frames, methods)


def _find_rig_and_plan(
    sequence: _Sequence,
    session: "RecordedSession | None",
    options: argparse.Namespace,
    configuration: "Configuration",
) -> tuple[str | Path, str | Path]:
    """The command line's, else the session's, else what is configured."""
    rig_path = (
        options.rig
        or (session and session.rig_path)
        or _find_beside(Path(options.recording), _RIG)
        or configuration.camera.rig
    )
    plan_path = options.plan or (session and session.plan_path) or configuration.plan.path
    if plan_path is None:
        raise UsageError("no plan is given", remedy="give --plan (make one with `navapp plan`)")
    if rig_path is None:
        raise UsageError("no rig is given", remedy="give --rig, or [camera] rig")
    return rig_path, plan_path


class _Progress:
    """Counts the pairs that are loaded: once for each method, and the first at the beginning."""

    def __init__(self, name: str, n_methods: int, diagnostics: Diagnostics) -> None:
        self._name, self._n_methods, self._diagnostics = name, n_methods, diagnostics
        self._n_loaded = 0

    def __call__(self, n_frames: int) -> None:
        self._n_loaded += 1
        share = self._n_loaded / (self._n_methods * (n_frames + 1))
        self._diagnostics.progress(self._name, min(share, 0.99))


def _say(rows: Sequence[dict[str, Any]], out: str, diagnostics: Diagnostics) -> None:
    def mm(value: float | None) -> str:
        return "-" if value is None else f"{value:.2f}"

    for row in rows:
        n_ok, worst_mm = round(row["ok_share"] * row["frames"]), row["tre_percentiles_mm"]["p100"]
        diagnostics.say(
            f"{row['sample']}, {row['method']}: {n_ok} of {row['frames']} frames OK, error mean "
            f"{mm(row['tre_mm'])} mm, largest {mm(worst_mm)} mm, OK and wrong: "
            f"{row['wrong_and_ok']}"
        )
    diagnostics.say(f"tables, report and all frames: {out}")
