"""The screen of an accuracy test on fixed snapshots: words, keys, three sizes."""

import dataclasses

import pytest

from navapp.control.accuracy_test.states import AccuracySnapshot, Back, Leave, Take
from navapp.tools.accuracy_tasks import Task
from navapp.ui.accuracy_test.app import AccuracyApp
from navapp.ui.symbols import ASCII, UNICODE
from tests.ui.guided import play_on
from tests.ui.snapshots import picture

WAITING = AccuracySnapshot(
    time_ns=1,
    camera="sim:stereo camera",
    pictures=(picture(0.0), picture(1.0)),
    task=Task("bottom", "distance", 6, 6),
    n_kept=33,
    n_tasks=130,
    share=0.25,
    is_taking=False,
    missing="",
    bound_mm=0.21,
    events=("done: divot plate at the bottom: tip in divot 6; hold still",),
    n_events=1,
)


def play(snapshot, *keys, size=(80, 24), symbols=UNICODE, then=None):
    return play_on(AccuracyApp, snapshot, *keys, size=size, symbols=symbols, then=then)


@pytest.mark.parametrize("size", [(80, 24), (160, 48), (200, 60)])
def test_everything_is_said_at_all_sizes(size):
    _, _, text = play(WAITING, size=size)
    for words in (
        "navapp accuracy-test", "sim", "33 of 130", "at the bottom: tip in divot 7; hold still",
        "press ENTER when it is so", "0.21 mm", "done: ", "ENTER take", "x the last one again",
        "q leave",
    ):  # fmt: skip
        assert words in text, words
    assert text.count("▀") > 100  # both pictures


def test_what_is_missing_stands_for_the_bound():
    missing = "no marker is seen by both cameras"
    _, _, text = play(dataclasses.replace(WAITING, missing=missing, bound_mm=None))
    assert missing in text
    assert "tip ≤" not in text


def test_the_end_is_said():
    _, _, text = play(dataclasses.replace(WAITING, task=None))
    assert "all tasks are done" in text


@pytest.mark.parametrize(("key", "command"), [("enter", Take()), ("x", Back()), ("q", Leave())])
def test_keys(key, command):
    session, _, _ = play(WAITING, key)
    assert session.commands == [command]


def test_plain_characters_alone_on_a_plain_terminal():
    _, _, text = play(WAITING, symbols=ASCII)
    assert text.isascii()


def test_a_terminal_that_is_too_small_says_so():
    _, _, text = play(WAITING, size=(60, 20))
    assert "make the terminal 80 x 24" in text
