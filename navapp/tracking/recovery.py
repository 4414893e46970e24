"""After a loss: where else the bone may be, a part of it in every other frame.

A search around the last pose finds what moved by little. Further off, only some of the starts
around it lead to the bone, and a frame has no time for all of them: each other lost frame tries a
part that is spread over all directions, until every start had its turn.
"""

import time
from dataclasses import replace

from navapp.geometry.rectification import RectifiedPair
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.registration import RegistrationModel, scattered_starts
from navapp.tracking.first_look import doubted, poses_to_refine
from navapp.tracking.fit_judge import FitJudge
from navapp.tracking.follower import Fit, sum_timings
from navapp.tracking.locator import WIDE_VIEW, Locator
from navapp.tracking.surface_meter import Measurement, SurfaceMeter
from navapp.values import LineTimings

# Steps along each axis, and the tilts of each: (mm, ((deg, how many), ...)).
_RINGS = (
    (20.0, ((15.0, 6), (28.0, 12))),
    (40.0, ((20.0, 6), (35.0, 8))),
)
_PARTS = 10
# So many of the answers are measured exactly, if they explain so much of what the best does.
_N_SETTLED, _SETTLED_SHARE = 2, 0.7


class Recovery:
    """Looks for one bone that was lost; holds only what is constant."""

    def __init__(
        self,
        meter: SurfaceMeter,
        model: RegistrationModel,
        locator: Locator,
        fit_judge: FitJudge,
    ) -> None:
        """Join what measures, locates and judges.

        Args:
            meter: measures surfaces.
            model: of the bone.
            locator: of the bone.
            fit_judge: tells how much a pose explains.
        """
        self._meter, self._model = meter, model
        self._locator, self._fit_judge = locator, fit_judge

    def found_again(self, pair: RectifiedPair, pose: RigidTransform, n_lost: int) -> Fit | None:
        """Around an expected pose; or in every other lost frame further off, from a few starts.

        Args:
            pair: pictures, rectified widely around that pose.
            pose: expected, in the rectified camera.
            n_lost: frames lost before this one.

        Returns:
            None out of view.
        """
        locator, centre_mm = self._locator, self._model.centre_mm
        # The baseline has the expected pose and nothing else.
        starts = [] if locator.is_baseline else starts_after_loss(pose, centre_mm, n_lost)
        measured = self._meter.freely(pair, pose, WIDE_VIEW) if starts else None
        if measured is None or len(measured.cloud) == 0:
            return locator.search(pair, pose, locator.settings.search)
        started = time.perf_counter_ns()
        poses = self._best(measured, starts) or [pose]
        coarse = LineTimings(estimate_ms=(time.perf_counter_ns() - started) / 1e6)
        fits = [locator.settle(pair, measured, one) for one in poses]
        for fit in fits:
            coarse = sum_timings(coarse, fit.timings)
        # Far from where it was, a bone may look like itself in several ways.
        best = doubted(fits, [self._fit_judge.score(fit) for fit in fits], self._model)[0]
        return replace(best, timings=coarse)

    def _best(self, measured: Measurement, starts: list[RigidTransform]) -> list[RigidTransform]:
        """Of the poses that starts lead to, those that explain most."""
        found = self._fit_judge.led_to(measured, starts)
        return poses_to_refine(found, _N_SETTLED, _SETTLED_SHARE)


def starts_after_loss(
    last: RigidTransform, centre_mm: FloatArray, n_lost: int
) -> list[RigidTransform]:
    """What to start from besides the last pose; nothing in every other frame.

    Args:
        last: pose of the bone when it was seen last.
        centre_mm: (3,) of the model, in bone coordinates.
        n_lost: frames lost before this one.
    """
    if n_lost % 2 == 0:
        return []
    part = n_lost // 2 % _PARTS
    return _all_starts(last, last.apply(centre_mm))[part::_PARTS]


def _all_starts(last: RigidTransform, place_mm: FloatArray) -> list[RigidTransform]:
    """Tilts of the last pose where it was, and a step away along each axis."""
    starts: list[RigidTransform] = []
    for step_mm, tilts in _RINGS:
        starts += scattered_starts(last, place_mm, step_mm, tilts, has_middle=not starts)
    return starts
