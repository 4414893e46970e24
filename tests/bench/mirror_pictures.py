"""Pictures of set-ups with a display in a mirror: calibrated from them, guides read from them.

In each set-up lies another knee. Nothing of its true pose, or of the true display, reaches what is
calibrated, tracked and drawn, but where the other way round is asked for: guides by the truth.
"""

import dataclasses
import time

import numpy as np

from calibration.mirror.display_solution import DisplayCalibration, solve_display
from calibration.mirror.first_state import Told
from calibration.mirror.seen_views import SeenView
from calibration.mirror.view_detection import find_view
from navapp.devices.simulated_mirror import true_display
from navapp.evaluation import compute_mean_tre_mm
from sim_devices.mirror_optics import MirrorSetup
from sim_devices.mirror_setups import PITCH_MM, draw_setup, look_at_site
from tests.bench.mirror_guides import (
    Crosses,
    ReadCut,
    choose_targets,
    find_cut,
    read_crosses,
    read_cut,
)
from tests.bench.mirror_knees import BONE, follow_knee
from tests.bench.mirror_limits import Limits
from tests.bench.mirror_reading import Sight
from tests.calibration.mirror.simulated_pictures import take_view
from tests.calibration.mirror.simulated_views import eye_camera, scene
from tests.geometry.test_display_model_errors import seen_beside_mm

N_VIEWS = 8
_FIRST_SEED = 3100


@dataclasses.dataclass(frozen=True, eq=False)
class Guides:
    """What is read of one way to draw them."""

    crosses: Crosses
    cut: ReadCut


@dataclasses.dataclass(frozen=True, eq=False)
class Row:
    """What is found in one set-up."""

    is_accepted: bool
    # held_out_mm, held_out_arcmin: 95 % of them.
    held_out_mm: float
    held_out_arcmin: float
    pose_mm: float  # mean distance of the tracked bone's points from the true ones
    predicted_mm: np.ndarray  # (n,) of the model at the targets
    model_error_mm: np.ndarray  # (n,) computed there, without pictures
    by_truth: Guides
    by_estimate: Guides
    is_cut_seen_by_cameras: np.ndarray  # of the cut line's samples


def by_pictures(n_setups: int, limits: Limits) -> None:
    """Calibrate from rendered pictures, follow a knee, then read what is shown."""
    print("| set-up | held out mm | arcmin | predicted mm | pose mm | crosses | whole "
          "| by the truth: bars 95 % mm | line 95 % mm | by the estimate: centroids median mm "
          "| bars 95 % mm | line 95 % mm | line seen | read | s |")  # fmt: skip
    print("|---|" + "---|" * 14)
    rows = []
    for number in range(n_setups):
        began = time.perf_counter()
        rows.append(row := read_setup(_FIRST_SEED + number))
        took_s = time.perf_counter() - began
        truth, estimate = row.by_truth, row.by_estimate
        print(f"| {number} | {row.held_out_mm:.3f} | {row.held_out_arcmin:.2f} "
              f"| {np.median(row.predicted_mm):.3f} | {row.pose_mm:.3f} "
              f"| {len(truth.crosses.is_whole)} | {truth.crosses.is_whole.sum()} "
              f"| {at(truth.crosses.crossing_mm, 0.95):.3f} | {at(truth.cut.off_mm, 0.95):.3f} "
              f"| {at(estimate.crosses.centroid_mm, 0.5):.3f} "
              f"| {at(estimate.crosses.crossing_mm, 0.95):.3f} "
              f"| {at(estimate.cut.off_mm, 0.95):.3f} | {len(estimate.cut.off_mm)} "
              f"| {np.isfinite(estimate.cut.off_mm).sum()} | {took_s:.0f} |",
              flush=True)  # fmt: skip
    print(f"\n| {n_setups} set-ups with pictures | found | limit | |")
    print("|---|---|---|---|")
    limits.line("not accepted", sum(not row.is_accepted for row in rows), 0)
    limits.line("held-out error, worst set-up, mm", max(row.held_out_mm for row in rows), 0.3)
    limits.line("held-out error, worst set-up, arcmin", max(r.held_out_arcmin for r in rows), 2.0)
    judge_truth([row.by_truth for row in rows], limits)
    judge_estimate([row.by_estimate for row in rows], limits)
    below = np.concatenate([row.model_error_mm <= row.predicted_mm for row in rows])
    print(f"| prediction holds (of the model, without reading) | {np.mean(below):.3f} | | |")
    tell_lit(rows)


def read_setup(seed: int) -> Row:
    """One set-up: everything in it is drawn anew from the seed."""
    rng, knee = np.random.default_rng(seed), follow_knee(seed)
    setup = draw_setup(rng, knee.middle_mm)
    found, eye_mm = calibrate_by_pictures(rng, setup)
    true = dataclasses.replace(true_display(setup), eye_mm=eye_mm)
    sight = Sight(setup, look_at_site(setup, eye_mm - setup.eye_mm))
    targets_mm, cut = choose_targets(rng, knee, sight), find_cut(knee, sight)
    guides = [
        Guides(
            read_crosses(knee, sight, model.view(), pose, targets_mm),
            read_cut(knee, sight, model.view(), pose, cut),
        )
        for model, pose in ((true, knee.true), (found.model, knee.estimated))
    ]
    points_mm, quality = knee.true.apply(targets_mm), found.model.quality
    pose_mm = compute_mean_tre_mm(
        knee.estimated, knee.true, knee.plan.bones[BONE], np.empty((0, 3))
    )
    return Row(
        quality is not None and quality.is_accepted,
        *found.held_out.quantile(0.95),
        pose_mm,
        found.model.predict_error(points_mm),
        seen_beside_mm(found.model, true, points_mm, points_mm),
        *guides,
        cut.is_seen_by_cameras,
    )


def at(errors: np.ndarray, share: float) -> float:
    """That so many of the errors that were read stay below."""
    return float(np.nanquantile(np.abs(errors), share))


def judge_truth(guides: list[Guides], limits: Limits) -> None:
    """Drawn with the true pose and calibration: what is left is the drawing's and the reading's."""
    centroids = np.concatenate([one.crosses.centroid_mm for one in guides])
    bars = np.concatenate([one.crosses.crossing_mm for one in guides])
    is_whole = np.concatenate([one.crosses.is_whole for one in guides])
    name = "true pose and calibration"
    if is_whole.any():
        limits.line(f"{name}: centroids of whole crosses, 95 %, mm", at(centroids[is_whole], 0.95),
                    0.05)  # fmt: skip
    limits.line(f"{name}: centroids of all crosses, 95 %, mm", at(centroids, 0.95), 0.05)
    limits.line(f"{name}: where bars cross, 95 %, mm", at(bars, 0.95), 0.05)
    lines = np.concatenate([one.cut.off_mm for one in guides])
    limits.line(f"{name}: cut line, 95 %, mm", at(lines, 0.95), 0.05)


def judge_estimate(guides: list[Guides], limits: Limits) -> None:
    """Drawn with the pose as tracked and the display as solved."""
    name = "as tracked and solved"
    for kind in ("centroid", "crossing"):
        errors = np.concatenate([getattr(one.crosses, f"{kind}_mm") for one in guides])
        words = {"centroid": "centroids of all crosses", "crossing": "where bars cross"}[kind]
        limits.line(f"{name}: {words}, median, mm", at(errors, 0.5), 0.35)
        limits.line(f"{name}: {words}, 95 %, mm", at(errors, 0.95), 0.8)
    lines = np.abs(np.concatenate([one.cut.off_mm for one in guides]))
    is_read = np.isfinite(lines)
    print(f"| {name}: cut line, 95 %, mm | {at(lines, 0.95):.3f} | | |")
    limits.line(f"{name}: drawn cut line within 0.5 mm", np.mean(lines[is_read] <= 0.5), 0.95,
                is_upper=False)  # fmt: skip


def tell_lit(rows: list[Row]) -> None:
    """How much of what the eye could see is drawn, and read."""
    crosses = [row.by_estimate.crosses for row in rows]
    n = sum(len(one.is_whole) for one in crosses)
    n_dark = sum(np.isnan(one.centroid_mm).sum() for one in crosses)
    n_barred = sum(np.isfinite(one.crossing_mm).sum() for one in crosses)
    n_whole = sum(one.is_whole.sum() for one in crosses)
    print(f"| crosses, of {n}: dark, with two bars to be read, whole "
          f"| {n_dark}, {n_barred}, {n_whole} | | |")  # fmt: skip
    by_cameras = np.concatenate([row.is_cut_seen_by_cameras for row in rows])
    # A line that is further off than it is looked for would be missing from the second alone.
    for name, cuts in (
        ("by the truth", [row.by_truth.cut for row in rows]),
        ("as tracked and solved", [row.by_estimate.cut for row in rows]),
    ):
        lit = np.concatenate([one.is_lit for one in cuts])
        read = np.isfinite(np.concatenate([one.off_mm for one in cuts]))
        print(f"| {name}: cut line that the eye could see, lit, read "
              f"| {lit.mean():.3f}, {read.mean():.3f} | | |")  # fmt: skip
        print(f"| of what the cameras see too: lit, read | {lit[by_cameras].mean():.3f}, "
              f"{read[by_cameras].mean():.3f} | | |")  # fmt: skip
    print()


def calibrate_by_pictures(
    rng: np.random.Generator, setup: MirrorSetup
) -> tuple[DisplayCalibration, np.ndarray]:
    """As `navapp calibrate mirror --views` does; and (3,) where the eye's camera truly stood."""
    camera, common = eye_camera(rng), scene()
    views: list[SeenView] = []
    centres = []
    for number in range(N_VIEWS):
        pictures, centre = take_view(rng, setup, common, camera, number)
        found = find_view(common, pictures)
        if isinstance(found, SeenView):
            views.append(found)
            centres += [centre] * found.is_eye
    told = Told(PITCH_MM * (1.0 + rng.normal(0.0, 0.001)), setup.plate.thickness_mm + 0.2)
    return solve_display(common, views, told), np.mean(centres, axis=0)
