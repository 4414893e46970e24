"""Matching and fitting in turns: from an expected pose to the pose that the pictures show."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import Literal

from navapp.geometry.rectification import RectifiedPair
from navapp.geometry.transform import RigidTransform
from navapp.registration import BimccSettings, RegistrationModel, fit_icp
from navapp.tracking.follower import (
    Fit,
    Follower,
    FollowerSettings,
    OnMeasured,
    fitted,
    moved_surface_mm,
    sum_timings,
)
from navapp.tracking.surface_meter import Margins, Measurement, SurfaceMeter
from navapp.values import LineTimings

Method = Literal["bimcc", "icp"]

# Points that were measured freely know their noise, but not all of their errors.
STEREO_SETTINGS = BimccSettings(narrowest_mm=0.5, n_sigmas=1.6)
_NEARBY = replace(STEREO_SETTINGS, widest_mm=3.0)
# Rectified around an expected bone: a little more than is matched when it is there, for it may have
# moved; much more when it has to be searched.
NEAR_VIEW = Margins(box_px=56, band_mm=60.0)
WIDE_VIEW = Margins(box_px=120, band_mm=65.0)


@dataclass(frozen=True, slots=True)
class LocatorSettings:
    """How the bone is located around an expected pose.

    Attributes:
        method: `bimcc` is the production chain, `icp` the paper's baseline.
        tracking: margins from frame to frame.
        search: margins of a first registration, and after a loss.
        follower: how the model itself is matched.
        near_share: when so much of the model's pixels answers, the bone is where it was expected.
        hidden_share: when only so much answers, something may hide the rest of the bone: it is
            where it was expected if the fit moved it by no more than `stay_mm`.
        stay_mm: see `hidden_share`.
    """

    method: Method = "bimcc"
    tracking: Margins = field(default_factory=lambda: Margins(box_px=16, band_mm=15.0))
    search: Margins = field(default_factory=lambda: Margins(box_px=60, band_mm=35.0))
    follower: FollowerSettings = field(default_factory=FollowerSettings)
    near_share: float = 0.45
    hidden_share: float = 0.3
    stay_mm: float = 0.7


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
        self._follower = Follower(meter, model, settings.follower, settings.tracking)

    @property
    def is_baseline(self) -> bool:
        """The paper's chain: one matching, one fit."""
        return self.settings.method == "icp"

    def locate(
        self,
        pair: RectifiedPair,
        pose: RigidTransform,
        on_measured: OnMeasured = lambda measured, pose: None,
    ) -> Fit | None:
        """The bone near an expected pose; None out of view.

        Matching on the model itself is exact but sees only what is close. When samples of it say
        that the bone is elsewhere, the surface is measured freely before it goes on. When the bone
        is half hidden, or moved, both are tried, and what explains more of the model stands.

        Args:
            pair: pictures.
            pose: expected, in the rectified camera.
            on_measured: told what is measured on the model next to that pose, before it is fitted.
        """
        if self.is_baseline:
            return self.search(pair, pose, self.settings.tracking)
        stayed, timings = self._follower.follow(
            pair, pose, self.settings.hidden_share, on_measured=on_measured
        )
        if stayed is not None and self._is_here(stayed, pose):
            return replace(stayed, timings=timings)
        found = self.search(pair, pose, self.settings.tracking)
        if found is not None:
            timings = sum_timings(timings, found.timings)
        fits = [fit for fit in (stayed, found) if fit is not None]
        best = max(fits, key=self._score) if len(fits) > 1 else next(iter(fits), None)
        return None if best is None else replace(best, timings=timings)

    def rests(self, pair: RectifiedPair, pose: RigidTransform) -> Iterator[Fit]:
        """Where the model rests next to an expected pose, from samples of it and from all of it."""
        if self.is_baseline:
            fits = [self.search(pair, pose, self.settings.tracking)]
            yield from (fit for fit in fits if fit is not None)
            return
        for is_near in (False, True):
            fit, timings = self._follower.follow(
                pair, pose, self.settings.hidden_share, is_near=is_near
            )
            if fit is not None:
                yield replace(fit, timings=timings)

    def _is_here(self, fit: Fit, expected: RigidTransform) -> bool:
        """Enough of the model answers, or what answers is where it was expected."""
        share = fit.measured.answered_share
        if share >= self.settings.near_share:
            return True
        is_seen = share >= self.settings.hidden_share
        moved_mm = moved_surface_mm(self._model, expected, fit.pose)
        return is_seen and moved_mm <= self.settings.stay_mm

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

    def _settled(self, pair: RectifiedPair, free: Fit) -> Fit:
        """A free fit followed onto the model; as it was when nothing answers there."""
        followed, timings = self._follower.follow(pair, free.pose)
        timings = sum_timings(free.timings, timings)
        if followed is None:
            return replace(free, timings=timings)
        return replace(followed, timings=timings, n_rounds=followed.n_rounds + 1)

    def _fitted(
        self,
        measured: Measurement,
        start: RigidTransform,
        settings: BimccSettings = STEREO_SETTINGS,
    ) -> Fit:
        if not self.is_baseline:
            return fitted(measured, self._model, start, settings)
        started = time.perf_counter_ns()
        estimate = fit_icp(measured.scene, self._model, start)
        estimate_ms = (time.perf_counter_ns() - started) / 1e6
        return Fit(estimate, measured, replace(measured.timings, estimate_ms=estimate_ms))
