"""A buried bone: one that is partly covered by tissue which continues its surface.

Fits of such a bone come to rest at many places within a millimetre of the true one. At the true one
most of the model is matched to within the noise. So one step onto the model is taken from many
starts, the best ends are the next starts, and of all that then come to rest the one with the
smallest residuals stands.
"""

from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from navapp.geometry.bands import map_both
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.registration import DepthMap, PoseSampler, rank_fits
from navapp.tracking.following import Follower, RestSettings
from navapp.tracking.frame import Fit, Frame, ignore
from navapp.tracking.surface_meter import Measurement, SurfaceMeter
from navapp.values import Stopwatch
from navapp.values.progress import tell_part

# All chosen; compared in tests.bench.buried_bone. The same pictures give the same draws.
_SEED = 20
# A place is scored under a kernel as wide as the noise on the model, at so many points.
_SIGMA_MM, _N_POINTS = 0.1, 3000
# So much of the work is the search on the free measurement, then come the steps.
_SEARCH_FRACTION = 0.3


class Round(NamedTuple):
    """From each place so many starts, drawn with a standard deviation along and about each axis.

    `n_kept` of all that they lead to, and of the places themselves, are the next places.
    """

    n_starts: int
    shift_mm: float
    turn_deg: float
    n_kept: int

    @property
    def deviations(self) -> FloatArray:
        """(6,) of a twist."""
        return np.repeat([self.shift_mm, np.radians(self.turn_deg)], 3)


class Place(NamedTuple):
    """Where a step onto the model led, and how much of it answers there."""

    fit: Fit
    score: float


# The free measurement finds places a millimetre beside the true one. Matching on the model sees
# half a pixel, which is as far: each round is drawn a little nearer than the one before.
_N_PLACES = 3
_ROUNDS = (
    Round(12, 0.7, 1.2, 8),
    Round(5, 0.5, 0.8, 6),
    Round(5, 0.4, 0.6, 5),
    Round(5, 0.25, 0.4, 5),
)
# A prediction is off by part of a frame's motion.
_N_FRAME_STARTS, _N_FRAME_PLACES = 16, 6
_FRAME_ROUNDS = (Round(6, 0.5, 0.8, 4), Round(5, 0.3, 0.5, 3))


class BuriedSearch:
    """Searches for one bone that tissue continues, on both threads.

    All of its time counts as that of the estimate.
    """

    def __init__(self, meter: SurfaceMeter) -> None:
        self._meter = meter
        self._follower = Follower(meter)
        self._stepper = Follower(meter, RestSettings(max_rounds=1))

    @cached_property
    def _sampler(self) -> PoseSampler:
        return PoseSampler(self._meter.model)

    def find(self, frame: Frame) -> Iterator[Fit | None]:
        """From one frame to the next: the best around the start, if there is one."""
        random = np.random.default_rng(_SEED)
        twists = random.standard_normal((_N_FRAME_STARTS, 6)) * _ROUNDS[0].deviations
        centre_mm = frame.start.apply(self._meter.model.centre_mm)
        places = self._step_from(frame, [frame.start.move(twist, centre_mm) for twist in twists])
        places = _select_best(places, _N_FRAME_PLACES)
        for one in _FRAME_ROUNDS:
            places = self._improve(frame, places, one, random)
        fit = self.select(self._rest(frame, places))
        if fit is not None:
            yield fit

    def find_around(self, frame: Frame, measured: Measurement) -> Fit | None:
        """The bone around a rough start, from what was measured freely around it.

        The fit says so when it is ambiguous; None when nothing is matched.
        """
        begin = tell_part(frame.on_progress, 0.0, _SEARCH_FRACTION)
        depth = DepthMap.of(self._meter.geometry, measured.disparity)
        found = self._sampler.search(depth, frame.start, _N_PLACES, begin)
        return self.select(self.rest_from(frame, [one.scene_from_bone for one in found]))

    def rest_from(self, frame: Frame, starts: list[RigidTransform]) -> list[Fit]:
        """Fits at rest, of the best that starts a millimetre or two off lead to."""
        go_on = tell_part(frame.on_progress, _SEARCH_FRACTION, 1.0)
        places = self._step_from(frame, starts)
        random = np.random.default_rng(_SEED)
        for number, one in enumerate(_ROUNDS):
            go_on(number / len(_ROUNDS))
            places = self._improve(frame, places, one, random)
        return self._rest(frame, places)

    def _step_from(self, frame: Frame, starts: list[RigidTransform]) -> list[Place]:
        """Where one step onto the model leads from each start."""
        _ = self._sampler  # made here once, not in both threads

        def step(start: RigidTransform) -> Place | None:
            fit = self._stepper.follow(_with_own_watch(frame), start, skips_samples=True)
            if fit is None or not fit.estimate.has_finite_covariance:
                return None
            depth = DepthMap.of(self._meter.geometry, fit.measured.disparity)
            return Place(fit, self._sampler.score(depth, fit.pose, _SIGMA_MM, _N_POINTS))

        places = map_both(step, starts, ignore)
        frame.watch.lap("estimate")
        return [place for place in places if place is not None]

    def _improve(
        self, frame: Frame, places: list[Place], one: Round, random: np.random.Generator
    ) -> list[Place]:
        """The best of places and of what starts around them lead to."""
        starts = [start for place in places for start in self._around(place.fit, one, random)]
        return _select_best(places + self._step_from(frame, starts), one.n_kept)

    def _around(self, fit: Fit, one: Round, random: np.random.Generator) -> list[RigidTransform]:
        """Poses beside a fit: in all directions alike, or as loosely as it is fixed, in turns.

        What slides along tissue slides where the surface holds least.
        """
        centre_mm, covariance = fit.pose.apply(self._meter.model.centre_mm), fit.estimate.covariance
        lever_mm = self._meter.model.radius_mm  # at which a turn moves the bone as much as a shift
        size_mm2 = np.trace(covariance[:3, :3]) + lever_mm**2 * np.trace(covariance[3:, 3:])
        loose = np.linalg.cholesky(covariance) * (2.0 * one.shift_mm / size_mm2**0.5)
        twists = random.standard_normal((one.n_starts, 6))
        twists[0::2] *= one.deviations
        twists[1::2] @= loose.T
        return [fit.pose.move(twist, centre_mm) for twist in twists]

    def _rest(self, frame: Frame, places: list[Place]) -> list[Fit]:
        def rest(place: Place) -> Fit | None:
            own = _with_own_watch(frame)
            return self._follower.follow(own, place.fit.pose, skips_samples=True)

        fits = map_both(rest, places, ignore)
        frame.watch.lap("estimate")
        return [fit for fit in fits if fit is not None]

    def select(self, fits: list[Fit]) -> Fit | None:
        """The fit at rest with the smallest residuals; ambiguous when another's are as small."""
        if not fits:
            return None
        fitting = [max(fit.variance_ratio, 1e-6) ** -0.5 for fit in fits]
        return rank_fits(fits, fitting, self._meter.model.centre_mm)[0]


def _with_own_watch(frame: Frame) -> Frame:
    """For another thread: a stopwatch is used by one only."""
    return replace(frame, watch=Stopwatch())


def _select_best(places: list[Place], n: int) -> list[Place]:
    return sorted(places, key=lambda place: place.score, reverse=True)[:n]
