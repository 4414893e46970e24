"""The thread of a guided calibration: it ends with it, and keeps what ended it."""

import time

import pytest

from navapp.control.capture.states import CapturePhase, Leave
from navapp.control.guided_runner import GuidedRunner
from navapp.errors import DeviceLost
from tests.control.capture.rooms import Room, capture_in


def over(runner: GuidedRunner, limit_s: float = 20.0) -> bool:
    end = time.monotonic() + limit_s
    while not runner.is_over and time.monotonic() < end:
        time.sleep(0.01)
    return runner.is_over


@pytest.fixture
def room() -> Room:
    return Room()


def test_it_ends_when_it_is_left(room):
    runner = GuidedRunner(capture_in(room), "capture")
    runner.start()
    runner.submit(Leave())
    assert over(runner)
    runner.stop()
    runner.stop()
    assert runner.error is None
    assert runner.snapshot().phase is CapturePhase.OVER


def test_a_lost_camera_ends_it_and_is_told(room, monkeypatch):
    def lost(timeout_s):
        raise DeviceLost("the camera is gone")

    monkeypatch.setattr(room, "read", lost)
    runner = GuidedRunner(capture_in(room), "capture")
    runner.start()
    assert over(runner)
    runner.stop()
    assert isinstance(runner.error, DeviceLost)
