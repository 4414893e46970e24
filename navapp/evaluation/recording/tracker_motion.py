"""Poses of another tracker between its samples, and the halves of a recording."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from navapp.evaluation.recording.truth_files import TrackerTruth
from navapp.geometry.transform import FloatArray

# A marker that was not seen for longer than this is not known in between.
_MOST_GAP_S = 0.15
# The recording is cut into blocks of a second. What lies so near to a border is neither solved with
# nor scored: tracking makes neighbouring frames alike.
_BLOCK_S, _GUARD_S = 1.0, 0.1
_DRAWING_SEED = 7


class TrackerMotion:
    """The marker's motion: turns by slerp, places on straight lines between samples.

    Args:
        truth: at least two poses.
    """

    def __init__(self, truth: TrackerTruth) -> None:
        from scipy.spatial.transform import Rotation, Slerp

        self._origin_ns = int(truth.times_ns[0])
        self._times_s = (truth.times_ns - self._origin_ns) * 1e-9
        self._turns = Slerp(self._times_s, Rotation.from_matrix(truth.matrices[:, :3, :3]))
        self._places_mm = truth.matrices[:, :3, 3]

    @property
    def length_s(self) -> float:
        """From the first to the last sample."""
        return float(self._times_s[-1])

    @property
    def origin_ns(self) -> int:
        """The first sample's time, which all others are counted from."""
        return self._origin_ns

    def knows(self, times_s: FloatArray) -> NDArray[np.bool_]:
        """Which times (N,) lie between two samples that are near to each other."""
        after = np.searchsorted(self._times_s, times_s, side="right")
        inside = (after > 0) & (after < len(self._times_s))
        after = np.clip(after, 1, len(self._times_s) - 1)
        known: NDArray[np.bool_] = inside & (
            self._times_s[after] - self._times_s[after - 1] <= _MOST_GAP_S
        )
        return known

    def at(self, times_s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(N, 3, 3) rotations and (N, 3) places in mm, tracker from marker."""
        times_s = np.clip(times_s, 0.0, self._times_s[-1])
        places = [np.interp(times_s, self._times_s, column) for column in self._places_mm.T]
        return self._turns(times_s).as_matrix(), np.column_stack(places)


def to_seconds(times_ns: Sequence[int], origin_ns: int) -> FloatArray:
    """(N,) s since an origin; a clock's whole nanoseconds are too long for a float."""
    since_s: FloatArray = np.array([int(time_ns) - origin_ns for time_ns in times_ns]) * 1e-9
    return since_s


@dataclass(frozen=True, slots=True, eq=False)
class Halves:
    """What each picture of a recording is for."""

    blocks: NDArray[np.int64]  # (N,) the second that it lies in
    is_to_solve: NDArray[np.bool_]  # (N,)
    is_to_score: NDArray[np.bool_]  # (N,)


def split_halves(since_s: FloatArray) -> Halves:
    """Of every two seconds one is to solve with and one to score, drawn in the same way every time.

    So both halves see the whole motion: of a split in the middle that would not be true, nor of
    seconds in strict turns when the bone moves to and fro in two seconds.

    Args:
        since_s: (N,) from the first picture on.
    """
    blocks = np.floor(since_s / _BLOCK_S).astype(np.int64)
    into_s = since_s - blocks * _BLOCK_S
    is_inner = (into_s >= _GUARD_S) & (into_s <= _BLOCK_S - _GUARD_S)
    drawn = np.random.default_rng(_DRAWING_SEED).integers(0, 2, int(blocks[-1]) // 2 + 1)
    is_first = blocks % 2 == drawn[blocks // 2]
    return Halves(blocks, is_inner & is_first, is_inner & ~is_first)
