"""A replay believes the recorded rig no longer than its session did."""

import argparse
from pathlib import Path

import pytest

from navapp.cli.recorded_operation import choose_operator, find_moved_rig, list_warnings
from navapp.cli.session_folder import RecordedSession
from navapp.control.commands import (
    Accept,
    CheckMirror,
    DistrustRig,
    Register,
)
from navapp.control.operators import RecordedEvents
from navapp.control.runner import run_headless
from tests.control.fakes import Bench, FakeCamera

FOUND = DistrustRig("100 mm are 100.13 mm")
AFTER = 5


def session(*, is_moved: bool = True) -> RecordedSession:
    commands = [(0, Register()), (1, Accept(None)), *([(AFTER, FOUND)] if is_moved else [])]
    here = Path()
    return RecordedSession(
        here,
        here,
        here,
        "bimcc",
        False,
        "opening",
        False,
        30.0,
        RecordedEvents(commands, [1], True),
    )


def options(**given) -> argparse.Namespace:
    plain = {
        "rig": None, "prior": None, "bone": None, "also": [], "method": None, "start": 0,
        "order": "forward", "follow_refused": False, "cut": [],
    }  # fmt: skip
    return argparse.Namespace(**(plain | given))


def states(recorded: RecordedSession, given: argparse.Namespace) -> list[str]:
    """Of 20 frames; the numbers of the pictures begin where the replay does."""
    operator, executor = choose_operator(recorded, given, given.follow_refused)
    bench = Bench(executor=executor, camera=FakeCamera(None, 20))
    bench.camera._sequence, bench.camera._n_frames = given.start, given.start + 20
    run_headless(bench.controller, operator)
    assert not any(r.is_navigable for r in bench.results if r.frame.sequence > AFTER)
    return [result.state.value for result in bench.results]


@pytest.mark.parametrize(
    "changed",
    [
        {}, {"prior": "p"}, {"bone": "femur"}, {"also": ["tibia"]}, {"method": "icp"},
        {"order": "each"}, {"start": 2}, {"follow_refused": True},
        {"cut": ["femur_distal"]},
    ],
    ids=str,
)  # fmt: skip
def test_a_moved_rig_stays_moved_whatever_else_is_changed(changed) -> None:
    said = states(session(), options(**changed))
    n_before = AFTER + 1 - changed.get("start", 0)
    assert "fault" not in said[:n_before]
    assert set(said[n_before:]) == {"fault"}
    if "start" not in changed and "order" not in changed:
        assert "navigating" in said[:n_before]


def test_a_replay_that_starts_after_it_shows_nothing_at_all() -> None:
    assert set(states(session(), options(start=9))) == {"fault"}


def test_another_rig_is_not_the_one_that_moved() -> None:
    for given in (options(rig="r.yml"), options(rig="r.yml", method="icp")):
        assert find_moved_rig(session(), given) is None
        operator, executor = choose_operator(session(), given, given.follow_refused)
        bench = Bench(executor=executor, camera=FakeCamera(None, 20))
        run_headless(bench.controller, operator)
        assert bench.results[-1].state.value == "navigating"


def test_to_and_fro_it_is_said_instead() -> None:
    given = options(order="pingpong")
    assert find_moved_rig(session(), given) == (AFTER, FOUND)
    (warning,) = list_warnings(session(), given)
    assert "moved after frame 5 (100 mm are 100.13 mm)" in warning
    assert list_warnings(session(is_moved=False), given) == ()
    assert list_warnings(session(), options(method="icp")) == ()
    assert list_warnings(None, given) == ()


def test_a_session_in_the_mirror_is_said_to_show_more_than_was_lit() -> None:
    in_mirror = session(is_moved=False)
    in_mirror.events.commands.append((3, CheckMirror()))
    (warning,) = list_warnings(in_mirror, options())
    assert "seen in the mirror" in warning
    assert list_warnings(session(is_moved=False), options()) == ()
