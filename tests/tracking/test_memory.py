"""A bone that is followed for long; tests/bench/memory.py does it for longer."""

import gc
import time
import tracemalloc
import weakref
from dataclasses import replace

import numpy as np
import pytest

from navapp.geometry.bands import pool
from navapp.tracking import TrackState, make_tracker
from tests.bench.memory import growth_of
from tests.pictures import Pictures
from tests.tracking.rooms import GOAL, Room, room

N_WARM, N_MORE = 12, 24
PERIOD_NS = 66_000_000
# A picture has millions. Caches of the interpreter fill by some 1,000 at first.
LARGEST_GROWTH_BYTES_PER_FRAME = 5000


def followed(a: Room, state: TrackState, first: int, n: int) -> TrackState:
    """There and back; one frame in twelve is dark in one eye, and the bone is searched."""
    for number in range(first, first + n):
        frame = a.frames[number % len(a.frames)]
        right = np.zeros_like(frame.right) if number % 12 == 11 else frame.right
        left = frame.left.copy()  # a camera's pictures are new as well
        _, state = a.tracker.track(Pictures(left, right, number * PERIOD_NS), state, GOAL)
    return state


def settled_bytes() -> int:
    """Memory in use; what a thread holds for the moment does not count.

    The helper lets go of a job some time after its answer was fetched, and threads that earlier
    tests left behind may be at work: the least of a few looks.
    """
    looks = []
    for _ in range(5):
        pool().submit(int).result()
        gc.collect()
        looks.append(tracemalloc.get_traced_memory()[0])
        time.sleep(0.02)
    return min(looks)


@pytest.mark.release
@pytest.mark.slow
def test_nothing_is_kept_of_the_frames_that_have_passed() -> None:
    a = room()
    state = followed(a, TrackState.at_rest(a.truth(a.frames[0]), 0), 1, N_WARM)
    tracemalloc.start()
    try:
        state = followed(a, state, N_WARM + 1, N_WARM)
        before = settled_bytes()
        followed(a, state, 2 * N_WARM + 1, N_MORE)
        after = settled_bytes()
    finally:
        tracemalloc.stop()
    assert after - before < LARGEST_GROWTH_BYTES_PER_FRAME * N_MORE


def test_a_tracker_that_nobody_needs_is_gone_at_once() -> None:
    """A model and the maps of a rectifier are large; a session makes its trackers anew."""
    a = room()
    frame = a.frames[0]
    gc.collect()
    gc.disable()
    try:
        tracker = make_tracker(a.rig, a.tracker.model.bone)
        tracker.track(replace(frame, captured_ns=0), TrackState.at_rest(a.truth(frame), 0), GOAL)
        meter = weakref.ref(tracker.meter)
        del tracker
        assert meter() is None
    finally:
        gc.enable()


def test_growth_is_the_slope_after_the_first_tenth() -> None:
    frames = np.arange(20.0, 2001.0, 20.0)
    noise = np.random.default_rng(1).normal(0.0, 30.0, frames.shape)
    warming_up = np.where(frames < 200.0, -9000.0, 0.0)
    found = growth_of(frames, 4e5 + 0.25 * frames + noise + warming_up)
    assert abs(found.kib_per_1000 - 250.0) < 3.0 * found.sigma_kib_per_1000 < 60.0
    assert growth_of(frames, np.full(frames.shape, 4e5)).kib_per_1000 == pytest.approx(
        0.0, abs=1e-6
    )
