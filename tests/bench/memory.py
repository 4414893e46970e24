"""Memory of a bone that is followed for long: it must not grow.

usage: python -m tests.bench.memory [--frames N] [--every N] [--seed N]

A simulated knee that breathes, rendered beforehand, is followed there and back for so many frames,
each drawn over its picture. One frame of each round is dark: the bone is lost, looked for and found
again. Prints the process's resident memory as it goes, and the slope of a line through all of it
but the first tenth, with its standard error.
"""

import argparse
import os
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from navapp.tracking import Goal, TrackState, make_tracker
from navapp.values import Status
from tests.bench.line_speed import Recording
from tests.pictures import Pictures

_GOAL = Goal(np.empty((0, 3)), 2.0)
_RENDERED, _FRAME_NS = 25, 66_666_667
_WARM_UP_SHARE = 0.1
_PER_MEASUREMENT = 20


@dataclass(frozen=True)
class Growth:
    """A line through memory over frames.

    Attributes:
        kib_per_1000: slope.
        sigma_kib_per_1000: its standard error, from how far the measurements lie off the line.
    """

    kib_per_1000: float
    sigma_kib_per_1000: float


def main() -> int:
    """Follow, print the memory on the way, and what it grew by."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=10_000)
    parser.add_argument("--every", type=int, default=1000, help="frames between printed lines")
    parser.add_argument("--seed", type=int, default=321)
    options = parser.parse_args()
    print("| frames | MiB | OK since |")
    print("|---|---|---|")
    recording = Recording(options.seed, _RENDERED)
    numbers, memory_kib, n_ok = [], [], 0
    for number, is_ok in followed(recording, options.frames):
        n_ok += is_ok
        if number % _PER_MEASUREMENT == 0:
            numbers.append(number)
            memory_kib.append(resident_kib())
        if number % options.every == 0:
            print(f"| {number} | {resident_kib() / 1024:.1f} | {n_ok} |", flush=True)
            n_ok = 0
    growth = growth_of(np.array(numbers, dtype=float), np.array(memory_kib, dtype=float))
    print(
        f"growth after the first tenth: {growth.kib_per_1000:.0f} KiB in 1,000 frames, "
        f"standard error {growth.sigma_kib_per_1000:.0f} KiB"
    )
    return 0


def followed(recording: Recording, n_frames: int) -> Iterator[tuple[int, bool]]:
    """Number of each frame, from 1, and whether it was OK."""
    tracker = make_tracker(recording.rig, recording.bone)
    state = TrackState.at_rest(recording.poses[0], 0)
    dark = np.zeros_like(recording.frames[0].left)
    period = 2 * _RENDERED - 2
    for number in range(1, n_frames + 1):
        place = min(number % period, period - number % period)
        frame = recording.frames[place]
        right = dark if number % period == period - 1 else frame.right
        pictures = Pictures(frame.left.copy(), right, number * _FRAME_NS)
        tracked, state = tracker.track(pictures, state, _GOAL)
        is_ok = tracked.verdict.status is Status.OK
        if is_ok and tracked.left_from_bone is not None:
            recording.overlay(place, tracked.left_from_bone)
        yield number, is_ok


def growth_of(numbers: np.ndarray, memory_kib: np.ndarray) -> Growth:
    """Slope through all measurements but the first tenth.

    Args:
        numbers: (N,) frames done.
        memory_kib: (N,) resident then.
    """
    is_warm = numbers > _WARM_UP_SHARE * numbers[-1]
    x, y = numbers[is_warm] / 1000.0, memory_kib[is_warm]
    away = x - x.mean()
    slope = float(away @ y / (away @ away))
    rest = y - y.mean() - slope * away
    sigma = float(np.sqrt(rest @ rest / max(len(x) - 2, 1) / (away @ away)))
    return Growth(slope, sigma)


def resident_kib() -> float:
    """Resident memory of this process."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1024


if __name__ == "__main__":
    sys.exit(main())
