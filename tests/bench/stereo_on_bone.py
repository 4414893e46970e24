"""Stereo on bone: how far the measured surface is from the true one, beside OpenCV's SGBM.

usage: python -m tests.bench.stereo_on_bone [FOLDER] [--seeds N] [--only NAME]
                                             [--part floor|free|guided]

Without a pose: the whole frame, within the depths that a rig is used for; then a plain fit of the
true model to every second measured point each way, started at the truth (it shows a tilt of the
disparity). With a pose: the truth disturbed about the bone's centre, found as the tracker does it.
The floor: the same plain fit to what is measured on the true surface itself.
"""

import argparse
import os
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from navapp.geometry import Box
from navapp.geometry.zbuffer import render_rectified
from navapp.stereo import match_on_support, match_surface
from navapp.tracking.frame import Frame
from navapp.values import BoneModel, DisparityMap, Status, Stopwatch
from tests.bench.bone_scenes import (
    Scene,
    Sequence,
    disturbed,
    fit_error_mm,
    on_bone,
    sequences,
    tre_mm,
)
from tests.bench.sgbm import match_sgbm
from tests.bench.tracker_parts import TrackerParts

_DISTURBANCES = ((1.0, 0.6), (2.0, 2.0), (5.0, 5.0), (8.0, 8.0))
_DEPTH_MM = (300.0, 700.0)
_CAUGHT_MM = 0.5


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "folder", nargs="?", default=os.environ.get("NAVAPP_DATA", "../shared/data")
    )
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--only", default="", help="sequences whose name contains this")
    parser.add_argument("--part", choices=("floor", "free", "guided"), help="this part only")
    options = parser.parse_args()
    chosen = [s for s in sequences(Path(options.folder)) if options.only in s.name]
    if options.part in (None, "floor"):
        print("on the true surface: fit TRE median / worst mm", flush=True)
        for sequence in chosen:
            floor(sequence)
    if options.part in (None, "free"):
        print("without a pose: fit TRE median / worst mm, density, depth MAD, signed mm | worse "
              "by at most, after the fill | SGBM median / worst")  # fmt: skip
        for sequence in chosen:
            free(sequence)
    if options.part in (None, "guided"):
        print(f"with a pose off by: TRE median / 98 % / worst mm, share below {_CAUGHT_MM} mm, "
              "slope of those, signed depth mm")  # fmt: skip
        for sequence in chosen:
            guided(sequence, options.seeds)


@dataclass(frozen=True)
class Quality:
    """Of one disparity map on the bone."""

    fit_mm: float
    density: float
    mad_mm: float
    signed_mm: float

    @classmethod
    def of(cls, scene: Scene, found: DisparityMap, sequence: Sequence) -> "Quality":
        """Compare with the truth."""
        error_mm = depth_error_mm(scene, found, sequence)
        signed = float(np.median(error_mm))
        return cls(
            fit_error_mm(scene, found, sequence.mesh),
            error_mm.size / scene.is_bone.sum(),
            float(np.median(np.abs(error_mm - signed))),
            signed,
        )


def depth_error_mm(scene: Scene, found: DisparityMap, sequence: Sequence) -> np.ndarray:
    """Measured minus true depth of the matched pixels on the bone."""
    geometry = scene.pair.geometry
    true = render_rectified(sequence.mesh, scene.pose, geometry, scene.pair.box).depth_mm
    scale = geometry.focal_px * geometry.baseline_mm
    error = scale / on_bone(scene, found).disparity_px - true
    return error[np.isfinite(error)]


def floor(sequence: Sequence) -> None:
    """What the pictures leave when the expected surface is the true one."""
    fits = []
    for scene in sequence.scenes:
        geometry = scene.pair.geometry
        true = render_rectified(sequence.mesh, scene.pose, geometry, scene.pair.box)
        expected_px = geometry.disparity_map_px(true.depth_mm)
        answer = match_on_support(scene.pair, expected_px, fills=False)
        fits.append(fit_error_mm(scene, answer.matched, sequence.mesh))
    print(f"{sequence.name}: {np.median(fits):.3f} / {max(fits):.3f}", flush=True)


def free(sequence: Sequence) -> None:
    """Without a pose, beside SGBM."""
    ours, filled, theirs = [], [], []
    for scene in sequence.scenes:
        geometry = scene.pair.geometry
        pair = replace(scene.pair, box=Box(0, 0, geometry.width, geometry.height))
        band = geometry.disparity_px(_DEPTH_MM[1]), geometry.disparity_px(_DEPTH_MM[0])
        answer = match_surface(pair, band, fills=True)
        ours.append(Quality.of(scene, answer.matched, sequence))
        filled.append(Quality.of(scene, answer.disparity, sequence))
        theirs.append(fit_error_mm(scene, match_sgbm(pair, band), sequence.mesh))
    fits = [q.fit_mm for q in ours]
    worse = max(after.fit_mm - before.fit_mm for before, after in zip(ours, filled, strict=True))
    print(
        f"{sequence.name}: {np.median(fits):.3f} / {max(fits):.3f}, "
        f"{min(q.density for q in ours):.2f}, {max(q.mad_mm for q in ours):.2f}, "
        f"{max((q.signed_mm for q in ours), key=abs):+.3f} | {worse:+.3f} | "
        f"{np.median(theirs):.3f} / {max(theirs):.3f}",
        flush=True,
    )


def guided(sequence: Sequence, n_seeds: int) -> None:
    """With a pose that is disturbed by an angle and a length."""
    parts = TrackerParts(sequence.rig, BoneModel("femur", sequence.mesh))
    for angle_deg, length_mm in _DISTURBANCES:
        before, after, signed, n_silent = [], [], [], 0
        for scene in sequence.scenes:
            for seed in range(n_seeds):
                start = disturbed(scene.pose, parts.model.centre_mm, angle_deg, length_mm, seed)
                frame = Frame(None, scene.pair, start, Stopwatch())
                fit = parts.find(frame)
                before.append(tre_mm(start, scene.pose, sequence.mesh))
                if fit is None:
                    after.append(np.inf)
                    continue
                after.append(tre_mm(fit.pose, scene.pose, sequence.mesh))
                if after[-1] > _CAUGHT_MM:
                    n_silent += parts.verdict(frame, fit).status is not Status.LOST
                signed.append(np.median(depth_error_mm(scene, fit.measured.disparity, sequence)))
        report_guided(f"{sequence.name} {angle_deg:g} deg {length_mm:g} mm", before, after, signed)
        if n_silent:
            print(f"  wrong, but not called LOST: {n_silent}")


def report_guided(name: str, before: list[float], after: list[float], signed: list[float]) -> None:
    """One line of the table; the slope is of those that were caught."""
    start, end = np.array(before), np.array(after)
    caught = end < _CAUGHT_MM
    slope = np.polyfit(start[caught], end[caught], 1)[0] if caught.sum() > 2 else np.nan
    print(
        f"{name}: {np.median(end):.3f} / {np.quantile(end, 0.98):.3f} / {end.max():.3f}, "
        f"{caught.mean():.3f}, {slope:+.3f}, {np.median(signed):+.3f}",
        flush=True,
    )


if __name__ == "__main__":
    main()
