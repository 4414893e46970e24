"""The alignment's screen on fixed snapshots: words, keys, both sizes."""

import dataclasses

import numpy as np
import pytest

from navapp.control.commands import NudgeCross
from navapp.control.mirror_alignment.states import (
    AlignmentPhase,
    AlignmentSnapshot,
    Another,
    Confirm,
    DisplayVerdict,
    Follow,
    Leave,
    MoveHand,
    Save,
    TurnArrows,
    Undo,
)
from navapp.ui.mirror_alignment.app import AlignmentApp
from navapp.ui.symbols import ASCII, UNICODE
from tests.ui.guided import play_on


def picture(level: int) -> np.ndarray:
    y, x = np.mgrid[0:128, 0:192]
    return np.dstack([(x + y + level) % 200] * 3).astype(np.uint8)


USED = np.array([[0, 1, 0], [2, 4, 0], [0, 0, 0]])
ALIGNING = AlignmentSnapshot(
    time_ns=1,
    phase=AlignmentPhase.ALIGNING,
    camera="sim:stereo camera",
    display="sim:display",
    eye="right",
    has_hand=True,
    is_following=True,
    pictures=(picture(0), picture(40)),
    has_eye=True,
    n_seen=(70, 64, 70),
    corner=17,
    row_column=(3, 4),
    cross_px=(912, 533),
    flips=(True, False),
    is_upside_down=False,
    moved_mm=0.12,
    is_still=True,
    instruction="move the cross onto row 3, column 4, then ENTER",
    n_kept=7,
    n_depths=2,
    range_mm=41.0,
    used=USED,
    verdict=None,
    events=tuple(f"alignment {k} is kept: row 1, column {k}" for k in range(1, 8)),
)
change = dataclasses.replace
REFUSED = DisplayVerdict(0.72, False, ("the error is 0.72 mm, 0.60 mm are allowed",), 12, (3,), 1.2)
ENOUGH = change(
    ALIGNING, n_kept=13, n_depths=4, range_mm=88.0,
    verdict=DisplayVerdict(0.52, True, (), 13, (), 0.8),
    instruction="this is enough: s saves; or move the cross onto row 3, column 4, then ENTER",
)  # fmt: skip


def play(snapshot, *keys, size=(80, 24), symbols=UNICODE, then=None):
    return play_on(AlignmentApp, snapshot, *keys, size=size, symbols=symbols, then=then)


@pytest.mark.parametrize("size", [(80, 24), (160, 48)])
def test_everything_is_said_at_both_sizes(size):
    _, _, text = play(ALIGNING, size=size)
    for words in (
        "navapp calibrate mirror", "sim", "display, right eye", "7 of 12 crosses", "ALIGN",
        "left camera: row 3, column 4", "what the eye sees",
        "move the cross onto row 3, column 4, then ENTER", "912, 533 px", "70 64 of 70",
        "at rest, moved 0.1 mm", "text upright", "-.-- mm at the anatomy, 95 %, enough at 0.60",
        "2 of 3, 41 of 60 mm", "2  4", "alignment 7 is kept", "arrows 1 px",
        "SHIFT or ijkl 10 px", "ENTER confirm", "u undo", "n other", "s save",
        "x swap left-right", "y swap up-down", "q leave", "m let go", "PgUp PgDn board",
    ):  # fmt: skip
        assert words in text, words
    assert text.count("▀") > 100  # both pictures


@pytest.mark.parametrize(
    ("key", "command"),
    [
        ("left", NudgeCross(-1, 0)),
        ("right", NudgeCross(1, 0)),
        ("up", NudgeCross(0, -1)),
        ("down", NudgeCross(0, 1)),
        ("shift+left", NudgeCross(-10, 0)),
        ("shift+down", NudgeCross(0, 10)),
        ("j", NudgeCross(-10, 0)),
        ("i", NudgeCross(0, -10)),
        ("k", NudgeCross(0, 10)),
        ("l", NudgeCross(10, 0)),
        ("enter", Confirm()),
        ("backspace", Undo()),
        ("u", Undo()),
        ("n", Another()),
        ("x", TurnArrows(columns=True)),
        ("y", TurnArrows(rows=True)),
        ("q", Leave()),
        ("m", Follow(False)),
        ("pagedown", MoveHand((0.0, 0.0, 20.0))),
    ],
)
def test_a_key_submits_its_command(key, command):
    assert play(ALIGNING, key)[0].commands == [command]


def test_saving_is_possible_once_it_is_accepted():
    assert play(ALIGNING, "s")[0].commands == []
    session, _, text = play(ENOUGH, "s")
    assert session.commands == [Save()]
    assert "ENOUGH" in text
    assert "0.52 mm at the anatomy" in text
    assert "4 over 88 mm" in text


def test_while_the_board_is_moved_no_cross_is_moved():
    moving = change(
        ALIGNING, phase=AlignmentPhase.MOVING, corner=None, row_column=(0, 0), cross_px=None,
        moved_mm=None, instruction="lower the board by 40 mm, away from the cameras",
    )  # fmt: skip
    session, _, text = play(moving, "left", "enter", "n")
    assert session.commands == [Another()]
    for words in ("MOVE BOARD", "lower the board by 40 mm", "no corner", "dark"):
        assert words in text, words


def test_real_devices_have_no_hand_and_show_both_cameras():
    real = change(ALIGNING, camera="oak", display="DP-1", has_hand=False, has_eye=False)
    session, _, text = play(real, "m", "pageup", "q")
    assert session.commands == [Leave()]
    assert "right camera" in text
    assert "DP-1, right eye" in text
    assert "PgUp" not in text
    assert " sim " not in text


def test_strays_and_a_board_that_moves_are_told():
    text = play(change(ALIGNING, verdict=REFUSED, is_still=False, moved_mm=1.3))[2]
    assert "0.72 mm at the anatomy" in text
    assert "the error is 0.72 mm, 0.60 mm are allowed" in text
    assert "1 left out" in text
    assert "moving, moved 1.3 mm" in text


def test_a_lost_device_comes_before_everything_else():
    text = play(change(ENOUGH, trouble="the camera was unplugged", pictures=None))[2]
    assert "DEVICE LOST" in text
    assert "the camera was unplugged" in text
    assert "waiting for the first picture" in text


def test_a_kept_cross_rings_once():
    def keep(app, session):
        session.current = change(ALIGNING, n_kept=8)
        app.poll()
        app.poll()

    _, app, _ = play(change(ALIGNING, n_kept=0), then=keep)
    assert app.n_bells == 1


def test_it_ends_with_its_session():
    def end(app, session):
        session.is_over = True
        app.poll()

    assert play(ALIGNING, then=end)[1].return_value == 0


def test_plain_terminals_lose_nothing():
    text = play(ENOUGH, symbols=ASCII)[2]
    assert text.isascii()
    assert "+ ENOUGH" in text


def test_a_small_terminal_says_the_essential():
    text = play(ALIGNING, size=(50, 12))[2]
    assert "ALIGN" in text
    assert "7 of 12 crosses" in text
    assert "make the terminal 80 x 24" in text


def test_in_a_small_terminal_nothing_is_kept_blindly():
    session, _, _ = play(ENOUGH, "left", "enter", "u", "n", "x", "s", "q", size=(79, 24))
    assert session.commands == [Leave()]
    session, _, _ = play(ENOUGH, "enter", "q", size=(80, 23))
    assert session.commands == [Leave()]


def test_a_small_terminal_says_a_devices_trouble_first():
    text = play(change(ALIGNING, trouble="the camera was unplugged"), size=(50, 12))[2]
    assert "the camera was unplugged" in text
    assert "then ENTER" not in text


def test_writing_on_its_head_is_said():
    assert "text on head" in play(change(ALIGNING, is_upside_down=True))[2]


def test_an_interruption_is_no_ordinary_end():
    assert play(ENOUGH, "ctrl+c")[1].return_value == 130
    assert play(ENOUGH, "ctrl+q")[1].return_value == 130
