"""Matching and fitting in turns: from an expected pose to the pose that the pictures show."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from typing import Literal

import numpy as np

from navapp.geometry.rectification import RectifiedPair
from navapp.geometry.transform import RigidTransform
from navapp.registration import BimccSettings, RegistrationModel, fit_bimcc, fit_icp
from navapp.tracking.surface_meter import Margins, Measurement, SurfaceMeter
from navapp.values import LineTimings, PoseEstimate, Reason

Method = Literal["bimcc", "icp"]

# Points that were measured freely know their noise, but not all of their errors.
STEREO_SETTINGS = BimccSettings(narrowest_mm=0.5, n_sigmas=1.6)
_NEARBY = replace(STEREO_SETTINGS, widest_mm=3.0)
# On the model a kernel as narrow as the noise costs little, and keeps out tissue that lies flush
# with the bone.
ON_MODEL = BimccSettings(narrowest_mm=0.2, n_sigmas=1.2)


@dataclass(frozen=True, slots=True)
class LocatorSettings:
    """How the bone is located around an expected pose.

    Attributes:
        method: `bimcc` is the production chain, `icp` the paper's baseline.
        tracking: margins from frame to frame.
        search: margins of a first registration, and after a loss.
        max_rounds: matchings, each with a fit, at most so many in a row ...
        settled_mm: ... until the bone moves by less.
        near_share: when so much of the model's pixels answers, the bone is where it was expected.
        hidden_share: when only so much answers, something may hide the rest of the bone: it is
            where it was expected if the fit moved it by no more than `stay_mm`.
        stay_mm: see `hidden_share`.
    """

    method: Method = "bimcc"
    tracking: Margins = field(default_factory=lambda: Margins(box_px=16, band_mm=15.0))
    search: Margins = field(default_factory=lambda: Margins(box_px=60, band_mm=35.0))
    max_rounds: int = 4
    settled_mm: float = 0.03
    near_share: float = 0.45
    hidden_share: float = 0.3
    stay_mm: float = 0.7


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """A pose in the rectified camera, what it was fitted to, and how long both took.

    Attributes:
        estimate: of the pose.
        measured: the surface it was fitted to.
        timings: of all matchings and fits that led to it.
        n_rounds: so many they were.
        moved_mm: how far the last one moved the bone's surface.
    """

    estimate: PoseEstimate
    measured: Measurement
    timings: LineTimings
    n_rounds: int = 1
    moved_mm: float = np.inf

    @property
    def pose(self) -> RigidTransform:
        """The rectified camera from the bone."""
        return self.estimate.camera_from_bone


class Locator:
    """Locates one bone in rectified pairs; holds only what is constant."""

    def __init__(
        self,
        meter: SurfaceMeter,
        model: RegistrationModel,
        score: Callable[[Fit], float],
        settings: LocatorSettings,
    ) -> None:
        """Join what measures and what is looked for.

        Args:
            meter: measures surfaces.
            model: of the bone.
            score: how much of the model a fit explains; decides between two.
            settings: of the search.
        """
        self.settings = settings
        self._meter = meter
        self._model = model
        self._score = score

    @property
    def is_baseline(self) -> bool:
        """The paper's chain: one matching, one fit."""
        return self.settings.method == "icp"

    def locate(self, pair: RectifiedPair, pose: RigidTransform) -> Fit | None:
        """The bone near an expected pose; None out of view.

        Matching on the model itself is exact but sees only what is close. When a quick probe says
        that the bone is elsewhere, the surface is measured freely before it goes on. When the bone
        is half hidden, or moved, both are tried, and what explains more of the model stands.
        """
        if self.is_baseline:
            return self.search(pair, pose, self.settings.tracking)
        expected = self._meter.expected(pair, pose, self.settings.tracking)
        if expected is None:
            return None
        share, probe_ms = self._meter.probed_share(expected)
        fits: list[Fit] = []
        if share >= self.settings.hidden_share:
            first = self._fitted(self._meter.on_model(expected), pose, ON_MODEL)
            first = replace(first, moved_mm=self._moved_mm(pose, first.pose))
            fits.append(self._settled(pair, first))
        if not fits or not self._is_here(fits[0], pose):
            found = self.search(pair, pose, self.settings.tracking)
            fits += [] if found is None else [found]
        timings = LineTimings(stereo_ms=probe_ms)
        for fit in fits:
            timings = sum_timings(timings, fit.timings)
        if not fits:
            return None
        best = fits[0] if len(fits) == 1 else max(fits, key=self._score)
        return replace(best, timings=timings)

    def _is_here(self, fit: Fit, expected: RigidTransform) -> bool:
        """Enough of the model answers, or what answers is where it was expected."""
        share = fit.measured.answered_share
        if share >= self.settings.near_share:
            return True
        is_seen = share >= self.settings.hidden_share
        return is_seen and self._moved_mm(expected, fit.pose) <= self.settings.stay_mm

    def search(self, pair: RectifiedPair, pose: RigidTransform, margins: Margins) -> Fit | None:
        """Measure freely around a pose, fit from far, then settle; None out of view."""
        measured = self._meter.freely(pair, pose, margins, is_baseline=self.is_baseline)
        if measured is None:
            return None
        far = self._fitted(measured, pose)
        if self.is_baseline:
            return far
        far = self._settled(pair, far)
        if far.n_rounds > 1 and far.measured.answered_share >= self.settings.near_share:
            return far
        near = self.settle(pair, replace(measured, timings=LineTimings()), pose)
        timings = sum_timings(far.timings, near.timings)
        return replace(max(far, near, key=self._score), timings=timings)

    def settle(self, pair: RectifiedPair, measured: Measurement, pose: RigidTransform) -> Fit:
        """Fit to a free measurement nearby, then follow onto the model itself if it is there.

        Nearby, because half of what is measured freely may be a hand: a fit that may look far ends
        on it even from the truth.
        """
        free = self._fitted(measured, pose, _NEARBY)
        return free if self.is_baseline else self._settled(pair, free)

    def _settled(self, pair: RectifiedPair, fit: Fit) -> Fit:
        """Match on the model and fit until the bone rests; the last fit that had enough points."""
        while fit.n_rounds < self.settings.max_rounds and fit.moved_mm >= self.settings.settled_mm:
            expected = self._meter.expected(pair, fit.pose, self.settings.tracking)
            if expected is None:
                break
            finer = self._fitted(self._meter.on_model(expected), fit.pose, ON_MODEL)
            timings = sum_timings(fit.timings, finer.timings)
            if Reason.TOO_FEW_POINTS in finer.estimate.reasons:
                return replace(fit, timings=timings)
            moved_mm = self._moved_mm(fit.pose, finer.pose)
            fit = replace(finer, timings=timings, n_rounds=fit.n_rounds + 1, moved_mm=moved_mm)
        return fit

    def _fitted(
        self,
        measured: Measurement,
        start: RigidTransform,
        settings: BimccSettings = STEREO_SETTINGS,
    ) -> Fit:
        started = time.perf_counter_ns()
        if self.is_baseline:
            estimate = fit_icp(measured.scene, self._model, start)
        else:
            estimate = fit_bimcc(measured.scene, self._model, start, settings)
        estimate_ms = (time.perf_counter_ns() - started) / 1e6
        return Fit(estimate, measured, replace(measured.timings, estimate_ms=estimate_ms))

    def _moved_mm(self, before: RigidTransform, after: RigidTransform) -> float:
        """Mean displacement of the corners around the bone's surface."""
        points_mm = self._model.hull_mm
        moved = after.apply(points_mm) - before.apply(points_mm)
        return float(np.linalg.norm(moved, axis=1).mean())


def sum_timings(a: LineTimings, b: LineTimings) -> LineTimings:
    """Both, part by part."""
    parts = {part.name: getattr(a, part.name) + getattr(b, part.name) for part in fields(a)}
    return LineTimings(**parts)
