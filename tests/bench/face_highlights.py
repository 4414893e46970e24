"""How far highlights move the faces of cuts, from grey pictures and from coloured ones.

usage: python -m tests.bench.face_highlights [--knees N] [--first SEED]

Each knee is seen once, after the five cuts of the femur, at its true pose: what is told is the
error of matching alone. The seeds are those that the constants were chosen on.
"""

import argparse
from collections import defaultdict

import numpy as np

from navapp.geometry.rectification import luma
from navapp.resection import FaceMeter
from navapp.resection.cut_bone import SURE_MM
from navapp.resection.remaining_bone import Cut
from navapp.values import BoneModel, MeasuredFace, PoseEstimate, ResectionPlane
from sim_devices.scenario import Scenario
from sim_devices.sensor import SensorModel
from sim_devices.world import World

# By cut and kind of picture: errors in mm and deg, and bounds of both.
Rows = dict[tuple[str, str], list[tuple[float, float, float, float]]]


def error_of(face: MeasuredFace, point_mm: np.ndarray, normal: np.ndarray) -> tuple[float, float]:
    """Signed offset in mm, positive where less bone seems to be gone, and angle in deg."""
    off_mm = float((face.point_mm - point_mm) @ normal)
    return off_mm, float(np.degrees(np.arccos(min(1.0, float(face.normal @ normal)))))


def measure_knee(seed: int, rows: Rows) -> None:
    """All faces of one knee, in both kinds of pictures."""
    world, sensor = World(Scenario(seed=seed)), SensorModel(seed=seed)
    world.states.set_stage("implant")
    left, right = (sensor.picture(world.render(eye, 0), eye, 0) for eye in ("left", "right"))
    pose = PoseEstimate(
        world.left_from_body("femur", 0), np.zeros((6, 6)), 1000, 1.0, 0.1, 0.1, 3, True
    )
    meter = FaceMeter(world.rig, BoneModel("femur", world.anatomy.bones["femur"]))
    planned = {
        name: ResectionPlane("femur", cut.point_mm, cut.normal, cut.extent_mm)
        for name, cut in world.record.planned_cuts.items()
        if cut.bone == "femur"
    }
    made = world.record.made_planes
    known = {
        name: Cut(ResectionPlane("femur", *made[name], plane.extent_mm), SURE_MM)
        for name, plane in planned.items()
    }
    for name, plane in planned.items():
        others = tuple(cut for other, cut in known.items() if other != name)
        for kind, pair in (("grey", (luma(left), luma(right))), ("colour", (left, right))):
            face = meter.measure(*pair, pose, plane, others)
            if face is not None:
                rows[name, kind].append(
                    (*error_of(face, *made[name]), face.bound_mm, face.bound_deg)
                )


def main() -> None:
    """Print a row for each cut and kind of picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--knees", type=int, default=16)
    parser.add_argument("--first", type=int, default=1)
    options = parser.parse_args()
    rows: Rows = defaultdict(list)
    for seed in range(options.first, options.first + options.knees):
        measure_knee(seed, rows)
    print(
        "| face | pictures | knees | offset off: mean, worst mm | angle off: median, worst deg "
        "| bounds hold: mm, deg |"
    )
    print("|---|---|---|---|---|---|")
    for (name, kind), values in rows.items():
        off_mm, off_deg, bound_mm, bound_deg = np.array(values).T
        print(
            f"| {name} | {kind} | {len(values)} | {off_mm.mean():+.3f}, {np.abs(off_mm).max():.3f} "
            f"| {np.median(off_deg):.2f}, {off_deg.max():.2f} "
            f"| {np.mean(np.abs(off_mm) <= bound_mm):.2f}, {np.mean(off_deg <= bound_deg):.2f} |"
        )


if __name__ == "__main__":
    main()
