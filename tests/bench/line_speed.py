"""Time of one followed frame, from the two pictures to the drawn overlay, beside a chain of peers.

usage: python -m tests.bench.line_speed [--seed N] [--frames N] [--runs N] [--threads 1|2]

A simulated knee that breathes, 1280x720, its box about 420 px, rendered beforehand. The peers are
what one would take from well-known libraries: rectification of the bone's box, OpenCV's SGBM
(three-way, block 5, 96 disparities from where the bone begins) for both views with the contributed
WLS filter where the running OpenCV has it (`make bench-peers`), and Open3D's point-to-plane ICP
with a Tukey loss and its own limits (30 steps) on 3,000 points, from the pose before. Both draw the
same layer of the bone; ours also hides it behind what stands in front, and judges. They take turns
frame by frame, after a pass that warms up; the best run of each counts. Besides the wall time there
is that of the processors: others disturb it less.
"""

import argparse
import multiprocessing
import os
import sys
import time
from collections.abc import Callable
from dataclasses import replace

import cv2
import numpy as np

from drivers.frames import StereoFrame
from navapp.evaluation import compute_mean_tre_mm
from navapp.geometry.box import Box
from navapp.geometry.rectification import RectifiedPair, Rectifier, luma
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.overlay import LeftView, Scene
from navapp.overlay.labels import LabelBoard
from navapp.overlay.painting import paint_layers
from navapp.registration import RegistrationModel
from navapp.tracking import Goal, TrackState, make_tracker
from navapp.values import Foreground, Plan, StageSpec, Status
from sim_devices.rigs import make_default_rig
from sim_devices.scenario import Scenario
from sim_devices.world import World
from tests.bench.occlusion_speed import use_threads
from tests.bench.registration_peers import open3d_plane
from tests.bench.stereo_speed import peer_chain
from tests.knees import SimulatedKnee
from tests.views import project_box

_GOAL = Goal(np.empty((0, 3)), 2.0)
_DISPARITIES, _POINTS = 96, 3000
_RADIUS_MM, _LOSS_MM, _STOP, _ICP_STEPS = 5.0, 2.0, 1e-6, 30
_SPARE_PX = 16
_ZOOM = 1.6

# One frame's way: a frame's number to its pose and the times of its parts in ms.
Way = Callable[[int], tuple[RigidTransform, dict[str, float]]]


def _long_lenses() -> StereoRig:
    """The simulated rig, with lenses that show the bone in a box of about 420 px."""
    rig, scale = (
        make_default_rig(),
        np.array([[_ZOOM, 1.0, 1.0], [1.0, _ZOOM, 1.0], [1.0, 1.0, 1.0]]),
    )
    left, right = (replace(one, matrix=one.matrix * scale) for one in (rig.left, rig.right))
    return replace(rig, left=left, right=right)


class Recording:
    """Frames of one knee with their truth."""

    def __init__(self, seed: int, n_frames: int) -> None:
        knee = SimulatedKnee(World(Scenario(seed=seed, motion="breathing"), _long_lenses()))
        self.frames = knee.frames(n_frames)
        self.poses = [knee.truth(frame) for frame in self.frames]
        self.rig, self.bone = knee.rig, knee.bone
        self._plan, self._viewpoint = Plan({"femur": knee.bone}), LeftView(knee.rig)

    def overlay(
        self, number: int, pose: RigidTransform, foreground: Foreground | None = None
    ) -> None:
        """Draw the bone over a copy of the left picture."""
        scene = Scene(self._plan, _STAGE, pose, self._viewpoint, False, foreground, ("bone",))
        paint_layers(self.frames[number].left.copy, scene, LabelBoard(0.45))


_STAGE = StageSpec(1, "opening", "femur", 2.0, 2.0, (), ("bone",), ())


def ours(recording: Recording) -> Way:
    """`Tracker.track`, then the overlay."""
    tracker = make_tracker(recording.rig, recording.bone)
    state = TrackState.at_rest(recording.poses[0], recording.frames[0].captured_ns)

    def follow(number: int) -> tuple[RigidTransform, dict[str, float]]:
        nonlocal state
        frame = recording.frames[number]
        if number == 0:
            state = TrackState.at_rest(recording.poses[0], frame.captured_ns)
        started = time.perf_counter()
        tracked, state = tracker.track(frame, state, _GOAL)
        followed = time.perf_counter()
        assert tracked.verdict.status is Status.OK, tracked.verdict
        assert tracked.left_from_bone is not None
        recording.overlay(number, tracked.left_from_bone, tracked.foreground)
        return tracked.left_from_bone, _parts(follow=started, overlay=followed)

    return follow


def peers(recording: Recording) -> Way:
    """Rectified box, SGBM both ways with WLS, ICP from the pose before, then the overlay."""
    rectifier, model = Rectifier(recording.rig), RegistrationModel(recording.bone)
    geometry = rectifier.geometry
    icp = open3d_plane(_RADIUS_MM, _LOSS_MM, _STOP, _ICP_STEPS)
    last = recording.poses[0]

    def follow(number: int) -> tuple[RigidTransform, dict[str, float]]:
        nonlocal last
        last = recording.poses[0] if number == 0 else last
        frame = recording.frames[number]
        started = time.perf_counter()
        start = geometry.rectified_from_left @ last
        box = project_box(model.seen_mesh, start, geometry)
        assert box is not None
        nearest = geometry.disparity_px(float(start.apply(model.hull_mm)[:, 2].min())) + 8.0
        lowest = int(nearest) - _DISPARITIES
        pair = _remapped(rectifier, frame, box.grow(_SPARE_PX), (lowest, int(nearest)))
        rectified = time.perf_counter()
        found = np.asarray(peer_chain(pair, lowest, _DISPARITIES)(), dtype=np.float32) / 16.0
        matched = time.perf_counter()
        points_mm = _cloud_mm(found[:, -pair.box.width :] + lowest, lowest, pair)
        pose = icp(points_mm, model, start)
        last = geometry.rectified_from_left.inverse() @ pose
        fitted = time.perf_counter()
        recording.overlay(number, last)
        return last, _parts(rectify=started, stereo=rectified, estimate=matched, overlay=fitted)

    return follow


def _remapped(
    rectifier: Rectifier, frame: StereoFrame, box: Box, band_px: tuple[int, int]
) -> RectifiedPair:
    """OpenCV's linear remap of the box, and of what its disparities reach."""
    geometry = rectifier.geometry
    left_x, left_y, right_x, right_y = rectifier.maps
    box = box.clip(geometry.width, geometry.height)
    rows = slice(box.y, box.y + box.height)
    grown = slice(max(box.x - band_px[1] - _DISPARITIES, 0), box.x + box.width)
    pictures = []
    for picture, columns, lines in (
        (frame.left, left_x, left_y),
        (frame.right, right_x, right_y),
    ):
        whole = np.zeros(columns.shape, dtype=np.uint8)
        whole[rows, grown] = cv2.remap(
            luma(picture), columns[rows, grown], lines[rows, grown], cv2.INTER_LINEAR
        )
        pictures.append(whole)
    return RectifiedPair(*pictures, geometry, box)


def _cloud_mm(disparity_px: FloatArray, lowest: int, pair: RectifiedPair) -> FloatArray:
    """About so many points of what was matched."""
    box, geometry = pair.box, pair.geometry
    rows, columns = np.nonzero(disparity_px > lowest)
    every = max(1, len(rows) // _POINTS)
    rows, columns = rows[::every], columns[::every]
    z = geometry.focal_px * geometry.baseline_mm / disparity_px[rows, columns].astype(float)
    x = (columns + box.x - geometry.centre_x_px) / geometry.focal_px
    y = (rows + box.y - geometry.centre_y_px) / geometry.focal_px
    return np.column_stack([x * z, y * z, z])


def _parts(**starts: float) -> dict[str, float]:
    """Time from each part's start to the next one's, and of all, in ms."""
    moments = [*starts.values(), time.perf_counter()]
    parts = {name: 1e3 * (moments[k + 1] - moments[k]) for k, name in enumerate(starts)}
    return {**parts, "all": 1e3 * (moments[-1] - moments[0])}


def main() -> None:
    """Print one line for each chain."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=21)
    parser.add_argument("--frames", type=int, default=40)
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--threads", type=int, choices=(1, 2), nargs="+", default=[1, 2])
    options = parser.parse_args()
    print("| threads | chain | TRE mm | ms p50 | p95 | CPU ms | frames/s | of peers | parts, ms |")
    print("|---|---|---|---|---|---|---|---|---|", flush=True)
    cores, failed = sorted(os.sched_getaffinity(0)), 0
    for n_threads in options.threads:
        # Open3D has threads that only the cores of its process limit, from its start on.
        os.sched_setaffinity(0, cores[:n_threads])
        given = (n_threads, options.seed, options.frames, options.runs)
        child = multiprocessing.get_context("spawn").Process(target=compare, args=given)
        child.start()
        child.join()
        failed = failed or child.exitcode
    sys.exit(failed)


def compare(n_threads: int, seed: int, n_frames: int, n_runs: int) -> None:
    """Print a line for each chain, in a process that has as many cores."""
    use_threads(n_threads)
    recording = Recording(seed, n_frames)
    ways = {"navapp": ours(recording), "peers": peers(recording)}
    best = best_runs(ways, recording, n_runs)
    peers_ms = sum(best["peers"][0]["all"])
    for name, (times, errors_mm) in best.items():
        whole, busy = times.pop("all"), times.pop("CPU")
        parts = ", ".join(f"{part} {np.median(ms):.1f}" for part, ms in times.items())
        print(
            f"| {n_threads} | {name} | {np.median(errors_mm):.3f} | {np.median(whole):.1f} | "
            f"{np.percentile(whole, 95):.1f} | {np.median(busy):.1f} | "
            f"{1e3 / np.mean(whole):.1f} | {peers_ms / sum(whole):.2f} | {parts} |",
            flush=True,
        )


Run = tuple[dict[str, list[float]], list[float]]


def best_runs(ways: dict[str, Way], recording: Recording, n_runs: int) -> dict[str, Run]:
    """The fastest of several passes over all frames, of chains that take turns frame by frame."""
    best: dict[str, Run] = {}
    for number in range(n_runs + 1):
        runs: dict[str, Run] = {name: ({}, []) for name in ways}
        for frame in range(len(recording.frames)):
            for name, way in ways.items():
                started_ns = time.process_time_ns()
                pose, parts = way(frame)
                parts["CPU"] = (time.process_time_ns() - started_ns) / 1e6
                for part, ms in parts.items():
                    runs[name][0].setdefault(part, []).append(ms)
                true = recording.poses[frame]
                runs[name][1].append(
                    compute_mean_tre_mm(pose, true, recording.bone, np.empty((0, 3)))
                )
        for name, run in runs.items():
            # The first pass compiles.
            if number and (name not in best or sum(run[0]["all"]) < sum(best[name][0]["all"])):
                best[name] = run
    return best


if __name__ == "__main__":
    main()
