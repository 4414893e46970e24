"""First registration without a pose, printed as the table of docs/how/registration.md.

usage: python -m tests.bench.first_registration [FOLDER] [--seeds N] [--first SEED]
                                                [--only WORDS] [--filled] [--verbose]

Every frame of the recorded sequences in FOLDER (default: NAVAPP_DATA) and one frame of each of N
simulated knees is registered on its own, with nothing but the approach cone, in a box and in the
whole view, with and without the aspects. The truth draws the box (that of the visible bone, each
side off by up to 15 % of its size, as an operator would draw it) and scores the answer. The last
rows start from the true pose: what the judge then refuses, no search can make good. With `--filled`
the gaps of free measurements are filled by weighted least squares, and filled points take part in
the search (docs/how/stereo.md).
"""

import argparse
import json
import os
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from unittest import mock

import numpy as np

from navapp.evaluation import compute_mean_tre_mm
from navapp.geometry import RigidTransform, read_rig
from navapp.geometry.directions import ViewCone
from navapp.geometry.ply import read_ply
from navapp.geometry.rig import StereoRig
from navapp.preop import build_aspects
from navapp.stereo import match_surface
from navapp.tracking import Goal, surface_meter
from navapp.tracking.bimcc_tracker import BimccTracker
from navapp.tracking.search import whole_view
from navapp.values import BoneModel, DisparityMap, Origin, Prior, Status
from sim_devices.scenario import Scenario
from sim_devices.sensor import SensorModel
from sim_devices.world import World
from tests.knees import femur_of
from tests.recorded import read_frames, read_picture

_SEQUENCES = ("registration", "patient", "instrument")
_OFF_SHARE = 0.15
_RIGHT_MM = 1.0
_GOAL = Goal(np.empty((0, 3)), 2.0)


@dataclass(frozen=True)
class Frame:
    """A pair with its truth."""

    group: str
    left: np.ndarray
    right: np.ndarray
    visible: np.ndarray
    true: RigidTransform


@dataclass(frozen=True)
class Case:
    """Frames of one bone under one rig, and where its cameras may stand."""

    rig: StereoRig
    bone: BoneModel
    axis: np.ndarray
    half_angle_deg: float
    frames: list[Frame]


@dataclass(frozen=True)
class Answer:
    """What a first registration came to."""

    error_mm: float
    is_ok: bool
    seconds: float


def main() -> int:
    """Register every frame in every way and print a row for each group and way."""
    parser = argparse.ArgumentParser(description=__doc__)
    folder = os.environ.get("NAVAPP_DATA", "../shared/data")
    parser.add_argument("folder", nargs="?", default=folder)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first", type=int, default=401)
    parser.add_argument("--only", default="", help="ways and cases whose names hold these words")
    parser.add_argument("--filled", action="store_true", help="fill the gaps of free measurements")
    parser.add_argument("--verbose", action="store_true")
    options = parser.parse_args()
    with fill_gaps() if options.filled else nullcontext():
        found = register_all(options)
    print("| frames | way | n | right and OK | right | silent | TRE median | s median | s worst |")
    print("|---|---|---|---|---|---|---|---|---|")
    for (group, way), answers in sorted(found.items()):
        print(row(group, way, answers))
    for way in sorted({way for _, way in found}):
        print(row("all", way, [a for key, some in found.items() if key[1] == way for a in some]))
    return 0


@contextmanager
def fill_gaps() -> Iterator[None]:
    """Free measurements are filled meanwhile, and filled points are points of the cloud."""
    reproject = DisparityMap.reproject
    filled = partial(match_surface, fills=True)
    all_kinds = partial(reproject, origins=tuple(Origin)[1:])
    with (
        mock.patch.object(whole_view, "match_surface", lambda *a, fills: filled(*a)),
        mock.patch.object(surface_meter, "match_surface", lambda *a, fills: filled(*a)),
        mock.patch.object(DisparityMap, "reproject", lambda *a: all_kinds(*a)),
    ):
        yield


def register_all(options: argparse.Namespace) -> dict[tuple[str, str], list[Answer]]:
    """The answers to every frame in every way."""
    found: dict[tuple[str, str], list[Answer]] = {}
    for case in cases(Path(options.folder), options.first, options.seeds):
        build_started = time.perf_counter()
        aspects = build_aspects(case.bone, case.axis, case.half_angle_deg)
        build_s = time.perf_counter() - build_started
        trackers = {
            True: BimccTracker(case.rig, case.bone, aspects=aspects),
            False: BimccTracker(case.rig, case.bone),
        }
        for tracker in trackers.values():
            _ = tracker.model.arrays
        for number, frame in enumerate(case.frames):
            for way, prior in ways(case, frame, number):
                if options.only and not all(
                    word in f"{frame.group} {way}" for word in options.only.split()
                ):
                    continue
                tracker = trackers["+" in way]
                if not found:  # compiles
                    tracker.register(frame, prior, _GOAL)
                answer = registered(tracker, frame, prior)
                found.setdefault((frame.group, way), []).append(answer)
                if options.verbose:
                    print(frame.group, number, way, answer, f"built in {build_s:.1f} s", flush=True)
    return found


def ways(case: Case, frame: Frame, number: int) -> Iterator[tuple[str, Prior]]:
    """Name and prior of each way to start."""
    box = drawn_box(frame.visible, number)
    for place, box_or_none in (("box", box), ("view", None)):
        prior = Prior({}, {"femur": ViewCone(case.axis, case.half_angle_deg)}, box_or_none)
        yield f"{place} + aspects", prior
        yield f"{place}", prior
    yield "from the true pose", Prior({"femur": frame.true})


def drawn_box(visible: np.ndarray, seed: int) -> tuple[int, int, int, int]:
    """The box of a mask, each side off by up to 15 % of its size."""
    rows, columns = np.nonzero(visible)
    low = np.array([columns.min(), rows.min()], dtype=float)
    high = np.array([columns.max() + 1, rows.max() + 1], dtype=float)
    off = np.random.default_rng([seed, 77]).uniform(-_OFF_SHARE, _OFF_SHARE, (2, 2)) * (high - low)
    height, width = visible.shape
    x, y = np.clip(low + off[0], 0, (width, height)).astype(int)
    right, bottom = np.clip(high + off[1], 0, (width, height)).astype(int)
    return int(x), int(y), int(right - x), int(bottom - y)


def registered(tracker: BimccTracker, frame: Frame, prior: Prior) -> Answer:
    """The best candidate against the truth."""
    started = time.perf_counter()
    tracked = tracker.register(frame, prior, _GOAL)
    seconds = time.perf_counter() - started
    pose = tracked[0].left_from_bone if tracked else None
    if pose is None:
        return Answer(np.inf, False, seconds)
    error_mm = compute_mean_tre_mm(pose, frame.true, tracker.model.bone, np.empty((0, 3)))
    return Answer(error_mm, tracked[0].verdict.status is Status.OK, seconds)


def row(group: str, way: str, answers: list[Answer]) -> str:
    """Of the table."""
    errors = np.array([answer.error_mm for answer in answers])
    is_ok = np.array([answer.is_ok for answer in answers])
    seconds = np.array([answer.seconds for answer in answers])
    is_right = errors < _RIGHT_MM
    median = f"{np.median(errors[is_right]):.3f} mm" if is_right.any() else "-"
    return (
        f"| {group} | {way} | {len(answers)} | {100 * np.mean(is_right & is_ok):.0f} % | "
        f"{100 * np.mean(is_right):.0f} % | {int((is_ok & ~is_right).sum())} | {median} | "
        f"{np.median(seconds):.2f} | {seconds.max():.2f} |"
    )


def cases(folder: Path, first_seed: int, n_seeds: int) -> Iterator[Case]:
    """Recorded sequences, then simulated knees."""
    for phantom in sorted(folder.glob("phantom_*")):
        bone = BoneModel("femur", read_ply(phantom / "femur.ply")[0])
        for name in _SEQUENCES:
            yield _recorded(phantom / name, bone, read_rig(phantom / "rig.yml"))
    for seed in range(first_seed, first_seed + n_seeds):
        yield simulated(seed)


def _recorded(folder: Path, bone: BoneModel, rig: StereoRig) -> Case:
    group, frames = f"{folder.parent.name}/{folder.name}", []
    for one in read_frames(folder):
        is_bone = read_picture(folder, "bone_mask_left", one.number)[..., 0] > 0
        frames.append(Frame(group, one.left, one.right, is_bone, one.truth))
    cone = json.loads((folder / "prior.json").read_text(encoding="utf-8"))["approach_cone"]
    return Case(rig, bone, np.array(cone["axis"]), float(cone["half_angle_deg"]), frames)


def simulated(seed: int) -> Case:
    """One frame of a simulated knee; every fourth has a hand and an instrument in the view."""
    rng = np.random.default_rng(seed)
    scenario = Scenario(
        seed=seed,
        side=("right", "left")[rng.integers(2)],
        sex=("female", "male")[rng.integers(2)],
        motion="patient",
        instrument="sweep" if seed % 4 == 0 else "none",
        contrast=float(rng.uniform(0.03, 0.08)),
        blood=float(rng.uniform(0.0, 0.8)),
    )
    world, sensor = World(scenario), SensorModel(seed=seed)
    time_ns = int(rng.uniform(0.0, 6e9))
    left, right = (sensor.picture(world.render(eye, time_ns), eye, 0) for eye in ("left", "right"))
    seen = world.depth("left", time_ns)
    bone = femur_of(world)
    group = "simulated, hand" if scenario.instrument == "sweep" else "simulated"
    visible = seen.body == seen.bodies.index("femur")
    frame = Frame(group, left, right, visible, world.left_from_body("femur", time_ns))
    return Case(world.rig, bone, world.approach_axis, world.approach_half_angle_deg, [frame])


if __name__ == "__main__":
    sys.exit(main())
