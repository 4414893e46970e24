"""Whole scenes with ground truth: bad-1, occluded error and density of what is handed out.

usage: python -m tests.bench.stereo_pairs [FOLDER]

Two Middlebury pairs, each with the census preset that its search range chooses, and with the other.
"""

import argparse
import os
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from navapp.geometry import Box, RectifiedGeometry, RectifiedPair, RigidTransform
from navapp.geometry.rectification import luma
from navapp.stereo import chains, match_scene
from navapp.stereo.chains import StereoAnswer


@dataclass(frozen=True)
class Known:
    """A pair and its truth.

    Attributes:
        name: of the folder.
        files: left and right picture.
        truths: left disparity, and the right one where there is one.
        scale: stored value of one pixel.
        n_disparities: searched.
    """

    name: str
    files: tuple[str, str]
    truths: tuple[str, ...]
    scale: float
    n_disparities: int


CONES = Known("cones", ("im2.png", "im6.png"), ("disp2.png", "disp6.png"), 4.0, 64)
ALOE = Known("aloe", ("aloeL.jpg", "aloeR.jpg"), ("aloeGT.png",), 1.0, 224)


@dataclass(frozen=True)
class Score:
    """Of one map; visible is what both views see, or all known pixels without a right truth."""

    bad_1: float
    density: float
    occluded_px: float
    occluded_density: float


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "folder", nargs="?", default=os.environ.get("NAVAPP_DATA", "../shared/data")
    )
    stereo = Path(parser.parse_args().folder) / "stereo"
    print("| pair | preset | bad-1 | density | occluded px | density | fill adds to bad-1 |")
    print("|---|---|---|---|---|---|---|")
    limit = chains._WIDE_SEARCH_PX
    for known in (CONES, ALOE):
        own = "wide" if known.n_disparities > limit else "narrow"
        for preset, switch in (("narrow", 10**6), ("wide", 0)):
            chains._WIDE_SEARCH_PX = switch
            answer = matched(stereo, known)
            score = score_of(stereo, known, answer.disparity.disparity_px)
            print(
                f"| {known.name} | {preset}{' (its own)' if preset == own else ''} "
                f"| {score.bad_1:.4f} | {score.density:.2f} | {score.occluded_px:.2f} "
                f"| {score.occluded_density:.2f} | {added_by_fill(stereo, known, answer):+.4f} |",
                flush=True,
            )
    chains._WIDE_SEARCH_PX = limit


def matched(stereo: Path, known: Known) -> StereoAnswer:
    """The pair through the chain that the command line uses without a rig."""
    left, right = (luma(cv2.imread(str(stereo / known.name / name))) for name in known.files)
    height, width = left.shape
    nowhere = RigidTransform.identity("left_rect", "left")
    geometry = RectifiedGeometry(1.0, 0.0, 0.0, 1.0, width, height, nowhere)
    pair = RectifiedPair(left, right, geometry, Box(0, 0, width, height))
    return match_scene(pair, (0.0, known.n_disparities - 1.0), fills=True)


def score_of(stereo: Path, known: Known, found_px: np.ndarray) -> Score:
    """Compare a map with the truth."""
    truth, visible = truth_of(stereo, known)
    occluded = np.isfinite(truth) & ~visible
    error, has = np.abs(found_px - truth), np.isfinite(found_px)
    is_any = bool(occluded.any())
    return Score(
        float((error[visible & has] > 1.0).mean()),
        float(has[visible].mean()),
        float(error[occluded & has].mean()) if is_any else np.nan,
        float(has[occluded].mean()) if is_any else np.nan,
    )


def added_by_fill(stereo: Path, known: Known, answer: StereoAnswer) -> float:
    """By how much the fill raises bad-1 on the visible pixels that were matched before it."""
    truth, visible = truth_of(stereo, known)
    judged = visible & np.isfinite(answer.matched.disparity_px)
    before, after = (
        (np.abs(each.disparity_px - truth)[judged] > 1.0).mean()
        for each in (answer.matched, answer.disparity)
    )
    return float(after - before)


def truth_of(stereo: Path, known: Known) -> tuple[np.ndarray, np.ndarray]:
    """(h, w) left disparity px, NaN unknown; and which pixels the right view sees, too."""
    truth, *other = (
        cv2.imread(str(stereo / known.name / name), cv2.IMREAD_GRAYSCALE) / known.scale
        for name in known.truths
    )
    truth[truth <= 0.0] = np.nan
    visible = np.isfinite(truth)
    if other:
        rows, columns = np.indices(truth.shape)
        partner = np.rint(columns - np.nan_to_num(truth)).astype(int)
        visible &= (partner >= 0) & (partner < truth.shape[1])
        seen = other[0][rows, np.clip(partner, 0, truth.shape[1] - 1)]
        visible &= (seen > 0.0) & (np.abs(seen - truth) <= 1.0)
    return truth, visible


if __name__ == "__main__":
    main()
