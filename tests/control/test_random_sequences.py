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
    ReadThickness,
    Reconnect,
    Register,
    Reject,
    SetProjector,
    Show,
    ToggleDepth,
    ToggleEye,
    ToggleLayer,
    WithdrawCondition,
    WithdrawStep,
)
from navapp.control.stages import STAGES
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
        ReadThickness("top", (10.0,) * 4), ReadThickness("nose", ()),
        Reconnect(), SetProjector("on"), SetProjector("colour"), Interrupt(),
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


class Record:
    """What was said, kept beside the session, to judge its gates by."""

    def __init__(self) -> None:
        self.said: set[str] = set()
        self.cuts: set[str] = set()
        self.told: tuple[int, int] | None = None  # a refused stage, and from which one

    def note(self, command: Command, before: Snapshot, after: Snapshot) -> None:
        """A command that was answered; a later stage must have been earned."""
        match command:
            case ConfirmCondition(name):
                self.said.add(name)
            case WithdrawCondition(name):
                self.said.discard(name)
            case ConfirmStep(name) if name in ("top", "side"):
                self.cuts.add(name)
            case WithdrawStep(name):
                self.cuts.discard(name)
                self.said.discard(f"cut {name}")
        came, went = before.stage.number, after.stage.number
        if went > came:
            is_told = self.told == (came, went) and isinstance(command, OverrideGate)
            assert is_told or not self.open_before(came, went, before), (command, came, went)
        if went != came:
            self.told = None
        elif isinstance(command, EnterStage) and came < command.number <= len(STAGES):
            self.told = came, command.number

    def open_before(self, present: int, number: int, snapshot: Snapshot) -> set[str]:
        """Of what must have been said or made, whatever else the session asks for."""
        asked: set[str] = set()
        if present == 1:
            asked |= {"bone_exposed", "checked_on_patient"}
            is_ok = snapshot.verdict is not None and snapshot.verdict.status is Status.OK
            if not (is_ok and snapshot.state is SessionState.NAVIGATING):
                return {"bone_ok"}
        if present <= 2 < number:
            asked |= {"entry_point"}
        missing = asked - self.said
        if present <= 3 < number:
            missing |= {"component_size"} - self.said
            missing |= {"top", "side"} - self.cuts
        return missing


def run_sequence(seed: int, make: Callable[[], Bench]) -> Bench:
    """Every other one begins while navigating: chance alone seldom gets there."""
    rng, bench, record = np.random.default_rng([seed, 32]), make(), Record()
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
            shown, before = bench.snapshot, told(bench)
            command = any_command(rng, shown)
            snapshot = bench.do(command)
            assert told(bench) != before, f"no answer to {command}"
            record.note(command, shown, snapshot)
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
        n_guided += any(result.is_navigable for result in bench.results)
        n_far += any(result.stage.number > 2 for result in bench.results)
        bench.controller.close()
        assert bench.controller.snapshot.state is SessionState.OFFLINE
        assert not bench.camera.is_open
        assert bench.is_dark
        assert Reason.NOT_NAVIGATING in bench.controller.snapshot.reasons
    assert n_guided >= 10
    assert n_far >= 5
