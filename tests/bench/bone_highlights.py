"""What highlights do to the measurement of a glossy bone, and to the judge's word on it.

usage: python -m tests.bench.bone_highlights [--knees N] [--first SEED] [--stage STAGE]
                                              [--highlights X]

First, at the true pose: residuals of matching over what they claim (spread, median absolute
deviation), in grey pictures and in pictures without highlights, and where only one of them answers;
how far both contradict each other, and how many pixels are answered. `--highlights 0` makes the
bones matt. Then knees that are registered and followed over four frames, with and without the
second look. The seeds are those that the constants were chosen on.
"""

import argparse
from dataclasses import replace
from unittest import mock

import numpy as np
from numpy.typing import NDArray

from navapp.control.stages import stage_by_name
from navapp.evaluation.following import follow
from navapp.evaluation.scoring import score_answers
from navapp.evaluation.sequence import KnownSequence
from navapp.registration import RegistrationModel
from navapp.stereo import refine_on_model
from navapp.stereo.matte_pictures import make_matte_pair
from navapp.tracking import TrackerSettings
from navapp.tracking.search.highlights import HighlightSearch, measure_contradiction
from navapp.tracking.surface_meter import NEAR_BOX, NEAR_VIEW, SurfaceMeter
from navapp.values import DisparityMap
from tests.bench.bounds import render_knee

FIRST_SEED, _FRAMES = 2_000_001, 5
_MAD_TO_SIGMA = 1.4826


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--knees", type=int, default=6)
    parser.add_argument("--first", type=int, default=FIRST_SEED)
    parser.add_argument("--stage", default="patella")
    parser.add_argument("--highlights", type=float, default=1.0, help="times the usual area")
    options = parser.parse_args()
    stage = stage_by_name(options.stage).name
    sequences = [
        render_knee(stage, "overlay", number, options.first, _FRAMES, options.highlights)
        for number in range(options.knees)
    ]
    spreads = [measure_spreads(one) for one in sequences]
    print("| answered by | spread over the claim, by knee |\n|---|---|")
    for name in spreads[0]:
        print(f"| {name} | {', '.join(f'{one[name]:.2f}' for one in spreads)} |")
    print("\n| second look | frames | OK | TRE mean mm | worst mm | within the bound |")
    print("|---|---|---|---|---|---|")
    for is_on in (False, True):
        print(_follow_all(sequences, is_on=is_on))


def measure_spreads(sequence: KnownSequence) -> dict[str, float]:
    """Of each kind of answers, in the first frame at the true pose."""
    frame, true = sequence.frames[0], sequence.truth[0]
    if true is None:
        raise AssertionError("simulated frames have a truth")
    model = RegistrationModel(sequence.plan.bones[sequence.stage.bone])
    settings = TrackerSettings()
    meter = SurfaceMeter(sequence.rig, model, settings.depth_mm)
    pose = meter.geometry.rectified_from_left @ true
    expected = meter.render(meter.rectify(frame.left, frame.right, pose, NEAR_VIEW), pose, NEAR_BOX)
    if expected is None:
        raise AssertionError("the bone is in view")
    support_px = expected.support_px
    region = meter.find_region(pose, NEAR_VIEW) or (None, None)
    coloured = meter.rectifier.rectify(frame.left, frame.right, *region)
    coloured = replace(coloured, box=expected.pair.box)
    matte_pair = make_matte_pair(coloured, np.isfinite(support_px))
    if matte_pair is None:
        raise AssertionError("the simulator's pictures have colours")
    grey = refine_on_model(expected.pair, support_px)
    matte = refine_on_model(matte_pair, support_px)
    has_grey, has_matte = grey.origin > 0, matte.origin > 0
    return {
        "grey": _spread(grey, support_px, has_grey),
        "without highlights": _spread(matte, support_px, has_matte),
        "grey alone": _spread(grey, support_px, has_grey & ~has_matte),
        "without highlights alone": _spread(matte, support_px, has_matte & ~has_grey),
        "contradiction of both, over their claims": measure_contradiction(grey, matte),
        "answered without highlights, over grey": matte.n_matched / grey.n_matched,
    }


def _spread(
    found: DisparityMap, support_px: NDArray[np.float32], is_asked: NDArray[np.bool_]
) -> float:
    over_claim = (found.disparity_px - support_px)[is_asked] / found.sigma_px[is_asked]
    return float(_MAD_TO_SIGMA * np.median(np.abs(over_claim - np.median(over_claim))))


def _follow_all(sequences: list[KnownSequence], *, is_on: bool) -> str:
    patched = HighlightSearch.find if is_on else (lambda *_: iter(()))
    with mock.patch.object(HighlightSearch, "find", patched):
        followed = [score_answers(one, follow(one, "bimcc"), has_budget=False) for one in sequences]
    frames = [frame for one in followed for frame in one.frames]
    ok = [one for one in frames if one.is_ok and one.tre_mm is not None]
    errors = np.array([one.tre_mm for one in ok])
    bounds = np.array([one.bound_mm for one in ok])
    return (
        f"| {'yes' if is_on else 'no'} | {len(frames)} | {len(ok)} | {errors.mean():.3f} | "
        f"{errors.max():.2f} | {100.0 * np.mean(errors <= bounds):.0f} % |"
    )


if __name__ == "__main__":
    main()
