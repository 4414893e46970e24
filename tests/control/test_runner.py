import math
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numba
from numba.core import event

from navapp.control.commands import (
    Accept,
    Quit,
    Register,
)
from navapp.control.runner import SessionRunner, run_headless
from navapp.control.scripted_operator import ScriptedOperator
from navapp.errors import DeviceLost, DeviceNotFound
from tests.control.fakes import Bench, wait_for


def pipeline_threads() -> list[threading.Thread]:
    return [thread for thread in threading.enumerate() if thread.name == "pipeline"]


def test_a_runner_turns_the_crank_and_leaves_no_thread() -> None:
    bench = Bench()
    runner = SessionRunner(bench.controller)
    runner.start()
    wait_for(lambda: runner.snapshot().state.value == "ready", "readiness")
    runner.submit(Register())
    wait_for(lambda: runner.snapshot().state.value == "review", "review")
    runner.submit(Accept(None))
    wait_for(lambda: runner.snapshot().is_navigable, "navigation")
    runner.stop()
    runner.stop()
    assert pipeline_threads() == []
    assert bench.is_dark
    assert runner.error is None
    assert runner.snapshot().state.value == "offline"
    assert not runner.snapshot().is_navigable


def test_quitting_ends_the_thread_by_itself() -> None:
    bench = Bench()
    runner = SessionRunner(bench.controller)
    runner.start()
    runner.submit(Quit())
    wait_for(lambda: pipeline_threads() == [], "the end of the thread")
    assert runner.snapshot().is_over
    runner.stop()


def test_an_error_in_the_thread_is_kept_and_the_display_is_dark() -> None:
    bench = Bench()
    runner = SessionRunner(bench.controller)
    runner.start()
    wait_for(lambda: not bench.is_dark, "a picture")
    bench.camera.error = ZeroDivisionError("a driver's bug")
    wait_for(lambda: pipeline_threads() == [], "the end of the thread")
    assert isinstance(runner.error, ZeroDivisionError)
    assert bench.is_dark
    assert not bench.camera.is_open
    runner.stop()


def test_a_runner_that_never_started_closes_the_devices() -> None:
    bench = Bench()
    bench.frames(1)
    SessionRunner(bench.controller).stop()
    assert bench.is_dark
    assert not bench.camera.is_open


def test_a_headless_run_ends_when_the_camera_stays_away() -> None:
    bench = Bench()
    bench.frames(1)
    bench.camera.error = DeviceLost("unplugged")
    bench.camera.opening_error = DeviceNotFound("still unplugged")
    last = run_headless(bench.controller, ScriptedOperator())
    assert last.state.value == "fault"
    assert isinstance(bench.controller.lost_device, DeviceLost)
    assert 9.0 < (last.time_ns - bench.results[-1].frame.captured_ns) / 1e9 < 14.0


def test_stopping_a_runner_darkens_the_display_before_it_waits(monkeypatch) -> None:
    bench = Bench()
    runner = SessionRunner(bench.controller)
    order = []
    monkeypatch.setattr(bench.controller, "darken", lambda: order.append("dark"))
    monkeypatch.setattr(bench.controller, "close", lambda: order.append("closed"))
    runner.stop()
    assert order == ["dark", "closed"]


def test_a_kernel_that_is_compiled_is_told_while_the_step_hangs() -> None:
    bench = Bench()
    runner = SessionRunner(bench.controller)
    runner.start()
    wait_for(lambda: runner.snapshot().state.value == "ready", "readiness")
    assert runner.snapshot().progress is None
    started, done = threading.Event(), threading.Event()

    def compile_slowly() -> None:
        started.set()
        done.wait(10.0)

    with told_compilation(compile_slowly):
        started.wait(10.0)
        progress = runner.snapshot().progress
        done.set()
    assert progress is not None
    assert progress.what == "compiling kernels, once on a machine: 1 so far"
    assert math.isnan(progress.share)
    assert runner.snapshot().progress is None
    runner.stop()


@contextmanager
def told_compilation(work: Callable[[], None]) -> Iterator[None]:
    """A thread that does some work as numba does while it compiles."""
    kernel = numba.njit(lambda number: number)

    def run() -> None:
        with event.trigger_event("numba:compile", data={"dispatcher": kernel}):
            work()

    thread = threading.Thread(target=run)
    thread.start()
    yield
    thread.join()
