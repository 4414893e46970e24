"""Tip and axis of a hand-held tool in a bone's coordinates, beside OpenCV's markers alone.

usage: python -m tests.bench.tool_accuracy [--seeds N] [--first SEED] [--frames N]

For every seed a drill is calibrated on the simulated rig as `navapp calibrate pivot --tool drill`
does, by its own plate as a printer left it. Then a hand, at up to 100 mm/s, holds its tip to 12
places on a simulated femur in 5 tilts, its plate uncovered and half covered by a thumb; the leg
breathes, and the femur is tracked. The tip's error is that in the femur's coordinates, with the
calibration's in it. Peers get the same pictures, and calibrate themselves on the same: corners of
markers in the left picture (solvePnP), and corners triangulated from both.
"""

import argparse
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import date

import cv2
import numpy as np
from numpy.typing import NDArray

from calibration.pivot import solve_pivot
from drivers.frames import StereoFrame
from navapp.config import Configuration
from navapp.control.tool_calibration.calibrating import ToolCalibrating, ToolSettings
from navapp.devices.simulated_tool import SIMULATED_PLATES, make_shape, make_touching
from navapp.devices.tool_calibration import open_tool_calibration
from navapp.errors import ResultError
from navapp.geometry.rectification import luma
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import RigidTransform, nearest_rotation, skew
from navapp.tools.marker_finder import MarkerFinder
from navapp.tools.plate import Plate
from navapp.tools.tool import SeenTool, Tool
from navapp.tools.tool_on_bone import place_on_bone
from navapp.tools.tool_tracker import ToolTracker
from navapp.tracking import TrackState, make_tracker
from navapp.values import Status
from sim_devices.held_tool import Cover
from sim_devices.scenario import Scenario
from sim_devices.sensor import SensorModel
from sim_devices.world import World
from tests.bench.provoked import GOAL
from tests.knees import femur_of, stepped_camera

# Not the seeds of any test or default, nor of the other benches.
FIRST_SEED = 7301
PLATE = SIMULATED_PLATES["drill"]
_CHI2_3_95 = 7.815
Greys = tuple[NDArray[np.uint8], NDArray[np.uint8]]
Peer = Callable[[StereoRig, Greys], RigidTransform | None]


@dataclass
class Errors:
    """What one way has shown under one cover."""

    tip_mm: list[float] = field(default_factory=list)
    axis_deg: list[float] = field(default_factory=list)
    is_covered: list[bool] = field(default_factory=list)  # by its bound
    n_frames: int = 0


def main() -> int:
    """Print a row a way and cover."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--first", type=int, default=FIRST_SEED)
    parser.add_argument("--frames", type=int, default=400)
    options = parser.parse_args()
    found: dict[tuple[str, str], Errors] = {}
    for seed in range(options.first, options.first + options.seeds):
        tool, tips = calibrate(seed)
        for name in ("uncovered", "half covered"):
            cover = None if name == "uncovered" else Cover(0.5 * np.pi * (seed % 4) + 0.3, 0.0)
            _measure(seed, name, cover, tool, tips, options.frames, found)
        print(f"seed {seed} done", file=sys.stderr, flush=True)
    print("| plate | way | frames | valid | tip median | tip 95 % | axis median | covered |")
    print("|---|---|---|---|---|---|---|---|")
    for (name, way), errors in sorted(found.items()):
        print(_row(name, way, errors))
    return 0


def calibrate(seed: int) -> tuple[Tool, dict[str, NDArray[np.float64] | None]]:
    """Our tool, and the tips that the peers find in the same pictures."""
    section = {"camera": {"simulated": {"seed": seed}}}
    configuration = Configuration.model_validate(section)
    opened, hand = open_tool_calibration(configuration, "drill", PLATE, is_headless=True)
    calibrating = ToolCalibrating(
        opened.camera, opened.clock, opened.rig, PLATE, ToolSettings(has_axis=True), hand
    )
    poses: dict[str, list[NDArray[np.float64]]] = {name: [] for name in PEERS}
    while not (snapshot := calibrating.step()).is_over:
        if snapshot.n_kept > 0 or snapshot.pictures is None:
            continue
        greys = luma(snapshot.pictures[0]), luma(snapshot.pictures[1])
        for name, peer in PEERS.items():
            pose = peer(opened.rig, greys)
            if pose is not None:
                poses[name].append(pose.matrix)
    opened.camera.close()
    tool, _, _ = calibrating.collected.solve(date.today(), opened.rig.rig_id)
    tips: dict[str, NDArray[np.float64] | None] = {}
    for name, found in poses.items():
        try:
            tips[name] = solve_pivot(found).robust.tip_mm
        except ResultError:
            tips[name] = None
    return tool, tips


def _measure(
    seed: int,
    cover_name: str,
    cover: Cover | None,
    tool: Tool,
    tips: dict[str, NDArray[np.float64] | None],
    n_frames: int,
    found: dict[tuple[str, str], Errors],
) -> None:
    world = World(Scenario(seed=seed, side="left" if seed % 2 else "right"))
    shape = make_shape("drill", PLATE, seed)
    scene, hand = make_touching("drill", PLATE, world, seed, 12, cover)
    camera = stepped_camera(scene, SensorModel(seed=seed), 15.0)
    bone = femur_of(world)
    tracker, tools = make_tracker(world.rig, bone), ToolTracker(tool, world.rig)
    middle_mm = bone.mesh.vertices_mm.mean(axis=0)
    start = world.left_from_body("femur", 0)
    state = TrackState.at_rest(start, 0)
    for _ in range(n_frames):
        frame: StereoFrame = camera.read(1.0)
        time_ns = camera.world_time_ns(frame.captured_ns)
        tracked, state = tracker.track(frame, state, GOAL)
        if tracked.estimate is None or tracked.verdict.status is not Status.OK:
            continue
        bone_from_left = world.left_from_body("femur", time_ns).inverse()
        true = hand.left_from_tool(time_ns)
        true_tip = bone_from_left.apply(true.apply(shape.tip_mm))
        true_axis = bone_from_left.rotate(true.rotate(shape.axis))
        greys = luma(frame.left), luma(frame.right)
        ours = found.setdefault((cover_name, "navapp"), Errors())
        ours.n_frames += 1
        seen = tools.track(greys, frame.captured_ns)
        if isinstance(seen, SeenTool):
            placed = place_on_bone(seen, "femur", tracked.estimate, middle_mm)
            off = placed.tip_mm - true_tip
            ours.tip_mm.append(float(np.linalg.norm(off)))
            squared = float(off @ np.linalg.solve(placed.covariance_mm2, off))
            ours.is_covered.append(squared <= _CHI2_3_95)
            assert placed.axis is not None
            ours.axis_deg.append(_angle_deg(placed.axis, true_axis))
        estimated = tracked.estimate.camera_from_bone.inverse()
        for name, peer in PEERS.items():
            tip = tips[name]
            theirs = found.setdefault((cover_name, name), Errors())
            theirs.n_frames += 1
            pose = None if tip is None else peer(world.rig, greys)
            if pose is not None and tip is not None:
                off = estimated.apply(pose.apply(tip)) - true_tip
                theirs.tip_mm.append(float(np.linalg.norm(off)))


def _row(name: str, way: str, errors: Errors) -> str:
    tips = errors.tip_mm or [np.nan]
    axis = f"{np.median(errors.axis_deg):.3f} deg" if errors.axis_deg else "-"
    covered = f"{100.0 * np.mean(errors.is_covered):.1f} %" if errors.is_covered else "-"
    return (
        f"| {name} | {way} | {errors.n_frames} | "
        f"{100.0 * len(errors.tip_mm) / max(errors.n_frames, 1):.1f} % | "
        f"{np.median(tips):.3f} mm | {np.percentile(tips, 95):.3f} mm | {axis} | {covered} |"
    )


def _angle_deg(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    return float(np.degrees(np.arctan2(np.linalg.norm(skew(a) @ b), a @ b)))


def _solve_pnp(rig: StereoRig, greys: Greys) -> RigidTransform | None:
    """OpenCV's markers in the left picture, and its solvePnP."""
    seen = MarkerFinder(PLATE).find(greys[0])
    if len(seen.markers) == 0:
        return None
    points = PLATE.corners_mm[seen.markers].reshape(-1, 3)
    camera = rig.left
    is_found, turn, shift = cv2.solvePnP(
        points, seen.corners_px.reshape(-1, 2), np.array(camera.matrix),
        np.array(camera.distortion), flags=cv2.SOLVEPNP_IPPE,
    )  # fmt: skip
    if not is_found:
        return None
    rotation = nearest_rotation(cv2.Rodrigues(turn)[0])
    return RigidTransform.from_parts("left", "plate", rotation, np.ravel(shift))


def _triangulate(rig: StereoRig, greys: Greys) -> RigidTransform | None:
    """OpenCV's markers in both pictures, their corners triangulated, and a rigid fit."""
    seen = [MarkerFinder(PLATE).find(grey) for grey in greys]
    common = np.intersect1d(seen[0].markers, seen[1].markers)
    if len(common) == 0:
        return None
    pixels = [one.corners_px[np.isin(one.markers, common)].reshape(-1, 2) for one in seen]
    rays = [
        camera.rays(px)[:, :2].T for camera, px in zip((rig.left, rig.right), pixels, strict=True)
    ]
    homogeneous = cv2.triangulatePoints(
        np.eye(3, 4), rig.right_from_left.matrix[:3], rays[0], rays[1]
    )
    target = (homogeneous[:3] / homogeneous[3]).T
    source = _points(PLATE, common)
    a, b = source.mean(axis=0), target.mean(axis=0)
    turn = nearest_rotation((target - b).T @ (source - a))
    return RigidTransform.from_parts("left", "plate", turn, b - turn @ a)


def _points(plate: Plate, markers: NDArray[np.intp]) -> NDArray[np.float64]:
    return plate.corners_mm[markers].reshape(-1, 3)


PEERS: dict[str, Peer] = {
    "OpenCV solvePnP": _solve_pnp,
    "OpenCV corners, both eyes": _triangulate,
}


if __name__ == "__main__":
    sys.exit(main())
