"""Time of the occlusion steps, classify and fill, beside OpenCV's WLS filter.

usage: python -m tests.bench.occlusion_speed [--repetitions N]

On a seeded scene: near ellipses before a slanted wall, with what one camera cannot see and specks
without a match. The steps take turns, medians of wall time, for one and for two threads on both
sides. The filter (with confidence, from left and right maps, lambda 8000, sigma 1.5, the same
picture) is only in the wheel with the contributed modules, which excludes the plain one: `make
bench-peers` makes an environment of its own for it, or by hand

    python -m venv peers
    peers/bin/pip install opencv-contrib-python-headless numpy numba scipy
    peers/bin/python -m tests.bench.occlusion_speed
"""

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np

from navapp.geometry import bands
from navapp.stereo.occlusion.classify import classify
from navapp.stereo.occlusion.wls_fill import fill_wls
from navapp.values import DisparityMap, Origin

_WIDTH, _HEIGHT = 1280, 720
_BOX = (slice(150, 570), slice(500, 920))
_WHOLE = (slice(0, _HEIGHT), slice(0, _WIDTH))
_WALL_PX, _N_NEAR, _NEARER_PX = 160.0, 14, (15.0, 60.0)
_SPECKS, _SPECK_SIGMA_PX = 0.1, 2.0
_WLS_LAMBDA, _WLS_SIGMA, _WLS_EDGE_RADIUS_PX = 8000.0, 1.5, 2
_REPETITIONS = 15


@dataclass(frozen=True)
class Matched:
    """What a matcher hands over, cut to a part of the frame."""

    left: DisparityMap
    right_px: np.ndarray
    right_x0: int
    picture: np.ndarray
    confidence: np.ndarray


def main() -> None:
    """Print one line for each part of the frame and number of threads."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repetitions", type=int, default=_REPETITIONS)
    repetitions = parser.parse_args().repetitions
    print("| pixels | threads | classify ms | fill ms | WLS filter ms | ratio |")
    print("|---|---|---|---|---|---|")
    for part in (_BOX, _WHOLE):
        scene = matched_scene(part)
        height, width = scene.left.disparity_px.shape
        for n_threads in (1, 2):
            use_threads(n_threads)
            times = median_ms(steps_of(scene), repetitions)
            filter_ms = times.get("filter")
            peer = "- | -"
            if filter_ms is not None:
                peer = f"{filter_ms:.1f} | {(times['classify'] + times['fill']) / filter_ms:.2f}"
            print(
                f"| {width}x{height} | {n_threads} | {times['classify']:.1f} | "
                f"{times['fill']:.1f} | {peer} |",
                flush=True,
            )


def matched_scene(part: tuple[slice, slice], seed: int = 0) -> Matched:
    """The scene as a good matcher sees it."""
    rng = np.random.default_rng(seed)
    true = true_disparity(rng)
    rows, columns = np.mgrid[:_HEIGHT, :_WIDTH]
    partner = np.rint(columns - true).astype(int)
    inside = partner >= 0
    right = np.full(true.shape, -np.inf, dtype=np.float32)
    np.maximum.at(right, (rows[inside], partner[inside]), true[inside])
    right[np.isinf(right)] = np.nan
    is_seen = inside & (np.abs(right[rows, np.maximum(partner, 0)] - true) <= 1.0)
    specks = cv2.GaussianBlur(rng.standard_normal(true.shape), (0, 0), _SPECK_SIGMA_PX)
    is_seen &= specks > np.quantile(specks, _SPECKS)
    noise = cv2.GaussianBlur(rng.standard_normal(true.shape), (0, 0), 1.5)
    picture = 90.0 + 0.8 * (true - _WALL_PX) + 60.0 * noise
    left = DisparityMap(
        np.where(is_seen, true, np.float32(np.nan))[part].copy(),
        np.where(is_seen, np.float32(0.2), np.float32(np.nan))[part].copy(),
        np.where(is_seen, np.uint8(Origin.MATCHED), np.uint8(Origin.UNKNOWN))[part].copy(),
        part[1].start,
        part[0].start,
    )
    return Matched(
        left,
        right[part[0]].copy(),
        0,
        np.clip(picture, 0, 255).astype(np.uint8)[part].copy(),
        rng.random(true.shape, dtype=np.float32)[part].copy(),
    )


def true_disparity(rng: np.random.Generator) -> np.ndarray:
    """(h, w) float32 of the left view."""
    rows, columns = np.mgrid[:_HEIGHT, :_WIDTH].astype(np.float32)
    true = _WALL_PX + 0.01 * columns + 0.02 * rows
    for _ in range(_N_NEAR):
        x, y = rng.uniform(0, _WIDTH), rng.uniform(0, _HEIGHT)
        radius_x, radius_y = rng.uniform(30.0, 140.0, 2)
        inside = ((columns - x) / radius_x) ** 2 + ((rows - y) / radius_y) ** 2 < 1.0
        nearer = _WALL_PX + 15.0 + rng.uniform(*_NEARER_PX) + 0.03 * (columns - x)
        true = np.where(inside, np.maximum(true, nearer), true)
    return true.astype(np.float32)


def steps_of(scene: Matched) -> dict[str, Callable[[], object]]:
    """Every step by name, each on the result of the one before."""

    def label() -> np.ndarray:
        return classify(scene.left, scene.right_px, scene.right_x0, _WIDTH, scene.picture)

    classes = label()

    def fill() -> DisparityMap:
        return fill_wls(scene.left, scene.picture, scene.confidence, classes)

    filled = fill()
    steps: dict[str, Callable[[], object]] = {
        "classify": label,
        "fill": fill,
    }
    if hasattr(cv2, "ximgproc"):
        steps["filter"] = peer_filter(filled, scene.picture)
    return steps


def peer_filter(filled: DisparityMap, picture: np.ndarray) -> Callable[[], object]:
    """OpenCV's filter with confidence, in sixteenths of a pixel; any right map takes as long."""
    wls = cv2.ximgproc.createDisparityWLSFilterGeneric(True)
    wls.setLambda(_WLS_LAMBDA)
    wls.setSigmaColor(_WLS_SIGMA)
    wls.setDepthDiscontinuityRadius(_WLS_EDGE_RADIUS_PX)
    left = np.rint(16.0 * np.nan_to_num(filled.disparity_px)).astype(np.int16)
    return lambda: wls.filter(left, picture, None, -left)


def use_threads(n: int) -> None:
    """So many on both sides."""
    cv2.setNumThreads(n)
    # Alone, or with the helper beside.
    bands._here.is_alone = n == 1


def median_ms(steps: dict[str, Callable[[], object]], repetitions: int) -> dict[str, float]:
    """Median wall time of steps that take turns."""
    times: dict[str, list[float]] = {name: [] for name in steps}
    for repetition in range(repetitions + 1):
        for name, step in steps.items():
            started = time.perf_counter()
            step()
            # The first call compiles.
            if repetition:
                times[name].append(1e3 * (time.perf_counter() - started))
    return {name: float(np.median(values)) for name, values in times.items()}


if __name__ == "__main__":
    main()
