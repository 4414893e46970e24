"""`navapp accuracy-test`: a localisation and tracking test of a pointer."""

import argparse
import csv
import io
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import asdict
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from navapp import __version__
from navapp.cli.diagnostics import Diagnostics, check_writable, write_json
from navapp.errors import ResultError, UsageError

if TYPE_CHECKING:
    from navapp.config import Configuration
    from navapp.control.accuracy_test.testing import AccuracyTesting
    from navapp.devices.accuracy_test import SimulatedHand
    from navapp.evaluation.accuracy_test.figures import Scatter
    from navapp.geometry.rig import StereoRig
    from navapp.geometry.transform import FloatArray
    from navapp.tools.tool import Tool

_EXAMPLE = """\
examples:
  navapp accuracy-test --out accuracy/                 the simulated rig, pointer and divot plate
  navapp --config mine.toml accuracy-test --divots plate.json --out accuracy/

At five places of the working volume (centre, bottom, top, left, right): the middle divot in three
orientations, leaned about three axes, then every divot of the plate. A person stands the tip in
each divot and presses ENTER; without hardware a simulated hand does it. The folder gets
report.html, accuracy.json and points.csv. In the manner of ASTM F2554, without claiming conformity.
plate.json: {"points_mm": [[x, y, z], ...]}, as the plate was measured.
"""
_MOST_FRAMES_A_TASK = 400


def add_parser(subparsers: Any) -> None:
    """Declare the verb."""
    parser = subparsers.add_parser(
        "accuracy-test",
        help="localisation and tracking test of a pointer, in the manner of ASTM F2554",
        epilog=_EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--out", metavar="DIR", help="new folder for report, figures and points")
    parser.add_argument("--divots", metavar="PLATE.json", help="the divot plate, on real devices")
    parser.add_argument(
        "--places", type=int, default=5, metavar="N", help="the first N of the five places"
    )
    parser.add_argument(
        "--screen", action="store_true", help="show the simulated test on the operator's screen"
    )
    parser.add_argument("--json", metavar="FILE", help="result for programs (- is stdout)")


def run(options: argparse.Namespace, diagnostics: Diagnostics) -> int:
    """Do it; the exit code."""
    from navapp.config import find_file, load
    from navapp.control.accuracy_test.testing import AccuracyTesting
    from navapp.devices.accuracy_test import make_simulated_divots, open_accuracy_test
    from navapp.tools.accuracy_tasks import PLACES, make_tasks, read_divots

    check_writable(options.json)
    if not 1 <= options.places <= len(PLACES):
        raise UsageError(f"--places must be from 1 to {len(PLACES)}")
    folder = _check_folder(options.out)
    configuration = load(find_file(options.config))
    is_simulated = configuration.camera.backend == "simulated"
    if is_simulated and options.divots is not None:
        raise UsageError("the simulated divot plate is built in", remedy="leave --divots away")
    if not is_simulated and options.divots is None:
        raise UsageError("give --divots PLATE.json, the divot plate as it was measured")
    divots_mm = make_simulated_divots() if is_simulated else read_divots(options.divots)
    tool = _find_tool(configuration, diagnostics)
    has_screen = options.screen or not is_simulated
    with ExitStack() as undo:
        opened, hand = open_accuracy_test(configuration, divots_mm, is_headless=not has_screen)
        undo.callback(opened.camera.close)
        tasks = make_tasks(divots_mm, PLACES[: options.places])
        testing = AccuracyTesting(opened.camera, opened.clock, opened.rig, tool, tasks, hand)
        if has_screen:
            if (code := _on_screen(testing)) != 0:
                return code
        else:
            _follow(testing, diagnostics)
    if not testing.taken:
        raise ResultError("the test was left before anything was taken")
    _report(testing, opened.rig, hand, tool, divots_mm, folder, options, diagnostics)
    return 0


def _check_folder(out: str | None) -> Path | None:
    if out is None:
        return None
    folder = Path(out)
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise UsageError(f"{out} exists and is not an empty folder", remedy="name a new one")
    return folder


def _find_tool(configuration: "Configuration", diagnostics: Diagnostics) -> "Tool":
    """The configured pointer; on simulated devices one is calibrated at first."""
    from navapp.control.tool_calibration.calibrating import ToolCalibrating, ToolSettings
    from navapp.devices.simulated_tool import SIMULATED_PLATES
    from navapp.devices.tool_calibration import open_tool_calibration
    from navapp.tools.tool_files import read_tool

    path = configuration.tools.pointer
    if path is not None:
        return read_tool(path)
    from navapp.cli.calibrate_pivot import follow

    if configuration.camera.backend != "simulated":
        raise UsageError(
            "no pointer is known", remedy="calibrate one, and name it in [tools] pointer"
        )
    plate = SIMULATED_PLATES["pointer"]
    with ExitStack() as undo:
        opened, hand = open_tool_calibration(configuration, "pointer", plate, is_headless=True)
        undo.callback(opened.camera.close)
        settings = ToolSettings(has_axis=False)
        calibrating = ToolCalibrating(
            opened.camera, opened.clock, opened.rig, plate, settings, hand
        )
        follow(calibrating, diagnostics)
    tool, _, _ = calibrating.collected.solve(date.today(), opened.rig.rig_id)
    return tool


def _follow(testing: "AccuracyTesting", diagnostics: Diagnostics) -> None:
    """Without a screen: a simulated hand does all tasks."""
    n_waited, n_kept = 0, 0
    while not (snapshot := testing.step()).is_over:
        n_waited = 0 if snapshot.n_kept > n_kept else n_waited + 1
        n_kept = snapshot.n_kept
        if n_waited > _MOST_FRAMES_A_TASK:
            task = "" if snapshot.task is None else snapshot.task.instruction
            raise ResultError(f"nothing can be taken ({task}): {snapshot.missing or 'it moves'}")
        diagnostics.progress("tasks", n_kept / snapshot.n_tasks)
    diagnostics.progress("tasks", 1.0)


def _on_screen(testing: "AccuracyTesting") -> int:
    """The operator does it; 0, or the code of what ended the screen."""
    from navapp.cli.guided_screen import run_on_screen
    from navapp.ui.accuracy_test.app import run_accuracy_app

    return run_on_screen(testing, "accuracy test", run_accuracy_app)


def _report(
    testing: "AccuracyTesting",
    rig: "StereoRig",
    hand: "SimulatedHand | None",
    tool: "Tool",
    divots_mm: "FloatArray",
    folder: Path | None,
    options: argparse.Namespace,
    diagnostics: Diagnostics,
) -> None:
    """Tell, and write what was asked for."""
    from navapp.evaluation.accuracy_test.figures import measure_all
    from navapp.evaluation.accuracy_test.report import write_localisation_report
    from navapp.geometry.whole_files import write_whole

    figures, distances = measure_all(testing.taken, divots_mm)
    truth = _compare_with_truth(testing, hand)
    about = {
        "software": f"navapp {__version__}",
        "day": date.today().isoformat(),
        "rig": f"{rig.name} ({rig.rig_id})",
        "devices": "simulated" if hand is not None else testing.snapshot.camera,
        "tip's bound from its calibration": _tip_text(tool),
        "tasks done": f"{testing.snapshot.n_kept} of {testing.snapshot.n_tasks}",
    }
    content: dict[str, Any] = {
        "places": {place: asdict(one) for place, one in figures.items()},
        "distances": None if distances is None else asdict(distances),
        "against_truth": None if truth is None else asdict(truth),
        "tasks_done": testing.snapshot.n_kept,
        "tasks": testing.snapshot.n_tasks,
        "simulated": hand is not None,
    }
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
        write_json(str(folder / "accuracy.json"), "accuracy-test", content)
        write_whole(folder / "points.csv", _points_csv(testing).encode("utf-8"))
        write_localisation_report(
            folder / "report.html", testing.taken, figures, distances, divots_mm, about, truth
        )
    write_json(options.json, "accuracy-test", content)
    if options.json != "-":
        _tell(content, folder, diagnostics.say)


def _tip_text(tool: "Tool") -> str:
    from navapp.tools.tool import bound_of

    made = "" if tool.made_on is None else f", {tool.made_on.isoformat()}"
    return f"{bound_of(tool.tip_covariance_mm2):.2f} mm{made}"


def _compare_with_truth(
    testing: "AccuracyTesting", hand: "SimulatedHand | None"
) -> "Scatter | None":
    """Of a simulated test: distances of all tips from their divots."""
    from navapp.evaluation.accuracy_test.figures import Scatter

    if hand is None:
        return None
    off = np.array(
        [np.linalg.norm(one.tip_mm - hand.true_divot_mm(one.task)) for one in testing.taken]
    )
    rms_mm = float(np.sqrt(np.mean(off**2)))
    return Scatter(len(off), float(off.mean()), float(np.ptp(off)), rms_mm, float(off.max()))


def _points_csv(testing: "AccuracyTesting") -> str:
    """Every tip that was taken."""
    stream = io.StringIO()
    writer = csv.writer(stream)
    writer.writerow(
        ["place", "kind", "number", "divot", "captured_ns", "x_mm", "y_mm", "z_mm", "bound_mm"]
    )
    for one in testing.taken:
        task = one.task
        tip = [f"{value:.4f}" for value in one.tip_mm]
        head = [task.place, task.kind, task.number, task.divot + 1, one.captured_ns]
        writer.writerow([*head, *tip, f"{one.bound_mm:.4f}"])
    return stream.getvalue()


def _tell(content: Mapping[str, Any], folder: Path | None, say: Callable[[str], None]) -> None:
    for place, one in content["places"].items():
        point = one["point"]
        parts = [] if point is None else [f"point {point['rms_mm']:.3f} mm RMS"]
        leaned = [scatter["rms_mm"] for scatter in one["rotations"].values() if scatter]
        parts += [f"rotations {max(leaned):.3f}"] if leaned else []
        if one["distances"]:
            parts.append(
                f"{one['distances']['n']} distances {one['distances']['rms_mm']:.3f} RMS, "
                f"{one['distances']['max_mm']:.3f} at most"
            )
        say(f"{place}: {', '.join(parts)}")
    if content["distances"]:
        all_of = content["distances"]
        say(
            f"all {all_of['n']} distances: mean {all_of['mean_mm']:+.3f} mm, "
            f"RMS {all_of['rms_mm']:.3f}, at most {all_of['max_mm']:.3f}"
        )
    if content["against_truth"]:
        truth = content["against_truth"]
        say(
            f"simulated; against the truth: {truth['mean_mm']:.3f} mm mean, "
            f"{truth['max_mm']:.3f} at most"
        )
    if folder is not None:
        say(f"wrote {folder}/report.html, accuracy.json, points.csv")
