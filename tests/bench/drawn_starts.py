"""First registrations from what an operator draws or picks, without any file.

usage: python -m tests.bench.drawn_starts [FOLDER] [--seeds N] [--first SEED] [--verbose]

One frame of each of N simulated knees, and every frame of the recorded sequences in FOLDER
(default: NAVAPP_DATA), registered on its own from a box around what is seen of the femur and from
three picked landmarks. Sides of the box and picks are off by 6 px, landmarks in the plan by 3 mm
(one standard deviation each). The cone is the one that `navapp plan` writes. Recorded bones
have no landmarks: three vertices that are seen, far from each other, stand for them.
"""

import argparse
import os
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from navapp.preop import build_aspects
from navapp.preop.usual_approaches import usual_approaches
from navapp.tracking.bimcc_tracker import BimccTracker
from navapp.values import Pick, Prior
from tests.bench.first_registration import Answer, Case, Frame, cases, registered, row

_PICTURE_PX, _PLAN_MM = 6.0, 3.0
_N_PICKS = 3


def main() -> int:
    """Register every frame in every way and print a row for each group and way."""
    parser = argparse.ArgumentParser(description=__doc__)
    folder = os.environ.get("NAVAPP_DATA", "../shared/data")
    parser.add_argument("folder", nargs="?", default=folder)
    parser.add_argument("--seeds", type=int, default=40)
    parser.add_argument("--first", type=int, default=4401)
    parser.add_argument("--verbose", action="store_true")
    options = parser.parse_args()
    found: dict[tuple[str, str], list[Answer]] = {}
    rng = np.random.default_rng(91)
    for case in cases(Path(options.folder), options.first, options.seeds):
        cone = usual_approaches([case.bone.name])[case.bone.name]
        assert cone.axis is not None
        aspects = build_aspects(case.bone, cone.axis, cone.half_angle_deg)
        plain = BimccTracker(case.rig, case.bone)
        with_cone = BimccTracker(case.rig, case.bone, aspects=aspects)
        for tracker in (plain, with_cone):
            _ = tracker.model.arrays
        for number, frame in enumerate(case.frames):
            for way, prior in ways(case, frame, rng):
                tracker = with_cone if "cone" in way else plain
                if not found:  # compiles
                    registered(tracker, frame, prior)
                answer = registered(tracker, frame, prior)
                found.setdefault((frame.group, way), []).append(answer)
                if options.verbose:
                    print(frame.group, number, way, answer, flush=True)
    print("| frames | way | n | right and OK | right | silent | TRE median | s median | s worst |")
    print("|---|---|---|---|---|---|---|---|---|")
    for (group, way), answers in sorted(found.items()):
        print(row(group, way, answers))
    return 0


def ways(case: Case, frame: Frame, rng: np.random.Generator) -> Iterator[tuple[str, Prior]]:
    """Name and prior of each way to start."""
    box = drawn_box(frame.visible, rng)
    yield "box", Prior(box=box)
    cones = usual_approaches([case.bone.name])
    yield "box, usual cone", Prior(cones=cones, box=box)
    yield "usual cone", Prior(cones=cones)
    picks = pick(case, frame, rng)
    if picks:
        yield "three picks", Prior(picks=picks)


def drawn_box(visible: np.ndarray, rng: np.random.Generator) -> tuple[int, int, int, int]:
    """The box of a mask, each side off by the human error."""
    rows, columns = np.nonzero(visible)
    sides = np.array([columns.min(), rows.min(), columns.max() + 1, rows.max() + 1], dtype=float)
    sides += rng.normal(0.0, _PICTURE_PX, 4)
    height, width = visible.shape
    x, y, right, bottom = np.clip(sides, 0, (width, height, width, height)).astype(int).tolist()
    return x, y, right - x, bottom - y


def pick(case: Case, frame: Frame, rng: np.random.Generator) -> tuple[Pick, ...]:
    """Three places of the bone that are seen, far from each other; none where fewer are."""
    bone, pose = case.bone, frame.true
    mesh = bone.mesh
    pixels = case.rig.left.project(pose.apply(mesh.vertices_mm))
    inside = (pixels >= 0.0).all(axis=1) & (pixels < frame.visible.shape[::-1]).all(axis=1)
    near = np.zeros(len(pixels), dtype=bool)
    columns, rows = pixels[inside].astype(int).T
    near[inside] = frame.visible[rows, columns]
    seen = np.flatnonzero(near & mesh.visible_vertices(pose))
    if len(seen) < _N_PICKS:
        return ()
    points_mm = mesh.vertices_mm[seen]
    chosen = [int(np.linalg.norm(points_mm - points_mm.mean(axis=0), axis=1).argmax())]
    while len(chosen) < _N_PICKS:
        apart_mm = np.linalg.norm(points_mm[:, None] - points_mm[chosen], axis=2).min(axis=1)
        chosen.append(int(apart_mm.argmax()))
    at_px = pixels[seen[chosen]] + rng.normal(0.0, _PICTURE_PX, (_N_PICKS, 2))
    planned_mm = points_mm[chosen] + rng.normal(0.0, _PLAN_MM, (_N_PICKS, 3))
    return tuple(
        Pick(str(k), bone.name, (float(u), float(v)), point_mm)
        for k, ((u, v), point_mm) in enumerate(zip(at_px, planned_mm, strict=True))
    )


if __name__ == "__main__":
    sys.exit(main())
