"""The bone near an expected pose: matched on the model itself, or measured freely around it."""

from collections.abc import Callable, Iterator

from navapp.geometry.transform import RigidTransform
from navapp.registration import BimccSettings, fit_bimcc
from navapp.tracking.following import Follower
from navapp.tracking.frame import FREE_SETTINGS, Fit, Frame, ignore, limit_kernel
from navapp.tracking.surface_meter import NEAR_BOX, Margins, Measurement, SurfaceMeter

_NEARBY_SETTINGS = FREE_SETTINGS._replace(widest_mm=3.0)


# Chosen. When less of the model's samples is matched, they are not followed.
LEAST_FRACTION = 0.3
# Chosen. When so much of the model is matched, the bone is where it was looked for.
SURE_FRACTION = 0.45


class NearSearch:
    """Searches for one bone near an expected pose.

    Args:
        meter: of the bone's surface.
        score: how much of the model a fit explains; decides between two.
    """

    def __init__(self, meter: SurfaceMeter, score: Callable[[Fit], float]) -> None:
        self._meter, self._score = meter, score
        self._follower = Follower(meter)

    def find(self, frame: Frame) -> Iterator[Fit | None]:
        """Where the model rests, then what explains more of it: a caller takes as many as it needs.

        Matching on the model is exact but sees only what is close. Unless samples of it led to
        where much of it is matched, the surface is measured freely as well. None: out of view.
        """
        sampled = self._rest(frame)
        if sampled is not None:
            yield sampled
        whole = self._rest(frame, skips_samples=True)
        if whole is not None:
            yield whole
        if sampled is not None and sampled.measured.matched_fraction >= SURE_FRACTION:
            return
        found = self.find_freely(frame, NEAR_BOX)
        scores = [self._score(fit) for fit in (sampled, whole) if fit is not None]
        if not scores or (found is not None and self._score(found) > max(scores)):
            yield found

    def find_on_model(self, frame: Frame) -> Iterator[Fit]:
        """Fits on the model alone: from samples of it first, then from all of it at once."""
        for skips_samples in (False, True):
            if (fit := self._rest(frame, skips_samples=skips_samples)) is not None:
                yield fit

    def _rest(self, frame: Frame, *, skips_samples: bool = False) -> Fit | None:
        told = ignore if frame.checks is None else frame.checks.check
        return self._follower.follow(
            frame, frame.start, LEAST_FRACTION, skips_samples=skips_samples, on_measured=told
        )

    def find_freely(self, frame: Frame, margins: Margins) -> Fit | None:
        """Measure freely around the start, fit, then follow onto the model; None out of view."""
        measured = self._meter.measure_freely(frame.pair, frame.start, margins)
        frame.watch.lap("stereo")
        if measured is None:
            return None
        settings = limit_kernel(FREE_SETTINGS, self._meter.model)
        far = self._fit(frame, measured, frame.start, settings)
        is_on_model = far.measured.rendered is not None
        if is_on_model and far.measured.matched_fraction >= SURE_FRACTION:
            return far
        return max(far, self.fit_nearby(frame, measured, frame.start), key=self._score)

    def fit_nearby(self, frame: Frame, measured: Measurement, pose: RigidTransform) -> Fit:
        """Fit to a free measurement nearby, then follow onto the model if it is there.

        Nearby, because half of what is measured freely may be a hand: a fit that may look far ends
        on it even from the truth.
        """
        return self._fit(frame, measured, pose, _NEARBY_SETTINGS)

    def _fit(
        self, frame: Frame, measured: Measurement, start: RigidTransform, settings: BimccSettings
    ) -> Fit:
        """A fit to a free measurement, followed onto the model; as it was when nothing is there."""
        estimate = fit_bimcc(measured.scene, self._meter.model, start, settings)
        frame.watch.lap("estimate")
        free = Fit(estimate, measured)
        return self._follower.follow(frame, free.pose) or free
