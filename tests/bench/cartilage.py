"""Cartilage that the camera sees and the CT does not: the tables of docs/measurements.md.

usage: python -m tests.bench.cartilage [--seeds N] [--frames N] [--each]

Simulated knees, half of them left ones, carry 1 to 3 mm of cartilage. The same pictures are
followed with plans that know its thickness well, roughly or not at all: `RegistrationModel` and
judge get nothing else. Each knee is registered from its nominal pose, then tracked.
"""

import argparse
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from drivers.frames import StereoFrame
from navapp.evaluation import compute_mean_tre_mm
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.preop.cartilage import MAPPED_SD_MM, make_even_cartilage
from navapp.tracking import Goal, TrackState
from navapp.tracking.bimcc_tracker import BimccTracker
from navapp.tracking.surface_meter import Margins
from navapp.values import BoneModel, Origin, Side, Status, TrackedFrame
from sim_devices.relief import make_waves
from sim_devices.scenario import Scenario
from sim_devices.world import World
from tests.knees import SimulatedKnee, nominal_prior

# Not the seeds of any test or default.
FIRST_SEED = 81
MEAN_MM, SPREAD_MM = 2.0, 0.6
ERROR_MM, ERROR_WAVES_MM = 0.4, (30.0, 80.0)
GOAL = Goal(np.empty((0, 3)), 2.0)
_MARGINS = Margins(box_px=16, band_mm=15.0)


@dataclass(frozen=True)
class Patient:
    """A knee's pictures with their truth, and what lies on its femur."""

    seed: int
    world: World
    mesh: TriangleMesh
    side: Side
    thickness_mm: FloatArray
    frames: list[StereoFrame]
    poses: list[RigidTransform]


@dataclass(frozen=True)
class Row:
    """What the tracker answered in one frame, and how far off it was."""

    seed: int
    frame: int
    status: Status
    reasons: str
    tre_mm: float
    bound_mm: float
    rms_ratio: float
    coverage: float
    inlier_fraction: float
    thirds_mm: float
    thickness_ratio: float
    free_rms_ratio: float
    free_coverage: float
    free_inlier_share: float


def patient(seed: int, n_frames: int, mean_mm: float = MEAN_MM) -> Patient:
    """A knee of that seed, seen in so many frames."""
    side: Side = "left" if seed % 2 else "right"
    knee = SimulatedKnee(Scenario(seed=seed, side=side, cartilage_mm=mean_mm, motion="patient"))
    frames = knee.frames(n_frames)
    poses = [knee.truth(frame) for frame in frames]
    thickness_mm = knee.world.cartilage_mm("femur")
    return Patient(seed, knee.world, knee.bone.mesh, side, thickness_mm, frames, poses)


def smooth_error_mm(known: Patient) -> FloatArray:
    """(V,) of that standard deviation, as a segmentation of another picture may make it."""
    rng = np.random.default_rng([known.seed, 77])
    return make_waves(rng, ERROR_MM, ERROR_WAVES_MM)(known.mesh.vertices_mm)


def exact(known: Patient) -> BoneModel:
    """The plan knows the true thickness."""
    return _mapped(known, known.thickness_mm)


def mapped(known: Patient) -> BoneModel:
    """The plan knows the thickness of every vertex, with a smooth error."""
    thickness = np.maximum(known.thickness_mm + smooth_error_mm(known), 0.0)
    return _mapped(known, np.where(known.thickness_mm > 0.0, thickness, 0.0))


def thicker(by_mm: float) -> Callable[[Patient], BoneModel]:
    """The plan's cartilage is thicker than the true one, by as much everywhere."""

    def make(known: Patient) -> BoneModel:
        is_covered = known.thickness_mm > 0.0
        return _mapped(known, np.where(is_covered, known.thickness_mm + by_mm, 0.0))

    return make


def one_mean(known: Patient) -> BoneModel:
    """The plan knows how thick it is on the joint surfaces on average."""
    return make_even_cartilage(BoneModel("femur", known.mesh, known.side), MEAN_MM, SPREAD_MM)


def one_mean_on_joints(known: Patient) -> BoneModel:
    """As `one_mean`, but the plan knows where cartilage is."""
    is_covered = known.thickness_mm > 0.0
    mean_mm, sd_mm = (np.where(is_covered, value, 0.0) for value in (MEAN_MM, SPREAD_MM))
    return BoneModel("femur", known.mesh, known.side, mean_mm, sd_mm)


def unknown(known: Patient) -> BoneModel:
    """The plan knows of no cartilage."""
    return BoneModel("femur", known.mesh, known.side)


BARE = "bare bone"
PLANS: dict[str, Callable[[Patient], BoneModel]] = {
    "thickness exact": exact,
    "thickness per vertex, 0.4 mm off": mapped,
    "0.4 mm too thick everywhere": thicker(0.4),
    "0.8 mm too thick everywhere": thicker(0.8),
    "one mean, 2.0:0.6": one_mean,
    "one mean, on the joint surfaces only": one_mean_on_joints,
    "no offset": unknown,
}


def _mapped(known: Patient, thickness_mm: FloatArray) -> BoneModel:
    sd_mm = np.where(thickness_mm > 0.0, MAPPED_SD_MM, 0.0)
    return BoneModel("femur", known.mesh, known.side, thickness_mm, sd_mm)


def followed(known: Patient, bone: BoneModel) -> Iterator[Row]:
    """Register in the first frame, track through the others."""
    tracker = BimccTracker(known.world.rig, bone)
    first = known.frames[0]
    answers = tracker.register(first, nominal_prior(known.world), GOAL)
    if not answers or answers[0].left_from_bone is None:
        yield _lost(known.seed, 0, "no candidate")
        return
    tracked = answers[0]
    yield _row(known, 0, tracked, tracker)
    state = TrackState.at_rest(tracked.left_from_bone, first.captured_ns)
    for number, frame in enumerate(known.frames[1:], start=1):
        tracked, state = tracker.track(frame, state, GOAL)
        yield _row(known, number, tracked, tracker)


def _row(known: Patient, number: int, tracked: TrackedFrame, tracker: BimccTracker) -> Row:
    verdict, pose = tracked.verdict, tracked.left_from_bone
    reasons = "; ".join(reason.value for reason in verdict.reasons)
    if pose is None:
        return _lost(known.seed, number, reasons)
    frame = known.frames[number]
    free, ratio = tracker.assess(frame, pose, GOAL).verdict, tracked.estimate.thickness_ratio
    bone = BoneModel("femur", known.mesh, known.side)
    return Row(
        known.seed,
        number,
        verdict.status,
        reasons,
        compute_mean_tre_mm(pose, known.poses[number], bone, np.empty((0, 3))),
        verdict.predicted_tre_mm or float("nan"),
        _ratio(verdict.rms_mm, verdict.expected_rms_mm),
        verdict.coverage,
        verdict.inlier_fraction,
        thirds_mm(tracker, frame, pose),
        float("nan") if ratio is None else ratio,
        _ratio(free.rms_mm, free.expected_rms_mm),
        free.coverage,
        free.inlier_fraction,
    )


def _lost(seed: int, number: int, reasons: str) -> Row:
    return Row(seed, number, Status.LOST, reasons, *[float("nan")] * 10)


def _ratio(rms_mm: float | None, expected_mm: float | None) -> float:
    return rms_mm / expected_mm if rms_mm is not None and expected_mm else float("nan")


def thirds_mm(tracker: BimccTracker, frame: StereoFrame, pose: RigidTransform) -> float:
    """Largest median of measured minus expected depth over a third of the model's columns or rows.

    Matched on the model, as the tracker's last round is.
    """
    meter, rectified = tracker.meter, tracker.rectify_pose(pose)
    pair = meter.rectify(frame.left, frame.right, rectified, _MARGINS)
    expected = meter.render(pair, rectified, _MARGINS)
    if expected is None:
        return float("nan")
    found = meter.measure_on_model(expected).disparity
    rows, columns = np.nonzero(found.origin == Origin.MATCHED)
    depths = [
        meter.geometry.focal_px * meter.geometry.baseline_mm / disparity_px[rows, columns]
        for disparity_px in (found.disparity_px, expected.support_px)
    ]
    if len(rows) == 0:
        return float("nan")
    difference_mm = depths[0] - depths[1]
    largest = 0.0
    for place in (rows, columns):
        edges = np.quantile(place, (0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0))
        for low, high in pairwise(edges):
            part = difference_mm[(place >= low) & (place <= high)]
            largest = max(largest, abs(float(np.median(part))))
    return largest


def main() -> int:
    """Follow every knee with every plan and print what came out."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=12)
    parser.add_argument("--frames", type=int, default=3)
    parser.add_argument("--each", action="store_true", help="print every frame as well")
    options = parser.parse_args()
    rows: dict[str, list[Row]] = {name: [] for name in (BARE, *PLANS)}
    for seed in range(FIRST_SEED, FIRST_SEED + options.seeds):
        bare = patient(seed, options.frames, 0.0)
        rows[BARE] += followed(bare, unknown(bare))
        known = patient(seed, options.frames)
        for name, make in PLANS.items():
            rows[name] += followed(known, make(known))
    print_summary(rows)
    print_separation(rows)
    if options.each:
        print_each(rows)
    return 0


def print_summary(rows: dict[str, list[Row]]) -> None:
    """Errors and statuses of every plan."""
    print("| plan | frames | OK | DEGRADED | LOST | TRE median | 95 % | worst | of OK, worst | bound median | bound holds |")  # fmt: skip  # noqa: E501
    print("|---|---|---|---|---|---|---|---|---|---|---|")
    for name, found in rows.items():
        counts = Counter(row.status for row in found)
        tre, bound = (_finite(found, key) for key in ("tre_mm", "bound_mm"))
        ok = [row.tre_mm for row in found if row.status is Status.OK]
        holds = 100.0 * np.mean([row.tre_mm <= row.bound_mm for row in found])
        print(
            f"| {name} | {len(found)} | " + " | ".join(str(counts[status]) for status in Status)
            + f" | {np.median(tre):.2f} | {np.quantile(tre, 0.95):.2f} | {tre.max():.2f} | "
            + (f"{max(ok):.2f}" if ok else "-") + f" | {np.median(bound):.2f} | {holds:.0f} % |"
        )  # fmt: skip


def print_separation(rows: dict[str, list[Row]]) -> None:
    """Least, median and largest value of what a judge can look at."""
    keys = {
        "rms / expected": "rms_ratio", "coverage": "coverage", "inlier share": "inlier_fraction",
        "thirds, mm": "thirds_mm", "thickness / deviation": "thickness_ratio",
        "free: rms / expected": "free_rms_ratio", "free: coverage": "free_coverage",
        "free: inlier share": "free_inlier_share",
    }  # fmt: skip
    print("\n| plan | " + " | ".join(keys) + " |")
    print("|---|" + "---|" * len(keys))
    for name, found in rows.items():
        cells = []
        for key in keys.values():
            values = _finite(found, key)
            low, middle, high = (
                np.quantile(values, (0.0, 0.5, 1.0)) if len(values) else [np.nan] * 3
            )
            cells.append(f"{low:.2f} {middle:.2f} {high:.2f}")
        print(f"| {name} | " + " | ".join(cells) + " |")


def print_each(rows: dict[str, list[Row]]) -> None:
    """Every frame."""
    print("\n| plan | seed | frame | status | TRE | bound | rms / expected | coverage | inliers | thirds | free rms / expected | free coverage | free inliers | reasons |")  # fmt: skip  # noqa: E501
    print("|---|" + "---|" * 13)
    for name, found in rows.items():
        for row in found:
            print(
                f"| {name} | {row.seed} | {row.frame} | {row.status.value} | {row.tre_mm:.2f} | "
                f"{row.bound_mm:.2f} | {row.rms_ratio:.2f} | {row.coverage:.2f} | "
                f"{row.inlier_fraction:.2f} | {row.thirds_mm:.3f} | {row.free_rms_ratio:.2f} | "
                f"{row.free_coverage:.2f} | {row.free_inlier_share:.2f} | {row.reasons} |"
            )


def _finite(found: list[Row], key: str) -> FloatArray:
    values = np.array([getattr(row, key) for row in found])
    finite: FloatArray = values[np.isfinite(values)]
    return finite


if __name__ == "__main__":
    sys.exit(main())
