"""What edges along the model's outline are worth: the tables of docs/how/registration.md.

usage: python -m tests.bench.outline [--seeds N] [--first SEED]

One frame of each of N simulated knees (every fourth with a hand and an instrument in the view).
The first table sorts the strongest edge near each point of the outline, at the true pose, by how
dark it is behind it; the second joins surface and outline, started next to the truth; the third
tells how many of the outline's edges are as near as the surface's fit allows, for the right plan
and for bones of another size. The truth only starts and scores.
"""

import argparse
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from navapp.evaluation import compute_mean_tre_mm
from navapp.geometry.transform import RigidTransform
from navapp.geometry.zbuffer import RenderedView
from navapp.tracking.edge_kernels import (
    find_strongest_edge,
    measure_missing_fraction,
    sample_across,
)
from navapp.tracking.frame import Fit, Frame
from navapp.tracking.outline_kernels import Eye, Rim, find_rim, is_outline, thin_rim
from navapp.tracking.surface_meter import NEAR_BOX
from tests.bench.first_registration import Case, simulated
from tests.bench.tracker_parts import TrackerParts
from tests.bench.wrong_bones import stretch_bone

DARKER = (0.0, 0.3, 0.5, 0.6, 0.7, 0.8, 1.01)
NEAR_PX = 0.5
START_OFF_MM, START_OFF_DEG = 0.25, 0.25
SIZES = (1.0, 0.95, 0.98, 1.02, 1.05)
FEWEST = 6.0


@dataclass(frozen=True)
class Edge:
    """The strongest edge near a point of the outline."""

    offset_px: float
    darker: float


def main() -> int:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first", type=int, default=501)
    options = parser.parse_args()
    edges: list[Edge] = []
    rows: list[tuple[float, float, float, float]] = []
    shares: dict[float, list[float]] = {size: [] for size in SIZES}
    for seed in range(options.first, options.first + options.seeds):
        case = simulated(seed)
        parts = TrackerParts(case.rig, case.bone)
        edges += edges_of(case, parts)
        rows += joined(case, parts, seed)
        for size in SIZES:
            sized = parts if size == 1.0 else TrackerParts(case.rig, stretch_bone(case.bone, size))
            shares[size] += near_shares(case, sized, seed)
    print("| darker behind by | edges | within 0.5 px | median px | MAD px |")
    print("|---|---|---|---|---|")
    for low, high in pairwise(DARKER):
        print(row(low, high, [edge for edge in edges if low <= edge.darker < high]))
    print("\n| estimate | frames | TRE median | worst | bound median | holds |")
    print("|---|---|---|---|---|---|")
    for name, column in (("surface alone", 0), ("surface and outline", 2)):
        error, bound = np.array(rows)[:, column], np.array(rows)[:, column + 1]
        print(
            f"| {name} | {len(rows)} | {np.median(error):.3f} mm | {error.max():.3f} mm | "
            f"{np.median(bound):.2f} mm | {100 * np.mean(error <= bound):.0f} % |"
        )
    print("\n| size of the plan | frames | edges near: median | least |\n|---|---|---|---|")
    for size, found in shares.items():
        least = min(found, default=np.nan)
        print(f"| x {size:g} | {len(found)} | {np.median(found):.2f} | {least:.2f} |")
    return 0


def edges_of(case: Case, parts: TrackerParts) -> Iterator[Edge]:
    """Of the left picture, at the true pose."""
    frame = case.frames[0]
    true = parts.rectify_pose(frame.true)
    pair = parts.frame(frame.left, frame.right, true).pair
    expected = parts.meter.render(pair, true, NEAR_BOX)
    if expected is None:
        return
    wide, flank = np.empty(31), np.empty(17)
    for pixel, normal in outline(parts, true, expected.view):
        if not sample_across(pair.left, tuple(pixel), tuple(normal), wide):
            continue
        at = find_strongest_edge(wide)
        middle = pixel + at * normal
        if not np.isnan(at) and sample_across(pair.left, tuple(middle), tuple(normal), flank):
            yield Edge(at, measure_missing_fraction(flank))


def outline(
    parts: TrackerParts, pose: RigidTransform, view: RenderedView
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Pixel and normal of each point of it in the left picture."""
    geometry = parts.meter.geometry
    eye = Eye(0.0, geometry.focal_px, geometry.centre_x_px, geometry.centre_y_px)
    turn, shift_mm = np.array(pose.rotation), np.array(pose.translation_mm)
    rim = find_rim(parts.outline.ridges, turn, shift_mm, eye)
    seen = is_outline(rim, view.depth_mm, view.box.x, view.box.y)
    rim = thin_rim(Rim(*(part[seen] for part in rim)))
    yield from zip(rim.pixel, rim.normal, strict=True)


def joined(
    case: Case, parts: TrackerParts, seed: int
) -> Iterator[tuple[float, float, float, float]]:
    """Error and bound of the surface alone, then of both; nothing when the bone is not found."""
    true = parts.rectify_pose(case.frames[0].true)
    frame, fit = located(case, parts, seed)
    if fit is None:
        return
    answer: list[float] = []
    for one in (fit, parts.with_outline(frame, fit)):
        mesh = parts.model.bone.mesh
        targets = mesh.vertices_mm[mesh.visible_vertices(one.pose)]
        bound_mm = one.estimate.predict_tre_mm(
            parts.model.centre_mm, targets[:: len(targets) // 200]
        )
        answer += [compute_mean_tre_mm(one.pose, true, case.bone, np.empty((0, 3))), bound_mm]
    yield answer[0], answer[1], answer[2], answer[3]


def located(case: Case, parts: TrackerParts, seed: int) -> tuple[Frame, Fit | None]:
    """The surface's fit from next to the truth; None when the bone is not found."""
    taken, rng = case.frames[0], np.random.default_rng([seed, 3])
    true = parts.rectify_pose(taken.true)
    off = np.concatenate(
        [rng.normal(0.0, START_OFF_MM, 3), np.radians(rng.normal(0.0, START_OFF_DEG, 3))]
    )
    start = true.move(off, true.apply(parts.model.centre_mm))
    frame = parts.frame(taken.left, taken.right, start)
    fit = parts.find(frame)
    return frame, None if fit is None or fit.measured.rendered is None else fit


def near_shares(case: Case, parts: TrackerParts, seed: int) -> Iterator[float]:
    """Share of the edges that the fit allows; nothing without a fit, or with too few edges."""
    frame, fit = located(case, parts, seed)
    if fit is None:
        return
    measured, coarse_px = fit.measured, parts.coarse_px(frame, fit)
    block = parts.outline.block(
        frame.pair, fit.pose, measured.rendered, measured.disparity, coarse_px
    )
    near = block.find_near(block.jacobian, np.zeros(6), fit.estimate.covariance)
    if near.n_all >= FEWEST:
        yield near.n_near / near.n_all


def row(low: float, high: float, edges: list[Edge]) -> str:
    """Of the first table."""
    offset = np.array([edge.offset_px for edge in edges])
    is_near = np.abs(offset) < NEAR_PX
    middle = np.median(offset[is_near])
    spread = 1.4826 * np.median(np.abs(offset[is_near] - middle))
    return (
        f"| {low:.1f} to {min(high, 1.0):.1f} | {len(edges)} | {100 * is_near.mean():.0f} % | "
        f"{middle:+.2f} | {spread:.2f} |"
    )


if __name__ == "__main__":
    sys.exit(main())
