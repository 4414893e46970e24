"""The screen of a tool's calibration on fixed snapshots: words, keys, three sizes."""

import dataclasses

import pytest

from navapp.control.tool_calibration.states import Again, Finish, Leave, ToolPhase, ToolSnapshot
from navapp.ui.symbols import ASCII, UNICODE
from navapp.ui.tool_calibration.app import ToolApp
from tests.ui.guided import play_on
from tests.ui.snapshots import picture

PIVOTING = ToolSnapshot(
    time_ns=1,
    phase=ToolPhase.PIVOT,
    camera="sim:stereo camera",
    pictures=(picture(0.0), picture(1.0)),
    instruction="stand the tip in a small hole and lean the tool slowly to all sides",
    missing="",
    seen_share=0.87,
    n_poses=34,
    n_kept=0,
    half_angle_deg=17.0,
    tip_mm=(1.3, 79.1, 112.0),
    bound_mm=0.14,
    stop_mm=0.1,
    swept_deg=0.0,
    turn_deg=80.0,
    events=("begun anew: all poses are forgotten",),
    n_events=1,
)
TURNING = dataclasses.replace(
    PIVOTING, phase=ToolPhase.FIRST_TURN, n_kept=1, swept_deg=31.0, bound_mm=0.05,
    instruction="turn the tool to and fro about its own axis, without leaning it",
)  # fmt: skip
SIZES = [(80, 24), (160, 48), (200, 60)]


def play(snapshot, *keys, size=(80, 24), symbols=UNICODE, then=None):
    return play_on(ToolApp, snapshot, *keys, size=size, symbols=symbols, then=then)


@pytest.mark.parametrize("size", SIZES)
def test_everything_is_said_at_all_sizes(size):
    _, _, text = play(PIVOTING, size=size)
    for words in (
        "navapp calibrate pivot", "sim", "34 poses", "PIVOT", "lean the tool slowly",
        "87 % seen", "0.14 mm, enough at 0.10", "leaned 17 of 20 deg",
        "begun anew", "f finish", "n begin anew", "q leave",
    ):  # fmt: skip
        assert words in text, words
    assert text.count("▀") > 100  # both pictures


def test_a_turn_says_how_far_it_went():
    _, _, text = play(TURNING)
    assert "FIRST TURN" in text
    assert "31 of 80 deg" in text


def test_a_plate_that_is_not_seen_says_why():
    missing = "no marker is seen by both cameras"
    _, _, text = play(dataclasses.replace(PIVOTING, missing=missing, seen_share=0.0))
    assert missing in text
    assert "% seen" not in text


def test_before_there_is_a_tip_no_number_stands_for_it():
    _, _, text = play(dataclasses.replace(PIVOTING, bound_mm=None, half_angle_deg=None))
    assert "-.-- mm, enough at 0.10" in text
    assert "leaned" not in text


def test_a_cameras_trouble_comes_first():
    _, _, text = play(dataclasses.replace(PIVOTING, trouble="the camera was unplugged"))
    assert "NO CAMERA" in text
    assert "the camera was unplugged" in text
    assert "lean the tool" not in text


@pytest.mark.parametrize(("key", "command"), [("f", Finish()), ("n", Again()), ("q", Leave())])
def test_keys(key, command):
    session, _, _ = play(PIVOTING, key)
    assert session.commands == [command]


def test_a_finished_part_rings_once():
    def finish(app, session):
        session.current = TURNING
        app.poll()
        app.poll()

    _, app, _ = play(PIVOTING, then=finish)
    assert app.n_bells == 1


@pytest.mark.parametrize("size", [(60, 20), (79, 24), (80, 23)])
def test_a_terminal_that_is_too_small_says_so(size):
    _, _, text = play(PIVOTING, size=size)
    assert "make the terminal 80 x 24" in text
    assert "PIVOT" in text


def test_plain_characters_alone_on_a_plain_terminal():
    _, _, text = play(PIVOTING, symbols=ASCII)
    assert text.isascii()
