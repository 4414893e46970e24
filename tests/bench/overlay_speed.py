"""Time of one overlay with all layers of the implant stage, over the video and for the mirror.

usage: python -m tests.bench.overlay_speed [--frames N] [--layers NAME,...]

A simulated knee in the left picture of 1280x720, and the same guides for a display of 1920x1080 in
the mirror. The depth around the bone comes with the tracker's answer; what is drawn from it counts.
The memory that the drawing keeps is told from the first hundred pictures to the last.
"""

import argparse
import resource
import sys
import time
from collections.abc import Callable

import numpy as np

from navapp.config import load
from navapp.control.stages import STAGES
from navapp.devices import OpenedDevices, open_live
from navapp.devices.simulated_mirror import true_display
from navapp.devices.simulated_plan import make_built_in_plan
from navapp.overlay import (
    LAYERS,
    LeftView,
    MirrorView,
    Scene,
    Viewpoint,
    compose_mirror,
    compose_video,
)
from navapp.tracking import Goal, TrackState, make_tracker
from sim_devices.mirror_setups import draw_setup
from tests.bench.occlusion_speed import use_threads

_LIMITS_MS = {"video": 4.0, "mirror": 8.0}
_SETUP_SEED = 3100


def main() -> int:
    """Print a row for each mode; 1 when a limit is missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=200)
    parser.add_argument("--layers", default="")
    options = parser.parse_args()
    layers = tuple(options.layers.split(",")) if options.layers else tuple(LAYERS)
    opened = open_live(load(None), is_headless=True)
    draws = _draws(opened, layers)
    opened.devices.close()
    print("| mode | picture | ms p50 | ms p95 | processor ms | limit | memory grows MB |")
    print("|---|---|---|---|---|---|---|")
    is_good = True
    for mode, draw in draws.items():
        for _ in range(10):
            draw()
        before_mb, took_ms = _memory_mb(), []
        began_cpu = time.process_time()
        for _ in range(options.frames):
            began = time.perf_counter()
            image = draw()
            took_ms.append((time.perf_counter() - began) * 1e3)
        cpu_ms = (time.process_time() - began_cpu) * 1e3 / options.frames
        p50, p95 = np.percentile(took_ms, [50, 95])
        grown_mb = _memory_mb() - before_mb
        is_good &= bool(p50 <= _LIMITS_MS[mode])
        size = f"{image.shape[1]}x{image.shape[0]}"
        times = f"{p50:.2f} | {p95:.2f} | {cpu_ms:.2f} | {_LIMITS_MS[mode]}"
        print(f"| {mode} | {size} | {times} | {grown_mb:.1f} |")
    return 0 if is_good else 1


def _draws(opened: OpenedDevices, layers: tuple[str, ...]) -> dict[str, Callable[[], np.ndarray]]:
    """What draws the pictures of one followed frame, by mode."""
    assert opened.simulation is not None
    plan = make_built_in_plan(opened.simulation)
    frame = opened.devices.camera.read(1.0)
    truth = opened.simulation.oracle.left_from_body("femur", frame.captured_ns)
    state = TrackState.at_rest(truth, frame.captured_ns)
    tracker = make_tracker(opened.rig, plan.bones["femur"])
    goal = Goal(np.empty((0, 3)), 2.0)
    tracked, _ = tracker.track(frame, state, goal)
    pose = tracked.left_from_bone
    assert pose is not None
    eye_view = true_display(draw_setup(np.random.default_rng(_SETUP_SEED))).view()
    stage = plan.stage(STAGES[2])

    def scene(view: Viewpoint) -> Scene:
        # Anew each time: what a scene finds out belongs to its frame.
        return Scene(plan, stage, pose, view, False, tracked.foreground, layers)

    left_view, mirror_view = LeftView(opened.rig), MirrorView(eye_view, opened.rig)
    return {
        "video": lambda: compose_video(frame.left, scene(left_view), "NAVIGATING"),
        "mirror": lambda: compose_mirror(
            scene(mirror_view), eye_view, "NAVIGATING", is_guiding=True
        ),
    }


def _memory_mb() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


if __name__ == "__main__":
    use_threads(2)
    sys.exit(main())
