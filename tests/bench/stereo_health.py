"""Recorded operations through a rig that was turned after its calibration.

usage: python -m tests.bench.stereo_health [FOLDER]

Every frame is followed from its true pose through the rig as it was calibrated, and through rigs
whose right camera is turned about the line between both by so many pixels. Prints what the rows of
the matched points say, what was said of it, and what the turn costs.
"""

import argparse
import os
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from navapp.evaluation import compute_mean_tre_mm
from navapp.geometry.ply import read_ply
from navapp.geometry.rig import StereoRig
from navapp.geometry.rig_files import read_rig
from navapp.geometry.transform import RigidTransform, rotation_from_vector
from navapp.stereo import measure_health
from navapp.tracking import TrackState
from navapp.tracking.judging import UNUSABLE_PICTURES
from navapp.tracking.surface_meter import WIDE_VIEW
from navapp.values import BoneModel, Reason, Status
from tests.bench.tracker_parts import GOAL, TrackerParts
from tests.pictures import Pictures
from tests.recorded import read_frames

OFFSETS_PX = (0.0, 0.15, 0.3, 0.5, -0.5, 1.0)
_NO_TARGETS = np.empty((0, 3))


@dataclass(frozen=True)
class Row:
    """One frame through one rig."""

    offset_px: float
    sigma_px: float
    is_doubted: bool
    other_doubts: int
    is_ok: bool
    tre_mm: float
    cost_ms: float


def main() -> int:
    """Print a row a phantom, sequence and turned rig."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "folder", nargs="?", default=os.environ.get("NAVAPP_DATA", "../shared/data")
    )
    print("| sequence | turned by | rows found | largest error | own error | frames | rows doubted | otherwise doubted | OK | TRE median | cost |")  # fmt: skip  # noqa: E501
    print("|---|" + "---|" * 10)
    for phantom in sorted(Path(parser.parse_args().folder).glob("phantom_*")):
        bone = BoneModel("femur", read_ply(phantom / "femur.ply")[0])
        rig = read_rig(phantom / "rig.yml")
        for sequence in sorted(path.parent for path in phantom.glob("*/prior.json")):
            for turn_px in OFFSETS_PX:
                rows = list(_follow_points(turned(rig, turn_px), bone, sequence))
                print(_table_row(f"{phantom.name}/{sequence.name}", turn_px, rows), flush=True)
    return 0


def turned(rig: StereoRig, row_offset_px: float) -> StereoRig:
    """The rig with its right camera turned about the line between both."""
    turn = rotation_from_vector((row_offset_px / rig.right.focal_px, 0.0, 0.0))
    old = rig.right_from_left
    moved = RigidTransform.from_parts(
        "right", "left", turn @ old.rotation, turn @ old.translation_mm
    )
    return replace(rig, right_from_left=moved)


def _follow_points(rig: StereoRig, bone: BoneModel, sequence: Path) -> Iterator[Row]:
    """Every frame from its own truth."""
    tracker = TrackerParts(rig, bone)
    for recorded in read_frames(sequence):
        truth, pictures = recorded.truth, Pictures(recorded.left, recorded.right)
        tracked, _ = tracker.track(pictures, TrackState.at_rest(truth, 0), GOAL)
        frame = tracker.begin(pictures, truth, WIDE_VIEW)
        fit = tracker.find(frame)
        if fit is None:
            continue
        depth_mm = float(fit.pose.apply(tracker.model.centre_mm)[2])
        started = time.perf_counter()
        pair, geometry = frame.pair, frame.pair.geometry
        health = measure_health(pair, fit.measured.disparity, geometry.disparity_px(depth_mm))
        cost_ms = 1e3 * (time.perf_counter() - started)
        reasons = tracker.verdict(frame, fit).reasons
        found = tracked.left_from_bone
        yield Row(
            health.row_offset_px,
            health.row_offset_sigma_px,
            Reason.ROWS_DISAGREE in reasons,
            len(UNUSABLE_PICTURES.intersection(reasons)),
            tracked.verdict.status is Status.OK,
            np.nan if found is None else compute_mean_tre_mm(found, truth, bone, _NO_TARGETS),
            cost_ms,
        )


def _table_row(name: str, turn_px: float, rows: list[Row]) -> str:
    offset, sigma, tre, cost = (
        np.array([getattr(row, key) for row in rows])
        for key in ("offset_px", "sigma_px", "tre_mm", "cost_ms")
    )
    doubted, other, ok = (
        sum(getattr(row, key) for row in rows) for key in ("is_doubted", "other_doubts", "is_ok")
    )
    return (
        f"| {name} | {turn_px:+.2f} px | {np.nanmedian(offset):+.3f} px | "
        f"{np.nanmax(np.abs(offset - turn_px)):.3f} px | {np.nanmedian(sigma):.3f} px | "
        f"{len(rows)} | {doubted} | {other} | {ok} | {np.nanmedian(tre):.2f} mm | "
        f"{np.median(cost):.1f} ms |"
    )


if __name__ == "__main__":
    sys.exit(main())
