"""Looks for a board beside the frames."""

import threading

import numpy as np
import pytest

from drivers.frames import StereoFrame
from navapp.control.board_watch import BoardWatch
from navapp.control.executors import InlineExecutor, ThreadExecutor
from navapp.control.length_check import Finding
from tests.control.fakes import wait_for
from tests.control.test_length_check import Look

S = 1_000_000_000
WORST = 0.0009


def frame(captured_ns: int) -> StereoFrame:
    picture = np.zeros((4, 4), np.uint8)
    return StereoFrame(picture, picture, captured_ns, captured_ns, 0, 0, "rig")


class Looker:
    """Shows what the test says, and when it was asked."""

    def __init__(self) -> None:
        self.length: Look | None = Look(1.0)
        self.asked_s: list[float] = []
        self.takes_s = 0.0
        self.now_s = 0.0
        self.watch = BoardWatch(self, WORST, InlineExecutor(), lambda: round(self.now_s * S))

    def __call__(self, left, right) -> Look | None:
        self.asked_s.append(self.now_s)
        self.now_s += self.takes_s
        return self.length

    def run(self, from_s: float, to_s: float, step_s: float = 0.25) -> list:
        """Frames of a stretch of time; what was told of it."""
        told = []
        for self.now_s in np.arange(from_s, to_s, step_s):
            captured_ns = round(self.now_s * S)
            found = self.watch.take_over()
            if found is not None:
                told.append(found)
            self.watch.look(frame(captured_ns))
        return told


def test_it_looks_every_two_seconds_at_most() -> None:
    looker = Looker()
    looker.run(0.0, 10.0)
    assert np.diff(looker.asked_s) == pytest.approx(2.0)
    assert len(looker.asked_s) == 5


def test_a_slow_look_is_repeated_the_more_seldom() -> None:
    """It takes a second: nine more are the line's."""
    looker = Looker()
    looker.takes_s = 1.0
    looker.run(0.0, 32.0)
    assert looker.asked_s == [0.0, 10.0, 20.0, 30.0]


def test_a_take_over_that_waits_makes_no_look_slow() -> None:
    looker = Looker()
    looker.run(0.0, 30.0, step_s=1.5)
    assert np.diff(looker.asked_s) == pytest.approx(3.0)


@pytest.mark.parametrize("takes_s", [0.4, 1.2, 3.0])
def test_slow_looks_at_a_board_that_stays_add_up_to_a_check(takes_s: float) -> None:
    looker = Looker()
    looker.takes_s = takes_s
    (told,) = looker.run(0.0, 45.0 * takes_s)
    assert told.n_looks == 3
    assert told.finding is Finding.WITHIN
    assert looker.watch.newest.n_looks == 5


def test_what_was_judged_last_stays_until_the_next_is() -> None:
    looker = Looker()
    looker.run(0.0, 9.0)
    judged = looker.watch.judged
    assert judged is looker.watch.newest
    looker.length = None
    looker.run(9.0, 40.0)
    looker.length = Look(1.0001)
    looker.run(40.0, 43.0)
    assert looker.watch.judged is judged
    assert str(looker.watch.newest) == "2 of 3 looks at the board"
    looker.run(43.0, 46.0)
    assert looker.watch.judged is looker.watch.newest


def test_a_showing_is_told_once_and_the_next_one_again() -> None:
    looker = Looker()
    (first,) = looker.run(0.0, 20.0)
    assert first.n_looks == 3
    assert first.finding is Finding.WITHIN
    looker.length = None
    assert looker.run(20.0, 40.0) == []
    assert looker.watch.newest.captured_ns < 20 * S
    looker.length = Look(1.0001)
    (second,) = looker.run(40.0, 60.0)
    # Nothing of the first showing is in it.
    assert second.ratio == pytest.approx(1.0001)


def test_a_length_that_is_off_is_a_doubt_after_three_looks_and_told_after_six() -> None:
    looker = Looker()
    looker.length = Look(1.0012)
    told = looker.run(0.0, 20.0)
    assert [(one.n_looks, one.finding) for one in told[:2]] == [
        (3, Finding.DOUBTFUL),
        (5, Finding.OFF),
    ]
    assert looker.asked_s[5] == 10.0


def test_one_wrong_look_among_good_ones_is_no_alarm() -> None:
    looker = Looker()
    looker.run(0.0, 9.0)
    looker.length = Look(1.004)
    assert not any(one.finding is Finding.OFF for one in looker.run(9.0, 11.6))
    looker.length = Look(1.0)
    assert not any(one.finding is Finding.OFF for one in looker.run(11.6, 60.0))
    assert len(looker.asked_s) > 15


def test_nothing_waits_for_a_look_that_hangs() -> None:
    gate, began = threading.Event(), threading.Event()

    def hang(left, right) -> Look:
        began.set()
        gate.wait(10.0)
        return Look(1.0)

    watch = BoardWatch(hang, WORST, ThreadExecutor("rig watch"), lambda: 0)
    try:
        watch.look(frame(0))
        assert began.wait(5.0)
        for k in range(1, 100):
            assert watch.take_over() is None
            watch.look(frame(k * S))
        assert watch.newest is None
        gate.set()
        wait_for(lambda: watch.take_over() is not None or watch.newest is not None, "the look")
    finally:
        gate.set()
        watch.close()


def test_a_bug_in_the_look_is_not_hidden() -> None:
    def bug(left, right):
        raise ZeroDivisionError

    watch = BoardWatch(bug, WORST, InlineExecutor(), lambda: 0)
    watch.look(frame(0))
    with pytest.raises(ZeroDivisionError):
        watch.take_over()
