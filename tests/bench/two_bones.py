"""Femur and tibia together: the tibia found from the femur, angles and gaps, against the truth.

usage: python -m tests.bench.two_bones [FOLDER] [--only NAME] [--order ORDER ...] [--frames]
                                       [--knees N] [--first SEED]

FOLDER (default: NAVAPP_DATA) holds `phantom_*` folders as of `tests.bench.recorded_accuracy`. Each
sequence is replayed with `--also tibia`, from a prior that says nothing of the tibia: every frame
on its own (`each`), or as it is (`forward`). A frame is exempt when the bound at the true pose
exceeds 0.5 mm: where the tibia rests next to that pose, behind the femur at its true pose, as
judged there; `--frames` lists them. Hip and ankle centre of the phantoms' plans are made up: they
say where the axes are, for estimate and truth alike. With --knees, simulated sessions with seeds
from SEED on are run instead: the tibia is looked for once the femur is accepted, and followed in
its turns of 16 frames.
"""

import argparse
import json
import os
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from navapp.cli.diagnostics import Diagnostics
from navapp.cli.headless import FrameLog, run_session
from navapp.cli.live_session import make_controller, prepare_session
from navapp.cli.main import _parser
from navapp.cli.main import run as run_navapp
from navapp.cli.results import limb_to_json
from navapp.config import parse
from navapp.control.scripted_operator import ScriptedOperator, ScriptStep
from navapp.evaluation import compute_mean_tre_mm
from navapp.geometry.ply import read_ply
from navapp.geometry.rig_files import read_rig
from navapp.geometry.transform import RigidTransform
from navapp.joint import OccludedTracker
from navapp.limb import BoneSurface, LimbMeter
from navapp.preop import read_plan
from navapp.tracking import Goal, make_tracker
from navapp.tracking.bimcc_tracker import BimccTracker
from navapp.values import Plan, PoseEstimate
from tests.bench.recorded_accuracy import find_sequences
from tests.pictures import Pictures
from tests.recorded import read_true_poses

_FAR_JOINTS = """\
[hip]
point_mm = [{x}, 0.0, 420.0]
[ankle]
point_mm = [{x}, 5.0, -390.0]
"""
_EXEMPT_MM, _WRONG_MM = 0.5, 0.5
_BONES = ("femur", "tibia")
_ANGLES = ("flexion", "varus", "internal_rotation")
_SIDES = ("medial", "lateral")
_UNRELATED = ("registration",)
_N_FRAMES = 16


@dataclass
class Errors:
    """Of each angle (deg) and of the gaps (mm), each with its bound."""

    of: dict[str, list[tuple[float, float]]] = field(default_factory=dict)

    def add(self, limb: Mapping[str, Any], truth: Mapping[str, Any]) -> None:
        """One measurement beside its truth, as JSON."""
        for name in _ANGLES:
            self._add(name, limb, truth, f"{name}_deg", limb["bound_deg"][name])
        for name in _SIDES:
            self._add("gaps", limb, truth, f"gap_{name}_mm", limb["bound_mm"][name])

    def _add(
        self,
        name: str,
        limb: Mapping[str, Any],
        truth: Mapping[str, Any],
        key: str,
        bound: float | None,
    ) -> None:
        if limb[key] is not None and truth[key] is not None and bound is not None:
            self.of.setdefault(name, []).append((abs(limb[key] - truth[key]), bound))

    def rows(self, name: str) -> Iterator[str]:
        """Of the table."""
        angles = [one for angle in _ANGLES for one in self.of.get(angle, [])]
        for what, errors in (*self.of.items(), ("all angles", angles)):
            if errors:
                unit = "mm" if what == "gaps" else "deg"
                error, bound = np.array(errors).T
                yield (
                    f"| {name} | {what.replace('_', ' ')} | {len(error)} | "
                    f"{np.median(error):.2f} {unit} | {np.percentile(error, 95):.2f} {unit} | "
                    f"{error.max():.2f} {unit} | {np.median(bound):.2f} {unit} | "
                    f"{100.0 * np.mean(error <= bound):.0f} % |"
                )


@dataclass(frozen=True)
class Turn:
    """One turn of a tibia beside the truth; NaN without a pose."""

    index: int
    status: str
    reasons: tuple[str, ...]
    tre_mm: float
    bound_mm: float
    exempt_mm: float  # bound at the true pose

    @property
    def is_exempt(self) -> bool:
        """Not even the true pose would be OK."""
        return not self.exempt_mm <= _EXEMPT_MM


def main() -> int:
    """Print both tables."""
    options = _options()
    errors: dict[str, Errors] = {}
    if options.knees:
        _run_knees(options, errors)
    else:
        _replay_phantoms(options, errors)
    print("\n| of | | n | error median | 95 % | worst | bound median | bound holds |")
    print("|---|---|---|---|---|---|---|---|")
    for name, one in errors.items():
        for row in one.rows(name):
            print(row)
    return 0


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "folder", nargs="?", default=os.environ.get("NAVAPP_DATA", "../shared/data")
    )
    parser.add_argument("--only", default="", help="sequences whose name contains this")
    parser.add_argument("--order", choices=("each", "forward"), nargs="+", default=["each"])
    parser.add_argument("--frames", action="store_true", help="a line for every turn as well")
    parser.add_argument("--knees", type=int, default=0, metavar="N", help="simulated ones instead")
    parser.add_argument("--first", type=int, default=1301, metavar="SEED")
    return parser.parse_args()


def _replay_phantoms(options: argparse.Namespace, errors: dict[str, Errors]) -> None:
    print("| sequence | order | turns | exempt | OK | OK of the others | TRE median | worst OK | "
          "bound median | bound holds | ms |")  # fmt: skip
    print("|---|---|---|---|---|---|---|---|---|---|---|")
    for phantom in sorted(Path(options.folder).glob("phantom_*")):
        with tempfile.TemporaryDirectory() as folder:
            plan = _make_plan(phantom, Path(folder))
            bench = PhantomBench(phantom, read_plan(plan))
            for sequence in find_sequences(phantom, options.only):
                orders = ["each"] if sequence.name in _UNRELATED else options.order
                for order in orders:
                    frames = _replay(phantom, sequence, plan, order)
                    name = f"{phantom.name}/{sequence.name}"
                    turns = list(bench.score(frames, sequence))
                    for one in (phantom.name, "all phantoms"):
                        bench.score_limbs(frames, sequence, errors.setdefault(one, Errors()))
                    print(_row(name, order, turns, frames), flush=True)
                    if options.frames:
                        _print_turns(turns)


def _make_plan(phantom: Path, folder: Path) -> Path:
    tibia = phantom / "tibia.ply"
    (folder / "contents.toml").write_text(
        _FAR_JOINTS.format(x=round(float(read_ply(tibia)[0].vertices_mm[:, 0].mean()), 1))
    )
    run_navapp([
        "--quiet", "plan", "--surface", f"femur={phantom / 'femur.ply'}", "--surface",
        f"tibia={tibia}", "--side", "right", "--contents", str(folder / "contents.toml"), "--out",
        str(folder / "plan"),
    ])  # fmt: skip
    return folder / "plan"


def _replay(phantom: Path, sequence: Path, plan: Path, order: str) -> list[dict[str, Any]]:
    """Frames of `navapp replay --also tibia`; nothing is told of the tibia's pose."""
    prior = json.loads((sequence / "prior.json").read_text())
    prior.pop("camera_from_model_tibia", None)
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "prior.json").write_text(json.dumps(prior))
        run_navapp([
            "--quiet", "replay", str(sequence), "--rig", str(phantom / "rig.yml"), "--plan",
            str(plan), "--prior", f"{folder}/prior.json", "--order", order, "--bone", "femur",
            "--also", "tibia", "--json", f"{folder}/poses.json",
        ])  # fmt: skip
        frames: list[dict[str, Any]] = json.loads(Path(f"{folder}/poses.json").read_text())[
            "frames"
        ]
        return frames


class PhantomBench:
    """Scores the frames of one phantom."""

    def __init__(self, phantom: Path, plan: Plan) -> None:
        self._plan, rig = plan, read_rig(phantom / "rig.yml")
        self._trackers = {name: make_tracker(rig, plan.bones[name]) for name in _BONES}

    def score(self, frames: list[dict[str, Any]], sequence: Path) -> Iterator[Turn]:
        """The turns of the tibia."""
        truth = _read_truth(sequence)
        for frame in frames:
            tibia = frame["bodies"].get("tibia")
            if tibia is None:
                continue
            true, tre_mm = truth[frame["index"]], float("nan")
            if tibia["camera_from_model"] is not None:
                pose = RigidTransform("left", "tibia", tibia["camera_from_model"])
                bone = self._plan.bones["tibia"]
                tre_mm = compute_mean_tre_mm(pose, true["tibia"], bone, np.empty((0, 3)))
            bound_mm = tibia["predicted_tre_mm"]
            yield Turn(
                frame["index"], tibia["status"], tuple(tibia["reasons"]), tre_mm,
                float("nan") if bound_mm is None else bound_mm,
                self._bound_at_truth_mm(sequence, frame["index"], true),
            )  # fmt: skip

    def _bound_at_truth_mm(
        self, sequence: Path, index: int, true: Mapping[str, RigidTransform]
    ) -> float:
        """Of the tibia at rest next to its true pose, infinite when it does not rest there."""
        tracker, mesh = self._trackers["tibia"], self._trackers["femur"].model.rendered_mesh
        assert isinstance(tracker, BimccTracker)
        hidden = OccludedTracker(tracker, mesh, true["femur"])
        left, right = (
            cv2.imread(str(sequence / f"{side}_{index:04d}.jpg"))[..., ::-1].copy()
            for side in ("left", "right")
        )
        frame = hidden.begin(Pictures(left, right), true["tibia"])
        fit = hidden.near._follower.follow(frame, frame.start, skips_samples=True)
        targets_mm = self._plan.targets.get("tibia", np.empty((0, 3)))
        judged = hidden.judge.judge(frame, fit, Goal(targets_mm, 2.0))
        bound_mm = judged.verdict.predicted_tre_mm
        return float("inf") if bound_mm is None else bound_mm

    def score_limbs(self, frames: list[dict[str, Any]], sequence: Path, errors: Errors) -> None:
        """What the frames say of the limb."""
        truth = _read_truth(sequence)
        for frame in frames:
            if "limb" in frame:
                meshes = tuple(self._plan.bones[name].mesh for name in _BONES)
                errors.add(
                    frame["limb"], measure_true_limb(self._plan, truth[frame["index"]], meshes)
                )


def measure_true_limb(
    plan: Plan, true: Mapping[str, RigidTransform], meshes: tuple[Any, ...]
) -> dict[str, Any]:
    """As JSON, of true poses."""
    exact = (
        PoseEstimate(true[name], np.zeros((6, 6)), 0, 1.0, 0.0, 1.0, 0, True) for name in _BONES
    )
    surfaces = BoneSurface(meshes[0]), BoneSurface(meshes[1])
    return limb_to_json(LimbMeter(plan).measure(*exact, surfaces))


def _read_truth(sequence: Path) -> dict[int, dict[str, RigidTransform]]:
    poses = {name: read_true_poses(sequence, name) for name in _BONES}
    return {number: {name: poses[name][number] for name in _BONES} for number in poses["femur"]}


def _row(name: str, order: str, turns: list[Turn], frames: list[dict[str, Any]]) -> str:
    ok = [one for one in turns if one.status == "OK"]
    asked = [one for one in turns if not one.is_exempt]
    head = f"| {name} | {order} | {len(turns)} | {len(turns) - len(asked)} | {len(ok)} | "
    head += f"{sum(one.status == 'OK' for one in asked)} of {len(asked)} |"
    if not ok:
        return f"{head} - | - | - | - | - |"
    error, bound = np.array([(one.tre_mm, one.bound_mm) for one in ok]).T
    took_ms = [
        frame["bodies"]["tibia"]["timing_ms"]["total"] for frame in frames if frame["bodies"]
    ]
    return (
        f"{head} {np.median(error):.3f} mm | {error.max():.3f} mm | {np.median(bound):.2f} mm | "
        f"{100.0 * np.mean(error <= bound):.0f} % | {np.median(took_ms):.0f} |"
    )


def _print_turns(turns: list[Turn]) -> None:
    for one in turns:
        mark = " exempt" if one.is_exempt else ""
        print(
            f"    {one.index:3d} {one.status:8s} {one.tre_mm:.3f} mm, bound {one.bound_mm:.2f}, at "
            f"the true pose {one.exempt_mm:.2f}{mark}  {', '.join(one.reasons)}"
        )


def _run_knees(options: argparse.Namespace, errors: dict[str, Errors]) -> None:
    """Simulated sessions."""
    print("| seed | turns | OK | worst OK | bound holds | first search, s |")
    print("|---|---|---|---|---|---|")
    for seed in range(options.first, options.first + options.knees):
        print(_run_knee(seed, errors.setdefault("simulated knees", Errors())), flush=True)


def _run_knee(seed: int, errors: Errors) -> str:
    content = {
        "camera": {
            "simulated": {
                "seed": seed, "side": "left" if seed % 2 else "right", "motion": "patient"
            }
        }
    }  # fmt: skip
    words = _parser().parse_args(["run", "--headless", "--also", "tibia"])
    quiet = Diagnostics(is_quiet=True)
    with ExitStack() as undo:
        session = prepare_session(parse(content, "bench"), words, quiet)
        undo.callback(session.opened.devices.close)
        log = FrameLog(_N_FRAMES, quiet)
        controller = make_controller(session, is_inline=True, on_frame=[log], undo=undo)
        undo.callback(controller.close)
        run_session(controller, ScriptedOperator((ScriptStep(do="register"),)), log, quiet)
    plan, simulation = session.specification.plan, session.opened.simulation
    meshes = tuple(plan.bones[name].mesh for name in _BONES)
    found, first_s = [], float("nan")
    for result in log.results:
        true = {
            name: simulation.oracle.left_from_body(name, result.frame.captured_ns)
            for name in _BONES
        }
        if result.limb is not None:
            errors.add(limb_to_json(result.limb), measure_true_limb(plan, true, meshes))
        tracked = result.others.get("tibia")
        if tracked is None:
            continue
        first_s = tracked.timings.total_ms / 1e3 if np.isnan(first_s) else first_s
        verdict = tracked.verdict
        tre_mm = float("nan")
        if tracked.left_from_bone is not None:
            tre_mm = compute_mean_tre_mm(
                tracked.left_from_bone, true["tibia"], plan.bones["tibia"], np.empty((0, 3))
            )
        found.append((verdict.status.value, tre_mm, verdict.predicted_tre_mm))
    ok = [(tre_mm, bound_mm) for status, tre_mm, bound_mm in found if status == "OK"]
    if not ok:
        return f"| {seed} | {len(found)} | 0 | - | - | {first_s:.1f} |"
    error, bound = np.array(ok).T
    return (
        f"| {seed} | {len(found)} | {len(ok)} | {error.max():.3f} mm | "
        f"{100.0 * np.mean(error <= bound):.0f} % | {first_s:.1f} |"
    )


if __name__ == "__main__":
    raise SystemExit(main())
