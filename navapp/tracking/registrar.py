"""The first registration: from a rough pose, a box or a cone to judged poses, best first."""

import time
from collections.abc import Callable

from navapp.geometry.rectification import Image, RectifiedPair
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.registration import RegistrationModel, distinct, scattered_starts, tilted_starts
from navapp.tracking.buried import BuriedBone
from navapp.tracking.causes import Causes
from navapp.tracking.first_look import FirstLook, doubted, poses_to_refine
from navapp.tracking.fit_judge import FitJudge
from navapp.tracking.follower import Fit
from navapp.tracking.judge import Goal
from navapp.tracking.locator import WIDE_VIEW, Locator
from navapp.tracking.surface_meter import Measurement, SurfaceMeter
from navapp.values import LineTimings, Prior, Reason, Status, TrackedFrame

# A first registration tries near starts first, which is so much of the work of all; then far ones;
# then it looks for a bone that is partly buried.
_NEAR_SHARE, _FAR_SHARE = 0.05, 0.45
# Tilts and shifts of a rough pose: (deg, how many).
_NEAR_TILTS = (15.0, 12)
_FAR_TILTS = ((15.0, 12), (28.0, 20))
_FAR_SHIFT_MM = 8.0
# Candidates of a search everywhere that explain less than this share of the best are left out.
_REFINED_SHARE = 0.5


class Registrar:
    """Finds one bone under one rig for the first time; holds only what is constant."""

    def __init__(
        self,
        meter: SurfaceMeter,
        model: RegistrationModel,
        locator: Locator,
        fit_judge: FitJudge,
        first_look: FirstLook,
        buried: BuriedBone,
        causes: Causes,
        n_refined: int,
    ) -> None:
        """Join what measures, locates and judges.

        Args:
            meter: measures surfaces.
            model: of the bone.
            locator: of the bone.
            fit_judge: of its fits.
            first_look: tells where the bone may be without a pose.
            buried: finds a bone that is partly buried in tissue.
            causes: tells what is wrong for good when the bone is not found.
            n_refined: so many answers of a search are refined.
        """
        self._meter, self._model = meter, model
        self._locator, self._fit_judge = locator, fit_judge
        self._first_look, self._buried, self._causes = first_look, buried, causes
        self._n_refined = n_refined

    def register(
        self,
        left: Image,
        right: Image,
        prior: Prior,
        goal: Goal,
        on_progress: Callable[[float], None],
    ) -> list[TrackedFrame]:
        """Distinct candidates, best first; see `Line.register`."""
        start = prior.left_from_bone.get(self._model.bone.name)
        if start is None:
            answers = self._anywhere(left, right, prior, goal, on_progress)
            start = answers[0].left_from_bone if answers else None
        else:
            rough = self._meter.geometry.rectified_from_left @ start
            pair, timings = self._meter.rectified(left, right, rough, WIDE_VIEW)
            answers = self._around(pair, rough, goal, timings, on_progress)
        if not answers or answers[0].verdict.status is Status.OK or self._locator.is_baseline:
            return answers
        around = None if start is None else self._meter.geometry.rectified_from_left @ start
        cause = self._causes.of_failure(left, right, around, answers[0], on_progress)
        return [answer.because(cause) for answer in answers]

    def _around(
        self,
        pair: RectifiedPair,
        rough: RigidTransform,
        goal: Goal,
        timings: LineTimings,
        on_progress: Callable[[float], None],
    ) -> list[TrackedFrame]:
        """Around a rough pose: near starts, far ones, partly buried, until one gives an OK."""
        locator = self._locator
        measured = self._meter.freely(
            pair, rough, locator.settings.search, is_baseline=locator.is_baseline
        )
        if measured is None or len(measured.cloud) == 0:
            return [self._fit_judge.lost(Reason.NO_SURFACE)]
        if locator.is_baseline:
            # The paper's baseline has its start and nothing else.
            fit = locator.settle(pair, measured, rough)
            return [self._fit_judge.judged(pair, fit, goal, timings)]

        def looked_from(starts: list[RigidTransform], done: float, share: float) -> list[Fit]:
            poses = self._coarse(measured, starts, lambda part: on_progress(done + share * part))
            return [locator.settle(pair, measured, pose) for pose in poses]

        centre_mm = rough.apply(self._model.centre_mm)
        fits = looked_from(near_starts(rough, centre_mm), 0.0, _NEAR_SHARE)
        answers = self._ranked(pair, fits, goal, timings)
        if not _is_ok(answers):
            fits += looked_from(far_starts(rough, centre_mm), _NEAR_SHARE, _FAR_SHARE)
            answers = self._ranked(pair, fits, goal, timings)
        if not _is_ok(answers):
            done = _NEAR_SHARE + _FAR_SHARE
            slid = self._buried.found(
                pair, measured, rough, lambda part: on_progress(done + (1.0 - done) * part)
            )
            buried = self._fit_judge.judged(pair, slid, goal, timings)
            answers = sorted([buried, *answers], key=lambda one: one.verdict.order)
        on_progress(1.0)
        return answers

    def _anywhere(
        self,
        left: Image,
        right: Image,
        prior: Prior,
        goal: Goal,
        on_progress: Callable[[float], None],
    ) -> list[TrackedFrame]:
        """Without a pose to start from; the paper's baseline cannot."""
        if not prior.starts(self._model.bone.name) or self._locator.is_baseline:
            return []
        started = time.perf_counter_ns()
        pair, candidates = self._first_look.candidates(left, right, prior, on_progress)
        timings = LineTimings(estimate_ms=(time.perf_counter_ns() - started) / 1e6)
        poses = poses_to_refine(candidates, self._n_refined, _REFINED_SHARE)
        found = [self._from_candidate(pair, pose) for pose in poses]
        fits = [fit for fit in found if fit is not None]
        if not fits:
            return [self._fit_judge.lost(Reason.NO_SURFACE, timings)]
        return self._ranked(pair, fits, goal, timings)

    def _from_candidate(self, pair: RectifiedPair, pose: RigidTransform) -> Fit | None:
        """What explains more: the model matched where it is expected, or what lies around it.

        Clutter around a bone can pull it away from where the first finds it.
        """
        locator = self._locator
        fits = (locator.locate(pair, pose), locator.search(pair, pose, locator.settings.search))
        found = (fit for fit in fits if fit is not None)
        return max(found, key=self._fit_judge.score, default=None)

    def _coarse(
        self,
        measured: Measurement,
        starts: list[RigidTransform],
        on_progress: Callable[[float], None],
    ) -> list[RigidTransform]:
        """The best distinct poses that starts lead to."""
        found = self._fit_judge.led_to(measured, starts, on_progress)
        return [candidate.scene_from_bone for candidate in found[: self._n_refined]]

    def _ranked(
        self, pair: RectifiedPair, fits: list[Fit], goal: Goal, timings: LineTimings
    ) -> list[TrackedFrame]:
        """Distinct answers, best first; a guess is called one."""
        fits = doubted(fits, [self._fit_judge.score(fit) for fit in fits], self._model)
        kept = distinct([fit.pose for fit in fits], self._model.centre_mm)
        return [
            self._fit_judge.judged(pair, fit, goal, timings) for fit in fits if fit.pose in kept
        ]


def _is_ok(answers: list[TrackedFrame]) -> bool:
    return bool(answers) and answers[0].verdict.status is Status.OK


def near_starts(rough: RigidTransform, centre_mm: FloatArray) -> list[RigidTransform]:
    """A rough pose, and tilts of it about a place in the camera's frame."""
    return tilted_starts(rough, centre_mm, *_NEAR_TILTS)


def far_starts(rough: RigidTransform, centre_mm: FloatArray) -> list[RigidTransform]:
    """Tilts of a rough pose and of what it becomes when shifted along each axis."""
    return scattered_starts(rough, centre_mm, _FAR_SHIFT_MM, _FAR_TILTS)
