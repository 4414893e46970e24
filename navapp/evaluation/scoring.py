"""What a method said of a sequence, scored against the truth that it was not given."""

import math

from navapp.devices.simulated_room import make_sensor
from navapp.evaluation.following import Answers, FrameAnswer
from navapp.evaluation.noise_limit.frame import measure_budget
from navapp.evaluation.pose_errors import PoseErrors, measure_pose
from navapp.evaluation.predicted_errors import predict_errors_mm
from navapp.evaluation.scores import ErrorBudget, FrameScore, SequenceScore
from navapp.evaluation.sequence import KnownSequence
from navapp.geometry.rectification import rectifier_of
from navapp.geometry.transform import RigidTransform
from navapp.values import Verdict

# The error budget is measured in every fifth frame only, to save time.
_BUDGET_EVERY = 5


def score_answers(sequence: KnownSequence, answers: Answers, *, has_budget: bool) -> SequenceScore:
    """The scores of all frames but the first one, in which the bone is searched.

    Args:
        sequence: with its truth, as far as that is known.
        answers: of a method.
        has_budget: the error budget of some frames is measured, where the sensor is known.
    """
    scorer = _Scorer(sequence, answers, has_budget=has_budget)
    frames = tuple(scorer.score(place) for place in range(1, len(answers.frames)))
    return SequenceScore(answers.registration_s, answers.n_registrations, frames)


class _Scorer:
    """Scores the frames of one method."""

    def __init__(self, sequence: KnownSequence, answers: Answers, *, has_budget: bool) -> None:
        self._sequence, self._answers = sequence, answers
        camera = sequence.configuration.camera
        is_sensor_known = sequence.is_simulated and camera.backend == "simulated"
        self._has_budget = has_budget and is_sensor_known
        self._bone = sequence.plan.bones[sequence.stage.bone]
        self._targets_mm = sequence.plan.targets_of(sequence.stage.targets)
        self._rectifier = rectifier_of(sequence.rig)

    def score(self, place: int) -> FrameScore:
        """The frame at a place of the sequence."""
        answer, true = self._answers.frames[place], self._sequence.truth[place]
        verdict, errors = answer.verdict, self._measure(answer, true)
        return FrameScore(
            index=place,
            status=answer.status.value,
            reasons=() if verdict is None else tuple(one.value for one in verdict.reasons),
            tre_mm=errors.tre_mm,
            displacement_mm=errors.displacement_mm,
            outline_mm=errors.outline_mm,
            bound_mm=None if verdict is None else _finite(verdict.predicted_tre_mm),
            seen=None if verdict is None else verdict.coverage,
            hidden=None if verdict is None else verdict.occluded_fraction,
            total_ms=answer.total_ms,
            is_search=answer.is_search,
            claimed_mm=self._predict(answer),
            rms_ratio=_find_rms_ratio(verdict),
            budget=self._measure_budget(place, answer, true),
        )

    def _predict(self, answer: FrameAnswer) -> tuple[float, ...] | None:
        if answer.estimate is None:
            return None
        return predict_errors_mm(answer.estimate, self._bone, self._targets_mm)

    def _measure(self, answer: FrameAnswer, true: RigidTransform | None) -> PoseErrors:
        if answer.pose is None or true is None:
            return PoseErrors()
        return measure_pose(
            answer.pose,
            true,
            self._bone,
            self._targets_mm,
            self._answers.surface,
            self._rectifier.geometry,
            self._sequence.true_targets_mm,
        )

    def _measure_budget(
        self, place: int, answer: FrameAnswer, true: RigidTransform | None
    ) -> ErrorBudget | None:
        """The error budget of every fifth frame that is OK; None for others."""
        is_asked = self._has_budget and place % _BUDGET_EVERY == 1
        if not (is_asked and answer.is_ok) or answer.pose is None or true is None:
            return None
        if len(self._targets_mm) == 0:
            return None
        return measure_budget(
            self._sequence.frames[place],
            answer.pose,
            true,
            self._answers.surface,
            self._bone.mesh.centroid_mm,
            self._targets_mm,
            self._rectifier,
            make_sensor(self._sequence.configuration.camera.simulated),
        )


def _finite(bound_mm: float | None) -> float | None:
    """None for an infinite bound."""
    return None if bound_mm is None or math.isinf(bound_mm) else bound_mm


def _find_rms_ratio(verdict: Verdict | None) -> float | None:
    """Residual of the fit over the expected one."""
    if verdict is None or verdict.rms_mm is None or not verdict.expected_rms_mm:
        return None
    ratio = verdict.rms_mm / verdict.expected_rms_mm
    return ratio if math.isfinite(ratio) else None
