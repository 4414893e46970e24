"""How many modules a frame passes through, printed as two figures and a table.

usage: python -m tests.bench.frame_walk [--calls]

Counted are the calls from one module of `navapp` into another, and the modules so entered, while a
bone that lies in the open is followed into one frame with the answer OK, on both threads. Kernels,
properties and value classes (frozen dataclasses, named tuples, enumerations) do not count; a call
through another library counts from the last module of `navapp` before it, one at the root of a
thread as well. With --calls each pair of modules has a line.
"""

import argparse
import dataclasses
import enum
import functools
import sys
import threading
from collections import Counter
from collections.abc import Callable
from types import CodeType, FrameType
from typing import Any

import numpy as np

from navapp.geometry.bands import pool
from navapp.tracking import Goal, TrackState, make_tracker
from navapp.values import Status
from sim_devices.scenario import Scenario
from tests.knees import SimulatedKnee

_SEED = 5
# Frames followed before the one that is counted: everything that is made once is made.
_WARM_FRAMES = 3


def main() -> None:
    """Count, and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--calls", action="store_true", help="a line for each pair of modules")
    options = parser.parse_args()
    walk = walked_frame()
    print(f"modules entered: {len(walk.modules)}")
    print(f"calls from one module into another: {sum(walk.calls.values())}")
    if options.calls:
        for (caller, callee), n in sorted(walk.calls.items(), key=lambda one: -one[1]):
            print(f"{n:4d}  {caller} -> {callee}")


class Walk:
    """Counts calls between modules while it is on; to be set as the profiler of each thread."""

    def __init__(self) -> None:
        self.calls: Counter[tuple[str, str]] = Counter()
        self.is_on = False
        self._counts: dict[CodeType, bool] = {}
        self._lock = threading.Lock()

    def __call__(self, frame: FrameType, event: str, argument: object) -> None:
        """A profiler's event."""
        if event != "call" or not self.is_on:
            return
        name = frame.f_globals.get("__name__", "")
        if not name.startswith("navapp.") or not self._is_counted(frame, name):
            return
        caller = _navapp_caller(frame)
        if caller != name:
            with self._lock:
                self.calls[caller, name] += 1

    @property
    def modules(self) -> set[str]:
        """Those that were entered from another one."""
        return {callee for _, callee in self.calls}

    def _is_counted(self, frame: FrameType, name: str) -> bool:
        code = frame.f_code
        if code not in self._counts:
            self._counts[code] = not (
                name.endswith("_kernels")
                or code.co_filename == "<string>"
                or _is_of_value(sys.modules[name], code.co_qualname)
            )
        return self._counts[code]


def _navapp_caller(frame: FrameType) -> str:
    """The nearest caller's module in navapp; empty at the root of a thread."""
    caller = frame.f_back
    while caller is not None:
        name: str = caller.f_globals.get("__name__", "")
        if name.startswith("navapp."):
            return name
        caller = caller.f_back
    return ""


def _is_of_value(module: Any, qualified_name: str) -> bool:
    """A property, a method of a value class, or a function inside one of them."""
    *owners, name = qualified_name.split(".<locals>")[0].split(".")
    owner: Any = module
    for part in owners:
        owner = getattr(owner, part, None)
    if not isinstance(owner, type):
        return False
    if isinstance(vars(owner).get(name), property | functools.cached_property):
        return True
    is_frozen = dataclasses.is_dataclass(owner) and owner.__dataclass_params__.frozen
    return is_frozen or hasattr(owner, "_fields") or issubclass(owner, enum.Enum)


def walked_frame() -> Walk:
    """Follow a simulated knee and count in the last frame."""
    knee = SimulatedKnee(Scenario(seed=_SEED, motion="breathing"))
    frames = knee.frames(2 + _WARM_FRAMES)
    tracker, goal = make_tracker(knee.rig, knee.bone), Goal(np.empty((0, 3)), 2.0)
    first = frames[0]
    best = tracker.register(first, knee.prior, goal)[0]
    assert best.left_from_bone is not None
    state = TrackState.at_rest(best.left_from_bone, first.captured_ns)
    for frame in frames[1:-1]:
        _, state = tracker.track(frame, state, goal)
    walk, last = Walk(), frames[-1]
    _on_both_threads(lambda: sys.setprofile(walk))
    walk.is_on = True
    tracked, _ = tracker.track(last, state, goal)
    walk.is_on = False
    _on_both_threads(lambda: sys.setprofile(None))
    assert tracked.verdict.status is Status.OK, tracked.verdict
    return walk


def _on_both_threads(job: Callable[[], None]) -> None:
    pool().submit(job).result()
    job()


if __name__ == "__main__":
    main()
