"""The operator that follows a script."""

from pathlib import Path

import pytest

from navapp.control.commands import (
    Accept,
    Blank,
    EnterStage,
    Propose,
    Register,
    Reject,
    Show,
)
from navapp.control.event_log import SessionHooks
from navapp.control.scripted_operator import (
    DEFAULT_SCRIPT,
    ScriptedOperator,
    ScriptStep,
    read_script,
)
from navapp.errors import ConfigurationError, UsageError
from navapp.geometry.transform import rotation_angle_deg
from navapp.values import Reason, Status
from tests.control.fakes import GONE, LOST, Bench, FakeCamera, a_pose, answer, navigating
from tests.control.operated import commands_of, kinds


@pytest.fixture
def bench() -> Bench:
    return Bench(camera=FakeCamera(None, n_frames=40))


@pytest.mark.parametrize("wrong", [LOST, GONE, answer(Status.DEGRADED, Reason.OUTLIERS)])
def test_the_script_offers_a_wrong_pose_first_and_rejects_it(bench: Bench, wrong) -> None:
    bench.script.assessed = wrong
    given = commands_of(bench, ScriptedOperator(DEFAULT_SCRIPT[-2:]))
    assert kinds(given) == ["Register", "Reject", "Propose", "Reject", "Register", "Accept"]
    proposed = next(c for c in given if isinstance(c, Propose)).left_from_bone
    assert rotation_angle_deg(proposed, a_pose()) == pytest.approx(15.0)
    assert bench.state == "navigating"


def test_a_judge_that_takes_the_wrong_pose_is_found_out(bench: Bench) -> None:
    given = commands_of(bench, ScriptedOperator(DEFAULT_SCRIPT[-2:]))
    assert kinds(given)[:4] == ["Register", "Reject", "Propose", "Accept"]


def test_the_script_accepts_only_what_is_ok_and_gives_up_some_time(bench: Bench) -> None:
    bench.script.found = [answer(Status.DEGRADED, Reason.TRE_TOO_LARGE)]
    given = commands_of(bench, ScriptedOperator((ScriptStep(do="register"),)))
    assert "Accept" not in kinds(given)
    assert kinds(given).count("Register") == 8


def test_a_candidate_that_vanishes_is_rejected_and_searched_again(bench: Bench) -> None:
    operator = ScriptedOperator((ScriptStep(do="register"),))
    bench.frames(1)
    assert operator.commands(bench.snapshot) == [Register()]
    bench.do(Register())
    bench.script.tracked = GONE
    bench.frames(2)
    assert bench.snapshot.left_from_bone is None
    assert operator.commands(bench.snapshot) == [Reject(1)]


def test_steps_wait_for_their_frame() -> None:
    steps = (
        ScriptStep(do="register"),
        ScriptStep(do="blank", at_frame=8),
        ScriptStep(do="show", at_frame=12),
        ScriptStep(do="stage", stage="drilling", at_frame=15),
    )
    dark = []
    hooks = SessionHooks(on_frame=(lambda r: dark.append(bench.is_dark),))
    bench = Bench(camera=FakeCamera(None, n_frames=40), hooks=hooks)
    given = commands_of(bench, ScriptedOperator(steps))
    assert given == [Register(), Accept(1), Blank(), Show(), EnterStage(2)]
    assert [number for number, is_dark in enumerate(dark) if is_dark] == [9, 10, 11, 12]


def test_a_script_file_is_read(tmp_path: Path) -> None:
    content = {"step": [{"do": "propose", "turn_deg": 9.0}, {"do": "stage", "stage": "implant"}]}
    assert read_script(content, "s") == (
        ScriptStep(do="propose", turn_deg=9.0),
        ScriptStep(do="stage", stage="implant"),
    )


@pytest.mark.parametrize(
    "content",
    [
        {},
        {"step": []},
        {"step": [{"do": "dance"}]},
        {"step": [{"do": "show", "at": 3}]},
        {"step": [{"do": "show"}], "more": 1},
        {"step": [{}]},
    ],
)
def test_a_script_that_cannot_be_meant_is_refused(content) -> None:
    with pytest.raises(ConfigurationError):
        read_script(content, "s")


def test_a_script_with_an_unknown_stage_is_refused() -> None:
    with pytest.raises(UsageError, match="no stage"):
        read_script({"step": [{"do": "stage", "stage": "dessert"}]}, "s")


def gated(*steps: ScriptStep, n_frames: int = 40) -> tuple[Bench, ScriptedOperator]:
    """A session with gates after a script has run."""
    bench = Bench(camera=FakeCamera(None, n_frames=n_frames), has_gates=True)
    operator = ScriptedOperator(steps)
    commands_of(bench, operator)
    return bench, operator


def test_the_default_script_goes_through_the_time_out() -> None:
    bench, operator = gated(*DEFAULT_SCRIPT)
    assert bench.snapshot.is_navigable
    assert operator.failure == ""


def test_a_gate_is_refused_overridden_and_met() -> None:
    bench, operator = gated(
        ScriptStep(do="register"),
        ScriptStep(do="wait", until="navigating"),
        ScriptStep(do="expect", text="the time-out checklist is not done"),
        ScriptStep(do="stage", stage="drilling"),
        ScriptStep(do="expect", text="open: the bone is exposed"),
        ScriptStep(do="override", stage="drilling", reason="a test"),
        ScriptStep(do="stage", stage="opening"),
        ScriptStep(do="confirm", name="bone_exposed"),
        ScriptStep(do="confirm", name="checked_on_patient"),
        ScriptStep(do="wait", until="navigating"),
        ScriptStep(do="stage", stage="drilling"),
        ScriptStep(do="quit"),
    )
    assert operator.failure == ""
    assert bench.snapshot.is_over
    assert bench.snapshot.stage.name == "drilling"
    assert [e.kind for e in bench.events].count("override") == 1


def test_what_does_not_come_fails_and_says_where() -> None:
    _, operator = gated(
        ScriptStep(do="blank"),
        ScriptStep(do="wait", until="guides", frames=5),
        ScriptStep(do="show"),
    )
    assert operator.failure.startswith("step 2 of the operator's script (wait guides):")
    assert "not within 5 frames" in operator.failure
    assert "blanked" in operator.failure


def test_a_text_that_was_told_before_the_step_does_not_count() -> None:
    _, operator = gated(
        ScriptStep(do="blank"),
        ScriptStep(do="show"),
        ScriptStep(do="expect", text="display blanked", frames=5),
    )
    assert "(expect display blanked)" in operator.failure


@pytest.mark.parametrize(
    ("step", "why"),
    [
        ({"do": "confirm"}, "has no 'name'"),
        ({"do": "override", "stage": "2"}, "has no 'reason'"),
        ({"do": "wait", "until": "lunch"}, "waits for 'lunch'"),
        ({"do": "expect"}, "has no 'text'"),
    ],
)
def test_a_step_that_lacks_something_is_refused(step, why: str) -> None:
    with pytest.raises(ConfigurationError, match=why):
        read_script({"step": [step]}, "s")


def test_a_script_that_waits_in_vain_ends_the_session(bench: Bench) -> None:
    operator = ScriptedOperator((ScriptStep(do="wait", until="navigating", frames=3),))
    given = commands_of(bench, operator)
    assert "not within 3 frames" in operator.failure
    assert kinds(given) == ["Quit"]


def test_what_a_session_left_undone_is_told(bench: Bench) -> None:
    operator = ScriptedOperator((ScriptStep(do="blank"), ScriptStep(do="show", at_frame=99)))
    commands_of(bench, operator)
    assert operator.failure == ""
    assert operator.unfinished.endswith("before step 2 of the operator's script (show)")


@pytest.mark.parametrize("expects", [False, True])
def test_a_refused_gate_ends_a_script_that_does_not_expect_it(expects: bool) -> None:
    bench = navigating(Bench(camera=FakeCamera(None, n_frames=40), has_gates=True))
    expect = (ScriptStep(do="expect", text="open: the bone is exposed"),) if expects else ()
    operator = ScriptedOperator((ScriptStep(do="stage", stage="drilling"), *expect))
    commands_of(bench, operator)
    if expects:
        assert operator.failure == ""
    else:
        assert operator.failure.startswith("step 1 of the operator's script: refused, open: ")


def test_a_bone_may_be_registered_again_while_it_is_followed(bench: Bench) -> None:
    operator = ScriptedOperator((ScriptStep(do="register"),) * 2)
    assert kinds(commands_of(bench, operator)) == ["Register", "Accept"] * 2


def test_nobody_waits_for_a_review_that_is_decided_at_once() -> None:
    with pytest.raises(ConfigurationError, match="waits for 'review'"):
        read_script({"step": [{"do": "wait", "until": "review"}]}, "script.toml")


@pytest.mark.parametrize("expects", [False, True])
def test_a_word_that_is_refused_ends_a_script_that_does_not_expect_it(expects: bool) -> None:
    bench = navigating(Bench(camera=FakeCamera(None, n_frames=40), has_gates=True))
    expect = (ScriptStep(do="expect", text="nobody is asked for 'gapz'"),) if expects else ()
    operator = ScriptedOperator((ScriptStep(do="confirm", name="gapz"), *expect))
    commands_of(bench, operator)
    assert ("nobody is asked for 'gapz'" in operator.failure) == (not expects)


@pytest.mark.parametrize("step", [{"do": "show", "box": [1, 2, 3, 4]},
                                  {"do": "register", "box": [1, 2, 0, 4]}])  # fmt: skip
def test_a_box_that_means_nothing_is_refused(step) -> None:
    with pytest.raises(ConfigurationError, match="'box' that means nothing"):
        read_script({"step": [step]}, "script")


def test_nothing_made_is_not_measured() -> None:
    bench = navigating(Bench(camera=FakeCamera(None, n_frames=40), has_gates=True))
    operator = ScriptedOperator((ScriptStep(do="wait", until="measured", frames=3),))
    commands_of(bench, operator)
    assert "not within 3 frames" in operator.failure
