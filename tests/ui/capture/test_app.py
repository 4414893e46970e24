"""The capture's screen on fixed snapshots: words, keys, both sizes."""

import dataclasses

import numpy as np
import pytest

from navapp.control.capture.states import (
    Another,
    CapturePhase,
    CaptureSnapshot,
    Check,
    DropLast,
    Finish,
    Follow,
    Leave,
    Nudge,
    Outcome,
    Take,
)
from navapp.control.states import Progress
from navapp.ui.capture.app import CaptureApp
from navapp.ui.capture.panels import CaptureView, CoverageMap, InstructionLines
from navapp.ui.symbols import ASCII, UNICODE
from tests.ui.guided import play_on


def picture(level: int) -> np.ndarray:
    y, x = np.mgrid[0:108, 0:192]
    return np.dstack([(x + y + level) % 200] * 3).astype(np.uint8)


SEEKING = CaptureSnapshot(
    time_ns=1,
    phase=CapturePhase.CAPTURING,
    camera="sim:stereo camera",
    has_hand=True,
    is_following=False,
    pictures=(picture(0), picture(40)),
    n_seen=(70, 64, 70),
    checks=(
        Check("seen", True, "64 marks by both"),
        Check("sharp", True, "0.6 px"),
        Check("still", False, "41 px/s"),
        Check("new", True),
    ),
    instruction="move it 40 mm to the left, 60 mm nearer; tilt its top away by 20 deg; turn it "
    "clockwise by 90 deg",
    n_kept=12,
    bound_mm=0.21,
    worst_mm=0.41,
    stop_mm=0.15,
    is_enough=False,
    covered=np.arange(96).reshape(2, 6, 8) % 3 == 0,
    progress=None,
    events=tuple(f"pair {k} kept: 70 marks by both" for k in range(12)),
)
change = dataclasses.replace


def play(snapshot, *keys, size=(80, 24), symbols=UNICODE, then=None):
    return play_on(CaptureApp, snapshot, *keys, size=size, symbols=symbols, then=then)


@pytest.mark.parametrize("size", [(80, 24), (160, 48)])
def test_everything_is_said_at_both_sizes(size):
    _, _, text = play(SEEKING, size=size)
    for words in (
        "navapp calibrate", "sim", "12 pairs", "CAPTURING",
        "move it 40 mm to the left, 60 mm nearer", "clockwise by 90 deg",
        "70  64 of 70", "not still 41 px/s", "0.21 mm, enough at 0.15", "everywhere 0.41",
        "kept marks", "pair 11 kept", "SPACE take", "m follow", "arrows+-ikjluo move",
    ):  # fmt: skip
        assert words in text, words
    assert text.count("▀") > 100  # both pictures


@pytest.mark.parametrize(
    ("key", "command"),
    [
        ("space", Take()),
        ("d", DropLast()),
        ("n", Another()),
        ("f", Finish()),
        ("q", Leave()),
        ("m", Follow(True)),
        ("left", Nudge((-20.0, 0.0, 0.0))),
        ("down", Nudge((0.0, 20.0, 0.0))),
        ("plus", Nudge((0.0, 0.0, -20.0))),
    ],
)
def test_a_key_submits_its_command(key, command):
    assert play(SEEKING, key)[0].commands == [command]


def test_m_lets_the_hand_go_again():
    following = change(SEEKING, is_following=True)
    session, _, text = play(following, "m")
    assert session.commands == [Follow(False)]
    assert "let go" in text


def test_a_real_camera_has_no_hand():
    real = change(SEEKING, camera="oak", has_hand=False)
    session, _, text = play(real, "m", "left", "i", "q")
    assert session.commands == [Leave()]
    assert "follow" not in text
    assert " sim " not in text


def test_while_it_solves_only_leaving_is_possible():
    solving = change(SEEKING, phase=CapturePhase.SOLVING, progress=Progress("solving", 0.4))
    session, _, text = play(solving, "space", "f", "d", "q")
    assert session.commands == [Leave()]
    assert "SOLVING" in text
    assert "40 %" in text


def test_the_outcome_is_said_with_its_reasons():
    well = change(SEEKING, outcome=Outcome(True, ()))
    assert "ACCEPTED" in play(well)[2]
    assert "rig.yml and report.html" in play(well)[2]
    reason = "the predicted 95 % error in the working volume is 0.52 mm, 0.40 mm are allowed"
    badly = play(change(SEEKING, outcome=Outcome(False, (reason,))))[2]
    assert "NOT ACCEPTED" in badly
    assert "0.52 mm" in badly


def test_enough_is_said():
    text = play(
        change(SEEKING, is_enough=True, bound_mm=0.14, instruction="nothing: this is enough")
    )[2]
    assert "ENOUGH" in text


def test_a_kept_pair_rings_once():
    def keep(app, session):
        session.current = change(SEEKING, n_kept=13)
        app.poll()
        app.poll()

    _, app, _ = play(change(SEEKING, n_kept=0), then=keep)
    assert app.n_bells == 1


def test_it_ends_with_its_capture():
    def end(app, session):
        session.is_over = True
        app.poll()

    _, app, _ = play(SEEKING, then=end)
    assert app.return_value == 0


def test_before_there_is_a_rig_the_gauge_is_empty_and_nothing_fails():
    young = change(
        SEEKING, bound_mm=None, worst_mm=None, pictures=None, checks=(), events=(), n_kept=0
    )
    text = play(young)[2]
    assert "-.-- mm" in text
    assert "waiting for the first picture" in text


def test_plain_terminals_lose_nothing():
    text = play(SEEKING, symbols=ASCII)[2]
    assert text.isascii()
    assert "! not still" in text


def test_a_small_terminal_says_the_essential():
    text = play(SEEKING, size=(50, 12))[2]
    assert "CAPTURING" in text
    assert "make the terminal 80 x 24" in text


def test_the_map_shows_every_cell():
    lines = CoverageMap("map").build(CaptureView(SEEKING, ASCII), 37, 4)[1:]
    told = [str(line)[1:17] for line in lines]
    for row in range(6):
        for column in range(8):
            sign = told[row // 2][2 * column]
            is_kept = sign == "#" or sign == ("^" if row % 2 == 0 else "_")
            assert is_kept == SEEKING.covered[0, row, column]


def test_a_lost_camera_comes_before_everything_else() -> None:
    snapshot = change(
        SEEKING, trouble="the camera was unplugged", pictures=None, is_enough=True,
        outcome=Outcome(is_accepted=True, sentences=()),
    )  # fmt: skip
    view = CaptureView(snapshot, UNICODE)
    assert view.state[0] == "NO CAMERA"
    lines = [line.plain for line in InstructionLines("wish").build(view, 80, 2)]
    assert "the camera was unplugged" in lines[0]
    assert "accepted" not in " ".join(lines)
