"""The line to the display: one that is lost comes back by itself, and no frame waits for it."""

import threading
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from drivers.clock import ManualClock
from drivers.fixed_mirror import FixedMirror
from drivers.interfaces import MirrorInfo
from navapp.control import display_link
from navapp.control.display_link import DisplayLink
from navapp.errors import DeviceNotFound
from sim_devices.display import SimulatedDisplay
from tests.control.fakes import Bench

PICTURE = np.full((24, 40, 3), 9, np.uint8)


class Cable(SimulatedDisplay):
    """A display that can be unplugged; opening takes as long as `gate` is closed."""

    def __init__(self) -> None:
        super().__init__(ManualClock(), 40, 24)
        self.is_plugged = True
        self.gate = threading.Event()
        self.gate.set()
        self.n_attempts = 0
        self.bug: Exception | None = None

    def unplug(self) -> None:
        self.is_plugged = False
        self.close()

    def open(self) -> None:
        self.n_attempts += 1
        self.gate.wait(5.0)
        if self.bug is not None:
            raise self.bug
        if not self.is_plugged:
            raise DeviceNotFound("no such output")
        super().open()


@pytest.fixture
def cable(monkeypatch) -> Cable:
    monkeypatch.setattr(display_link, "_PAUSES_S", (0.01, 8.0))
    display = Cable()
    display.open()
    return display


def shown(link: DisplayLink) -> bool:
    """Whether the display shows the picture that it is given."""
    link.show(PICTURE, 10**12, has_guides=True)
    display = link.display
    assert isinstance(display, Cable)
    return bool(display.visible_image().any())


def wait_until(is_so: Callable[[], bool]) -> None:
    end_s = time.monotonic() + 5.0
    while not is_so():
        assert time.monotonic() < end_s
        time.sleep(0.005)


def test_a_display_that_is_plugged_in_again_shows_again(cable) -> None:
    link = DisplayLink(cable)
    assert shown(link)
    cable.unplug()
    assert link.show(PICTURE, 10**12, has_guides=True)
    wait_until(lambda: not shown(link) and cable.n_attempts > 3)
    assert "not open" in link.trouble
    cable.is_plugged = True
    wait_until(lambda: shown(link))
    assert link.trouble == ""
    link.close()
    assert not cable.visible_image().any()


def test_nobody_waits_for_a_display_that_opens_slowly(cable) -> None:
    link = DisplayLink(cable)
    cable.unplug()
    cable.gate.clear()
    assert not shown(link)
    wait_until(lambda: cable.n_attempts == 2)
    begin_s = time.monotonic()
    assert not shown(link)
    link.blank()
    assert time.monotonic() - begin_s < 1.0
    assert cable.n_attempts == 2
    cable.is_plugged = True
    cable.gate.set()
    wait_until(lambda: not link._reopener.is_under_way)
    assert not shown(link)
    link.show_again()
    assert shown(link)
    link.close()


def test_a_bug_in_opening_is_told_once_and_does_not_end_the_attempts(cable) -> None:
    link = DisplayLink(cable)
    cable.unplug()
    cable.bug = RuntimeError("a bug")
    tellings = [""]

    def is_told_and_tried(n_attempts: int) -> bool:
        if link.show(PICTURE, 10**12, has_guides=True):
            tellings.append(link.trouble)
        return cable.n_attempts >= n_attempts

    wait_until(lambda: is_told_and_tried(5))
    assert [text for text in tellings if "RuntimeError('a bug')" in text] == tellings[2:]
    assert len(tellings) == 3
    cable.bug, cable.is_plugged = None, True
    wait_until(lambda: shown(link))
    assert link.trouble == ""
    link.close()


def test_after_the_end_it_is_not_opened_any_more(cable) -> None:
    link = DisplayLink(cable)
    cable.unplug()
    link.close()
    assert not shown(link)
    assert cable.n_attempts == 1
    assert not link._reopener.is_under_way


class MovableMirror(FixedMirror):
    """Stands where it should, and says when it is stopped."""

    def __init__(self) -> None:
        super().__init__(45.0)
        self.stopped = threading.Event()

    @property
    def info(self) -> MirrorInfo:
        return replace(super().info, is_movable=True)

    def stop(self) -> None:
        self.stopped.set()


def test_a_display_that_takes_long_to_open_keeps_no_device_from_being_stopped(cable) -> None:
    mirror = MovableMirror()
    bench = Bench(mirror=mirror, make_display=lambda clock, width, height: cable)
    bench.frames(1)
    cable.unplug()
    cable.gate.clear()
    n_attempts = cable.n_attempts
    wait_until(lambda: bool(bench.frames(1)) and cable.n_attempts > n_attempts)
    ending = threading.Thread(target=bench.controller.close)
    ending.start()
    try:
        assert mirror.stopped.wait(2.0)
        assert ending.is_alive()
    finally:
        cable.gate.set()
        ending.join()
