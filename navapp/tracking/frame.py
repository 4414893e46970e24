"""One pair of pictures on its way through the tracker."""

from collections.abc import Callable
from dataclasses import dataclass, replace

from navapp.geometry.rectification import RectifiedPair
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.registration import BimccSettings, RegistrationModel
from navapp.registration.step_kernels import noise_under_kernel_mm2
from navapp.tracking.checks import PairChecks
from navapp.tracking.row_times import RowTimes
from navapp.tracking.surface_meter import FREE_CORRELATION_PX, MODEL_CORRELATION_PX, Measurement
from navapp.values import PoseEstimate, Reason, StereoPictures, Stopwatch
from navapp.values.progress import Progress

# Kernels of the fits: points that were measured freely know their noise, but not all of their
# errors; on the model a kernel as narrow as the noise costs little, and keeps out tissue that lies
# flush with the bone. All chosen.
FREE_SETTINGS = BimccSettings(narrowest_mm=0.5, n_sigmas=1.6)
MODEL_SETTINGS = BimccSettings(narrowest_mm=0.2, n_sigmas=1.2)

# Variance of residuals over the one that the matcher claims. So much do correct poses of simulated
# femurs, which lie in the open, show at most (tests.bench.correlated_residuals).
NOISE_VARIANCE_RATIO = 0.57**2
# Up to this, what residuals show beyond the noise is no sign of a misfit. Chosen: right poses of
# glossy bones show more than femurs.
TOLERATED_VARIANCE_RATIO = 0.65**2

OnMeasured = Callable[[Measurement, RigidTransform], object]


def ignore(*_: object) -> None:
    """Does nothing: the default of callbacks."""


def limit_kernel(settings: BimccSettings, model: RegistrationModel) -> BimccSettings:
    """The settings, with no kernel wider than `model.widest_kernel_mm`."""
    return settings._replace(widest_mm=min(settings.widest_mm, model.widest_kernel_mm))


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """A rectified pair, where the bone is expected in it, and what is asked of a search."""

    pictures: StereoPictures  # that were rectified
    pair: RectifiedPair  # grey pictures, rectified as far around the bone as is looked
    start: RigidTransform  # rectified left camera from bone, expected
    watch: Stopwatch
    # as `start`, by the motion or by an earlier answer; None: a jump is not judged.
    predicted: RigidTransform | None = None
    checks: PairChecks | None = None  # of the pair, begun
    # when the rows of the pictures see a moving bone; None where they see it all at once.
    times: RowTimes | None = None
    row_shifts_px: tuple[FloatArray, FloatArray] | None = None  # of `pair` (`Rectifier.rectify`)
    # told the fraction done of a long search; what it raises stops the search.
    on_progress: Progress = ignore


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """A pose in the rectified left camera, and the surface it was fitted to."""

    estimate: PoseEstimate
    measured: Measurement

    @property
    def pose(self) -> RigidTransform:
        """The rectified left camera from the bone."""
        return self.estimate.camera_from_bone

    @property
    def variance_ratio(self) -> float:
        """Variance of the residuals over the one they claim, of a fit on the model.

        Estimated for all residuals from those inside the kernel.
        """
        claimed_mm = max(self.estimate.expected_rms_mm, 1e-9)
        kernel_mm = max(MODEL_SETTINGS.narrowest_mm, MODEL_SETTINGS.n_sigmas * claimed_mm)
        squares_mm2 = self.estimate.rms_mm**2
        return float(noise_under_kernel_mm2(squares_mm2, 1.0, kernel_mm)) / claimed_mm**2

    def with_reason(self, reason: Reason) -> "Fit":
        """The same fit with one more reason against its pose."""
        return replace(self, estimate=self.estimate.with_reason(reason))

    def with_correlated_residuals(self, noise_variance_ratio: float) -> "Fit":
        """The fit on the model, its covariance grown by what its residuals show beyond noise.

        Noise is correlated over a matching window, l_model. Tissue that rises from the bone, or a
        model that lies half a millimetre off, leaves residuals that are correlated over
        centimetres, as errors of a free measurement are, l_free: no number of points averages them
        out. With e = `variance_ratio` - `TOLERATED_VARIANCE_RATIO`, where positive, and
        n^2 = `noise_variance_ratio`, the covariance grows by 1 + e / n^2 (l_free / l_model)^2, and
        with it the outline's part, which is then larger than it has to be.
        """
        excess = max(0.0, self.variance_ratio - TOLERATED_VARIANCE_RATIO)
        lengths = FREE_CORRELATION_PX / MODEL_CORRELATION_PX
        growth = 1.0 + excess / noise_variance_ratio * lengths**2
        # The size's stays: what does not fit for another size is not to hide it.
        covariance = growth * self.estimate.covariance
        return replace(self, estimate=replace(self.estimate, covariance=covariance))
