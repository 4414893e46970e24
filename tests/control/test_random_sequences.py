"""Commands, faults and stages in random order: what must hold whatever happens."""

from collections.abc import Callable

import numpy as np
import pytest

from navapp.control.commands import (
    Accept,
    Blank,
    Cancel,
    CheckMirror,
    Command,
    ConfirmCondition,
    ConfirmCross,
    ConfirmStep,
    DistrustRig,
    EnterStage,
    Interrupt,
    NudgeCross,
    OverrideGate,
    Propose,
    Quit,
    Reconnect,
    Register,
    Reject,
    Show,
    ToggleDepth,
    ToggleEye,
    ToggleLayer,
    WithdrawCondition,
    WithdrawStep,
)
from navapp.control.states import SessionState, Snapshot
from navapp.errors import DeviceLost
from navapp.values import Reason, Status
from tests.control.cuts import Faces, cut_plan
from tests.control.fakes import (
    DOUBTED,
    LOST,
    Bench,
    SlowExecutor,
    a_pose,
    answer,
    navigating,
)
from tests.many import few_of

N_STEPS = 45
CONDITIONS = ("patient", "side", "plan", "bone_exposed", "checked_on_patient", "entry_point",
              "component_size", "top", "nothing")  # fmt: skip
ANSWERS = (answer(), answer(), answer(), DOUBTED, LOST, answer(Status.LOST, has_pose=False))


def any_command(rng: np.random.Generator, snapshot: Snapshot) -> Command:
    """One in two brings the session forward, the others are whatever comes."""
    number, name = int(rng.integers(0, 7)), str(rng.choice(CONDITIONS))
    candidate = None if rng.random() < 0.2 else snapshot.candidate_id
    onward: tuple[Command, ...] = (
        Register(), Accept(candidate), Accept(candidate), EnterStage(snapshot.stage.number + 1),
        ConfirmCondition(name), ConfirmCondition(name), Show(),
        ConfirmCondition(CONDITIONS[number % 3]), OverrideGate(snapshot.gate_stage, "a test"),
    )  # fmt: skip
    others: tuple[Command, ...] = (
        Cancel(), Reject(candidate), Accept(number), Propose(a_pose()), Propose(a_pose("tibia")),
        Blank(), ToggleDepth(), ToggleEye(), ToggleLayer("bone"), ToggleLayer("clouds"),
        CheckMirror(), NudgeCross(1, 0), ConfirmCross(), EnterStage(number),
        OverrideGate(snapshot.gate_stage, "a test"), OverrideGate(number, " "),
        WithdrawCondition(name), ConfirmStep("top"), WithdrawStep("top"), ConfirmStep("nose"),
        Reconnect(), Interrupt(),
    )  # fmt: skip
    rare: tuple[Command, ...] = (DistrustRig("the board looks longer"), Quit())
    kind = rng.random()
    group = onward if kind < 0.6 else others if kind < 0.995 else rare
    return group[int(rng.integers(len(group)))]


def any_fault(rng: np.random.Generator, bench: Bench) -> None:
    """What the room does by itself."""
    bench.script.tracked = ANSWERS[int(rng.integers(len(ANSWERS)))]
    bench.script.found = [ANSWERS[int(rng.integers(len(ANSWERS)))] for _ in range(2)]
    bench.camera.error = DeviceLost("unplugged") if rng.random() < 0.05 else None
    bench.camera.is_silent = rng.random() < 0.05
    if rng.random() < 0.1:
        bench.clock.advance_ns(int(rng.integers(1, 10)) * 150_000_000)


def told(bench: Bench) -> tuple[object, ...]:
    """What an operator can see change."""
    snapshot = bench.snapshot
    return len(bench.events), snapshot.state, snapshot.cross_check, snapshot.is_blanked


def check_guides(bench: Bench, snapshot: Snapshot) -> None:
    """Nothing but a met time-out, an accepted bone and an OK pose lights guides."""
    if bench.snapshot.is_navigable:
        assert snapshot.state is SessionState.NAVIGATING
        assert snapshot.verdict is not None
        assert snapshot.verdict.status is Status.OK
        assert all(line.is_met for line in snapshot.time_out)
    if bench.shows_guides:
        shown = bench.results[-1]
        assert not snapshot.is_blanked
        # The outline of a candidate is shown to be decided on, and is no guide.
        if shown.state is not SessionState.REVIEW:
            assert shown.is_navigable
            assert shown.state is SessionState.NAVIGATING


def stages_are_earned(bench: Bench) -> bool:
    """A later stage was entered only where its gate was met or overridden just before."""
    texts = [(event.kind, event.text) for event in bench.events]
    number = 1
    for place, (kind, text) in enumerate(texts):
        if kind != "stage":
            continue
        entered = int(text.split()[1])
        if entered > number and not text.endswith("gate met"):
            before = [event for event in texts[:place] if event[0] == "override"]
            if not before or not before[-1][1].startswith(f"gate of stage {entered} overridden"):
                return False
        number = entered
    return True


def run_sequence(seed: int, make: Callable[[], Bench]) -> Bench:
    """Every other one begins while navigating: chance alone seldom gets there."""
    rng, bench = np.random.default_rng([seed, 32]), make()
    if seed % 2:
        navigating(bench)
        for name in ("patient", "side", "plan"):
            bench.do(ConfirmCondition(name))
    for _ in range(N_STEPS):
        if bench.snapshot.is_over:
            break
        if rng.random() < 0.5:
            any_fault(rng, bench)
            snapshot = bench.frames(1)
        else:
            command, before = any_command(rng, bench.snapshot), told(bench)
            snapshot = bench.do(command)
            assert told(bench) != before, f"no answer to {command}"
            assert not isinstance(command, Blank) or bench.is_dark
        assert not snapshot.is_blanked or bench.is_dark
        check_guides(bench, snapshot)
    return bench


@pytest.mark.parametrize("block", few_of(range(100), 1))
def test_whatever_comes_guides_are_earned_and_commands_answered(
    block: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A hundred sequences a block; guides are seen in enough of them to mean something."""
    faces = Faces(monkeypatch)
    n_guided = n_far = 0
    for seed in range(100 * block, 100 * block + 100):
        faces.shares["top"] = 0.8 if seed % 2 else None
        executor = SlowExecutor() if seed % 10 == 0 else None
        bench = run_sequence(
            seed,
            lambda: Bench(plan=cut_plan(), has_gates=True, executor=executor),  # noqa: B023
        )
        assert stages_are_earned(bench)
        n_guided += any(result.is_navigable for result in bench.results)
        n_far += any(result.stage.number > 2 for result in bench.results)
        bench.controller.close()
        assert bench.controller.snapshot.state is SessionState.OFFLINE
        assert not bench.camera.is_open
        assert bench.is_dark
        assert Reason.NOT_NAVIGATING in bench.controller.snapshot.reasons
    assert n_guided >= 10
    assert n_far >= 5
