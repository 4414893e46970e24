"""The bone near an expected pose: matched on the model itself, or measured freely around it."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from navapp.geometry.transform import RigidTransform
from navapp.registration import BimccSettings, fit_bimcc
from navapp.tracking.following import Follower, RestSettings
from navapp.tracking.frame import FREE_FIT, Fit, Frame
from navapp.tracking.surface_meter import Margins, Measurement, SurfaceMeter

_NEARBY_FIT = FREE_FIT._replace(widest_mm=3.0)


@dataclass(frozen=True, slots=True)
class NearSettings:
    """How the bone is located around an expected pose; all chosen.

    Attributes:
        tracking: margins from frame to frame.
        search: margins of a first registration, and after a loss.
        rest: when a pose rests on the model.
        near_fraction: when so much of the model's pixels answers, the bone is where it was
            expected.
        hidden_fraction: when only so much answers, something may hide the rest of the bone: it is
            where it was expected if the fit moved it by no more than `stay_mm`.
        stay_mm: see `hidden_fraction`.
    """

    tracking: Margins = field(default_factory=lambda: Margins(box_px=16, band_mm=15.0))
    search: Margins = field(default_factory=lambda: Margins(box_px=60, band_mm=35.0))
    rest: RestSettings = field(default_factory=RestSettings)
    near_fraction: float = 0.45
    hidden_fraction: float = 0.3
    stay_mm: float = 0.7


class NearSearch:
    """Searches for one bone near an expected pose.

    Args:
        meter: of the bone's surface.
        score: how much of the model a fit explains; decides between two.
        settings: of the search.
    """

    def __init__(
        self, meter: SurfaceMeter, score: Callable[[Fit], float], settings: NearSettings
    ) -> None:
        self.settings = settings
        self._meter, self._score = meter, score
        self._follower = Follower(meter, settings.rest, settings.tracking)

    def find(self, frame: Frame) -> list[Fit | None]:
        """The one fit that explains most; None out of view.

        Matching on the model itself is exact but sees only what is close. When samples of it say
        that the bone is elsewhere, the surface is measured freely before it goes on. When the bone
        is half hidden, or moved, both are tried, and what explains more of the model stands.
        """
        stayed = self._follower.follow(
            frame, frame.start, self.settings.hidden_fraction, on_measured=frame.on_measured
        )
        if stayed is not None and self._is_here(stayed, frame.start):
            return [stayed]
        found = self.find_freely(frame, self.settings.tracking)
        fits = [fit for fit in (stayed, found) if fit is not None]
        return [max(fits, key=self._score) if len(fits) > 1 else next(iter(fits), None)]

    def find_rests(self, frame: Frame) -> Iterator[Fit]:
        """Where the model rests next to the start, from samples of it and from all of it."""
        for is_near in (False, True):
            fit = self._follower.follow(
                frame, frame.start, self.settings.hidden_fraction, is_near=is_near
            )
            if fit is not None:
                yield fit

    def find_freely(self, frame: Frame, margins: Margins) -> Fit | None:
        """Measure freely around the start, fit from far, then settle; None out of view."""
        measured = self._meter.measure_freely(frame.pair, frame.start, margins)
        frame.watch.lap("stereo")
        if measured is None:
            return None
        far = self._follow_on(frame, self._fit(frame, measured, frame.start, FREE_FIT))
        if (
            far.measured.view is not None
            and far.measured.answered_fraction >= self.settings.near_fraction
        ):
            return far
        return max(far, self.settle(frame, measured, frame.start), key=self._score)

    def settle(self, frame: Frame, measured: Measurement, pose: RigidTransform) -> Fit:
        """Fit to a free measurement nearby, then follow onto the model itself if it is there.

        Nearby, because half of what is measured freely may be a hand: a fit that may look far ends
        on it even from the truth.
        """
        return self._follow_on(frame, self._fit(frame, measured, pose, _NEARBY_FIT))

    def _is_here(self, fit: Fit, expected: RigidTransform) -> bool:
        """Enough of the model answers, or what answers is where it was expected."""
        answered = fit.measured.answered_fraction
        if answered >= self.settings.near_fraction:
            return True
        moved_mm = expected.mean_motion_mm(fit.pose, self._meter.model.hull_mm)
        return answered >= self.settings.hidden_fraction and moved_mm <= self.settings.stay_mm

    def _follow_on(self, frame: Frame, free: Fit) -> Fit:
        """A free fit followed onto the model; as it was when nothing answers there."""
        return self._follower.follow(frame, free.pose) or free

    def _fit(
        self, frame: Frame, measured: Measurement, start: RigidTransform, settings: BimccSettings
    ) -> Fit:
        estimate = fit_bimcc(measured.scene, self._meter.model, start, settings)
        frame.watch.lap("estimate")
        return Fit(estimate, measured)
