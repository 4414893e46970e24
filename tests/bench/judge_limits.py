"""The judge's limits: what right and wrong poses show of each quantity that a rule looks at.

usage: python -m tests.bench.judge_limits [--knees N] [--frames N] [--stage STAGE ...]

Simulated knees of two groups: on the training knees a limit is set, on the others it is reported.
Poses come from the right plan, begun at the true pose and beside it, and from plans of another
person, of the other side and of another size. A pose of the right plan is right when its targets
lie within 1 mm of where they are in the bone; any pose is wrong when they lie further off. What is
asked and gives no pose is counted beside. "Set" is the limit that one of 200 right poses of the
training knees is beyond. Shares are of poses beyond the limit that `registration/verdict.py` has.
"""

import argparse
import math
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from drivers.frames import StereoFrame
from navapp.control.stages import STAGES, stage_by_name
from navapp.evaluation.paper.cases import SituationName
from navapp.evaluation.sequence import KnownSequence
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.registration.verdict import RULES, Evidence, Goal, Rule, decide
from navapp.tracking import TrackState, judging
from navapp.tracking.bimcc_tracker import BimccTracker
from navapp.values import BoneModel, Reason, Status, Verdict
from tests.bench.bounds import FIRST_SEED, render_knee
from tests.bench.wrong_bones import OTHER_SIDE, move_onto, stretch_bone, stretch_points
from tests.bench.wrong_sizes import find_bone_as_made

_OTHER_SEED = FIRST_SEED + 500
# Rules that tell a right place from a wrong one; the others hold promises (errors in mm), or ask
# for yes or no.
_TELLING = (Reason.COVERAGE_LOW, Reason.SEEN_THROUGH, Reason.OUTLIERS, Reason.SURFACE_MISFIT)
_RIGHT_MM = 1.0
_BEYOND_SHARE = 0.005
_SIZES = (0.93, 0.95, 1.05, 1.07)
# How far beside the true pose: mm and degrees, at most.
_STARTS = ((0.0, 0.0), (10.0, 10.0), (30.0, 40.0))
_SITUATIONS: tuple[SituationName, ...] = ("overlay", "patient", "instrument")
# One frame of so many is judged: patients turn their legs slowly, and instruments come late.
_STRIDE = 12


@dataclass(slots=True)
class DecisionLog:
    """Stands for `decide`, and keeps what it was asked."""

    asked: list[tuple[Verdict, Evidence]] = field(default_factory=list)

    def decide(self, evidence: Evidence) -> Verdict:
        """As the judge does."""
        verdict = decide(evidence)
        self.asked.append((verdict, evidence))
        return verdict

    def evidence_of(self, verdict: Verdict) -> Evidence | None:
        """What stands behind an answer; None of one that got a cause afterwards."""
        return next((evidence for one, evidence in self.asked if one is verdict), None)


@dataclass(frozen=True, slots=True)
class Judged:
    """A pose with what was known of it."""

    evidence: Evidence
    status: Status
    error_mm: float
    bound_mm: float
    is_right_plan: bool

    @property
    def is_right(self) -> bool:
        """Whether the targets of the right plan lie where they are in the bone."""
        return self.is_right_plan and self.error_mm <= _RIGHT_MM

    @property
    def is_wrong(self) -> bool:
        """Whether targets lie elsewhere."""
        return self.error_mm > _RIGHT_MM


def main() -> None:
    """Print a row for each rule, and what all rules together do."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--knees", type=int, default=4, help="of each group, stage and situation")
    parser.add_argument("--frames", type=int, default=3)
    parser.add_argument("--stage", nargs="+", default=[stage.name for stage in STAGES])
    options = parser.parse_args()
    if options.knees < 2:
        parser.error("another person's plan needs 2 knees")
    groups = [
        [
            one
            for stage in options.stage
            for one in _judge_stage(stage_by_name(stage).name, first, options)
        ]
        for first in (FIRST_SEED, _OTHER_SEED)
    ]
    _tell(*groups)


def _judge_stage(stage: str, first: int, options: argparse.Namespace) -> Iterator[Judged | None]:
    for situation in _SITUATIONS:
        sequences = [
            render_knee(stage, situation, number, first, options.frames * _STRIDE, 1.0)
            for number in range(options.knees)
        ]
        for number, sequence in enumerate(sequences):
            other = sequences[(number + 1) % len(sequences)]
            yield from _judge_knee(sequence, other, first + number)
        print(f"{stage}, {situation}, from seed {first}", file=sys.stderr, flush=True)


def _judge_knee(
    sequence: KnownSequence, other: KnownSequence, seed: int
) -> Iterator[Judged | None]:
    random = np.random.default_rng(seed)
    own = find_bone_as_made(sequence)
    targets_mm = sequence.plan.targets_of(sequence.stage.targets)
    for shift_mm, turn_deg in _STARTS:
        offsets = random.uniform(-1.0, 1.0, 6) * np.repeat([shift_mm, math.radians(turn_deg)], 3)
        yield from _follow(sequence, own, targets_mm, offsets, is_right_plan=True)
    for bone, moved_mm in _wrong_bones(own, targets_mm, find_bone_as_made(other)):
        yield from _follow(sequence, bone, moved_mm, np.zeros(6), is_right_plan=False)


def _wrong_bones(
    own: BoneModel, targets_mm: FloatArray, other: BoneModel
) -> Iterator[tuple[BoneModel, FloatArray]]:
    """Wrong plans of a bone, with its targets in them."""
    yield replace(other, mesh=move_onto(other.mesh, own.mesh)), targets_mm
    for factors in (OTHER_SIDE, *_SIZES):
        yield stretch_bone(own, factors), stretch_points(targets_mm, own.mesh, factors)


def _follow(
    sequence: KnownSequence,
    bone: BoneModel,
    moved_mm: FloatArray,
    offsets: FloatArray,
    *,
    is_right_plan: bool,
) -> Iterator[Judged | None]:
    """Frames of a sequence, each followed from beside the true pose; None where no pose is told."""
    tracker = BimccTracker(sequence.rig, bone)
    goal = Goal(moved_mm, sequence.stage.tolerance_mm)
    targets_mm = sequence.plan.targets_of(sequence.stage.targets)
    pairs = zip(sequence.frames, sequence.truth, strict=True)
    for frame, true in list(pairs)[_STRIDE - 1 :: _STRIDE]:
        if true is None:
            raise AssertionError("simulated frames have a truth")
        start = true.move(offsets, true.apply(tracker.model.centre_mm))
        judged = _judge_frame(tracker, frame, start, goal)
        if judged is None:
            yield None
            continue
        pose, evidence, verdict = judged
        error_mm = np.linalg.norm(pose.apply(moved_mm) - true.apply(targets_mm), axis=1).mean()
        bound_mm = math.inf if evidence.bound_mm is None else evidence.bound_mm
        yield Judged(evidence, verdict.status, float(error_mm), bound_mm, is_right_plan)


def _judge_frame(
    tracker: BimccTracker, frame: StereoFrame, start: RigidTransform, goal: Goal
) -> tuple[RigidTransform, Evidence, Verdict] | None:
    log = DecisionLog()
    usual, judging.decide = judging.decide, log.decide
    try:
        state = TrackState.at_rest(start, frame.captured_ns)
        tracked, _ = tracker.glance(frame, state, goal)
    finally:
        judging.decide = usual
    pose, evidence = tracked.left_from_bone, log.evidence_of(tracked.verdict)
    if pose is None or evidence is None:
        return None
    return pose, evidence, tracked.verdict


def _tell(training: Sequence[Judged | None], others: Sequence[Judged | None]) -> None:
    print("| rule | looked at | limit | set | right beyond: training, others | wrong beyond |")
    print("|---|---|---|---|---|---|")
    groups = [[one for one in group if one is not None] for group in (training, others)]
    right = [[one for one in group if one.is_right] for group in groups]
    wrong = [[one for one in group if one.is_wrong] for group in groups]
    for rule in RULES:
        values = _values(rule, right[0])
        if rule.reason not in _TELLING or rule.degraded is None or len(values) == 0:
            continue
        level = _BEYOND_SHARE if rule.is_below else 1.0 - _BEYOND_SHARE
        told = (
            ", ".join(f"{100.0 * _share_beyond(rule, one):.1f} %" for one in poses)
            for poses in (right, wrong)
        )
        print(
            f"| {rule.reason.name} | {rule.quantity} | {rule.degraded:g} | "
            f"{np.quantile(values, level):.2f} | {' | '.join(told)} |"
        )
    print("\n| knees | asked | no pose | right | OK | wrong | OK | of these beyond the bound |")
    print("|---|---|---|---|---|---|---|---|")
    asked = [(len(group), sum(one is None for one in group)) for group in (training, others)]
    for name, (n_asked, n_silent), good, bad in zip(
        ("training", "others"), asked, right, wrong, strict=True
    ):
        n_ok = sum(one.status is Status.OK for one in good)
        ok = [one for one in bad if one.status is Status.OK]
        beyond = sum(one.error_mm > one.bound_mm for one in ok)
        print(
            f"| {name} | {n_asked} | {n_silent} | {len(good)} | {n_ok} | {len(bad)} | {len(ok)} | "
            f"{beyond} |"
        )


def _values(rule: Rule, judged: Sequence[Judged]) -> FloatArray:
    values = np.array([rule.measure(one.evidence) for one in judged], dtype=float)
    return values[np.isfinite(values)]


def _share_beyond(rule: Rule, judged: Sequence[Judged]) -> float:
    beyond = [rule.status(one.evidence) is not Status.OK for one in judged]
    return float(np.mean(beyond)) if beyond else math.nan


if __name__ == "__main__":
    main()
