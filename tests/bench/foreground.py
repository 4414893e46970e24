"""What is said to stand in front of the bone, beside what does: recorded and simulated knees.

usage: python -m tests.bench.foreground [FOLDER] [--seeds N] [--first SEED] [--grid]
                                        [--pictures DIR]

FOLDER (default: NAVAPP_DATA) holds `phantom_*` with an `instrument` sequence; a sweep of hand and
instrument is simulated besides. Every frame is followed from its true pose; those that the judge
calls OK count, for others no guide is drawn. Inside the bone's silhouette at the true pose: of the
pixels of hand and instrument further than 3 px inside their edge, the share that is marked as in
front; of the bone's own seen pixels the share that is marked wrongly; how much of what is marked
is a guess. It exits with 1 when on a phantom, or on all simulated knees together, less than 0.95 of
the one or more than 0.02 of the other is marked. `--grid` tries other thresholds: they are chosen
on simulated knees of the seeds from 1, and judged on others.
"""

import argparse
import os
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from unittest.mock import patch

import cv2
import numpy as np
from numpy.typing import NDArray

from navapp.geometry.box import Box
from navapp.geometry.ply import read_ply
from navapp.geometry.rig import StereoRig
from navapp.geometry.rig_files import read_rig
from navapp.geometry.transform import RigidTransform
from navapp.tracking import Goal, TrackState, foreground, make_tracker
from navapp.tracking.foreground import IN_FRONT_MM, NEAR_PX, find_foreground
from navapp.tracking.tracker import Tracker
from navapp.values import BoneModel, Origin, Status, StereoPictures
from sim_devices.scenario import Scenario
from sim_devices.sensor import SensorModel
from tests.knees import SimulatedKnee, stepped_camera
from tests.pictures import Pictures
from tests.recorded import read_frames, read_picture

Mask = NDArray[np.bool_]
# By thresholds (px, mm): pixels of the occluder marked and in all, of the bone, guesses and all.
Counts = dict[tuple[int, float], NDArray[np.float64]]

# ms of the fill beside the fit and in turn, and of the search for what stands before the band.
FillTimes = tuple[float, float, float]

FIRST_SEED = 301
_GRID = [(near_px, mm) for near_px in (0, 1, 2, 3, 4, 5) for mm in (3.0, 4.0, 5.0, 6.0, 8.0)]
_EDGE_PX = 3
_LEAST_MARKED, _MOST_WRONG = 0.95, 0.02
_SIMULATED = "simulated"
_RATE_HZ, _N_FRAMES = 2.5, 15


@dataclass(frozen=True)
class Case:
    """One pair of pictures, and what its left one shows."""

    name: str
    pictures: StereoPictures
    truth: RigidTransform  # left camera from bone
    is_occluder: Mask  # (H, W) hand or instrument
    is_bone: Mask  # (H, W)


def main() -> int:
    """Print a line for each sequence; with a grid, for each pair of thresholds."""
    parser = argparse.ArgumentParser(description=__doc__)
    default = os.environ.get("NAVAPP_DATA", "../shared/data")
    parser.add_argument("folder", nargs="?", default=default)
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--first", type=int, default=FIRST_SEED)
    parser.add_argument("--grid", action="store_true", help="try thresholds on simulated knees")
    parser.add_argument("--pictures", default=None, help="a folder: what was marked, drawn")
    options = parser.parse_args()
    pairs = _GRID if options.grid else [(NEAR_PX, IN_FRONT_MM)]
    print(
        "| sequence | near, in front | OK | occluder marked | bone marked | of it a guess | "
        "fill, beside the fit | in turn | search before the band |"
    )
    print("|---|---|---|---|---|---|---|---|---|")
    pooled = {pair: np.zeros(6) for pair in pairs}
    pooled_ms: list[FillTimes] = []
    is_good, is_first, n_pooled = True, True, 0
    for name, rig, bone, cases in _sequences(options):
        tracker = make_tracker(rig, bone)
        counts = {pair: np.zeros(6) for pair in pairs}
        fill_ms: list[FillTimes] = []
        n_frames = 0
        for case in cases:
            if is_first:
                _judge(tracker, rig, case, {}, [], None)  # loads what is compiled
                is_first = False
            n_frames += 1
            _judge(tracker, rig, case, counts, fill_ms, options.pictures)
        if name.startswith(_SIMULATED):
            for pair, n in counts.items():
                pooled[pair] += n
            pooled_ms += fill_ms
            n_pooled += n_frames
        else:
            is_good &= _is_good(counts)
        _print_rows(name, counts, fill_ms, n_frames)
    _print_rows("all simulated", pooled, pooled_ms, n_pooled)
    return 0 if is_good and _is_good(pooled) else 1


def _is_good(counts: Counts) -> bool:
    """Whether enough of the occluder and little of the bone is marked, by any thresholds."""
    return any(n[0] >= _LEAST_MARKED * n[1] and n[2] <= _MOST_WRONG * n[3] for n in counts.values())


def _print_rows(name: str, counts: Counts, fill_ms: list[FillTimes], n_frames: int) -> None:
    if not fill_ms:
        return
    for (near_px, in_front_mm), n in counts.items():
        print(
            f"| {name} | {near_px} px, {in_front_mm:.0f} mm | "
            f"{len(fill_ms)} of {n_frames} | {n[0] / n[1]:.4f} of {n[1]:.0f} | "
            f"{n[2] / n[3]:.4f} of {n[3]:.0f} | {n[4] / max(n[5], 1.0):.3f} | "
            + " | ".join(
                f"{np.median(ms):.1f}, p95 {np.percentile(ms, 95):.1f} ms"
                for ms in np.transpose(fill_ms)
            )
            + " |",
            flush=True,
        )


def _judge(
    tracker: Tracker,
    rig: StereoRig,
    case: Case,
    counts: Counts,
    fill_ms: list[FillTimes],
    pictures: str | None,
) -> None:
    """Count one case for each pair of thresholds."""
    state = TrackState.at_rest(case.truth, case.pictures.captured_ns)
    goal = Goal(np.empty((0, 3)), 2.0)
    tracked, _ = tracker.track(case.pictures, state, goal)
    if tracked.verdict.status is not Status.OK:
        return
    assert tracked.foreground is not None
    assert tracked.left_from_bone is not None
    times = tracked.timings
    fill_ms.append((times.fill_beside_ms, times.fill_ms, times.nearer_beside_ms))
    geometry, told = tracker.meter.geometry, tracked.foreground
    surroundings = told.surroundings
    pose = tracker.rectify_pose(tracked.left_from_bone)
    view = tracker.model.render(pose, geometry, surroundings.box)
    silhouette = tracker.model.render(tracker.rectify_pose(case.truth), geometry, surroundings.box)
    occluder, bone = (
        _rectify(mask, rig, tracker, surroundings.box) for mask in (case.is_occluder, case.is_bone)
    )
    size = 2 * _EDGE_PX + 1
    inner = cv2.erode(occluder.view(np.uint8), np.ones((size, size), np.uint8)) > 0
    inner, seen = inner & silhouette.mask, bone & silhouette.mask
    is_guess = told.depth[1] != Origin.MATCHED
    for pair, n in counts.items():
        with patch.multiple(foreground, NEAR_PX=pair[0], IN_FRONT_MM=pair[1]):
            found = find_foreground(surroundings, told.measured, view, geometry).is_in_front
        asked = (found & inner, inner, found & seen, seen, found & is_guess, found)
        n += [np.count_nonzero(mask) for mask in asked]
        if pictures is not None:
            Path(pictures).mkdir(parents=True, exist_ok=True)
            picture = _draw(tracker, case, surroundings.box, found, inner, seen)
            cv2.imwrite(f"{pictures}/{case.name}.png", picture)


def _rectify(mask: Mask, rig: StereoRig, tracker: Tracker, box: Box) -> Mask:
    """A mask of the left picture (H, W) as seen in a box of the rectified one."""
    x, y = (part[box.slices] for part in tracker.meter.rectifier.maps[:2])
    return np.asarray(cv2.remap(mask.astype(np.uint8), x, y, cv2.INTER_NEAREST)) > 0


def _draw(
    tracker: Tracker, case: Case, box: Box, found: Mask, inner: Mask, seen: Mask
) -> NDArray[np.uint8]:
    """Green: marked rightly; blue: missed; red: bone that is marked; yellow: marked elsewhere."""
    pair = tracker.meter.rectifier.rectify(case.pictures.left, case.pictures.right)
    picture = pair.left[box.slices].copy()
    if picture.ndim == 2:
        picture = cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR)
    colours = (
        (found, (0, 255, 255)), (found & inner, (0, 255, 0)), (inner & ~found, (255, 0, 0)),
        (found & seen, (0, 0, 255)),
    )  # fmt: skip
    for mask, colour in colours:
        picture[mask] = (0.5 * picture[mask] + 0.5 * np.array(colour)).astype(np.uint8)
    return picture


def _sequences(
    options: argparse.Namespace,
) -> Iterator[tuple[str, StereoRig, BoneModel, Iterator[Case]]]:
    if not options.grid:
        for phantom in sorted(Path(options.folder).glob("phantom_*")):
            bone = BoneModel("femur", read_ply(phantom / "femur.ply")[0])
            yield phantom.name, read_rig(phantom / "rig.yml"), bone, _recorded(phantom)
    for seed in range(options.first, options.first + options.seeds):
        side = "left" if seed % 2 else "right"
        scenario = Scenario(seed=seed, side=side, motion="breathing", instrument="sweep")
        knee = SimulatedKnee(scenario)
        yield f"{_SIMULATED}_{seed}", knee.rig, knee.bone, _simulated(knee)


def _recorded(phantom: Path) -> Iterator[Case]:
    folder = phantom / "instrument"
    for frame in read_frames(folder):
        occluder, bone = (
            read_picture(folder, f"{kind}_mask_left", frame.number)[..., 0] > 127
            for kind in ("occluder", "bone")
        )
        pictures = Pictures(frame.left, frame.right, frame.number)
        name = f"{phantom.name}_{frame.number:02d}"
        yield Case(name, pictures, frame.truth, occluder, bone)


def _simulated(knee: SimulatedKnee) -> Iterator[Case]:
    """A sweep every 0.4 s."""
    camera = stepped_camera(
        knee.world, SensorModel(seed=knee.world.scenario.seed), rate_hz=_RATE_HZ
    )
    for number in range(_N_FRAMES):
        frame = camera.read(1.0)
        time_ns = camera.world_time_ns(frame.captured_ns)
        seen = knee.world.depth("left", time_ns)
        occluder, bone = (seen.body == seen.bodies.index(name) for name in ("hand", "femur"))
        truth = knee.world.left_from_body("femur", time_ns)
        name = f"{_SIMULATED}_{knee.world.scenario.seed}_{number:02d}"
        yield Case(name, frame, truth, occluder, bone)


if __name__ == "__main__":
    sys.exit(main())
