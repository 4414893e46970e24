"""What a fit on the model leaves beyond the noise: tissue that lies flush, a pose beside the true.

Noise has nothing in common with the noise a window further. Tissue that rises from the bone, or a
model that lies half a millimetre off, leaves residuals that go together over centimetres: no number
of points averages them out, and a narrow kernel hides how large they are.
"""

from dataclasses import replace

from navapp.registration.step_kernels import noise_under_kernel_mm2
from navapp.tracking.follower import ON_MODEL
from navapp.tracking.surface_meter import FREE_CORRELATION_PX, MODEL_CORRELATION_PX
from navapp.values import PoseEstimate, Reason

# Standard deviation of residuals over the one they claim: the right poses of simulated femurs,
# which lie in the open, reach so much and no more (docs/accuracy.md).
_NOISE_RATIO = 0.65
# More correlated residuals than noise is no fit.
_LARGEST_RATIO2 = 2.0 * _NOISE_RATIO**2


def shown_ratio2(estimate: PoseEstimate) -> float:
    """Variance of the residuals of a fit on the model over the one they claim.

    It is that of all residuals, told from those that the kernel lets through.
    """
    claimed_mm = max(estimate.expected_rms_mm, 1e-9)
    kernel_mm = max(ON_MODEL.narrowest_mm, ON_MODEL.n_sigmas * claimed_mm)
    return float(noise_under_kernel_mm2(estimate.rms_mm**2, 1.0, kernel_mm)) / claimed_mm**2


def is_misfit(estimate: PoseEstimate) -> bool:
    """Whether residuals of a fit on the model have more in common than they have noise."""
    return shown_ratio2(estimate) > _LARGEST_RATIO2


def noise_ratio2(*, lies_open: bool) -> float:
    """Variance that the noise of a fit on the model has, over the one that it claims.

    Of a bone that lies in the open it is what right poses show at most, whatever this one shows:
    few residuals may show less by chance. Of one that is hidden for the most part the claim stands:
    what lies flush with it may fit as well.

    Args:
        lies_open: more of the model is seen than is hidden.
    """
    return _NOISE_RATIO**2 if lies_open else 1.0


def with_correlated_residuals(estimate: PoseEstimate, noise2: float) -> PoseEstimate:
    """An estimate on the model with what its residuals show beyond noise in its covariance.

    That part goes together over as many pixels as errors of a free measurement do, noise over a
    matching window: with e the ratio of its variance to the one that is claimed, the covariance
    grows by 1 + e / n^2 (l_free / l_model)^2. When it is as large as the noise, the surface does
    not fit.

    Args:
        estimate: of a fit on the model.
        noise2: n^2, see `noise_ratio2`: what its covariance was made with.
    """
    excess = max(0.0, shown_ratio2(estimate) - _NOISE_RATIO**2)
    growth = 1.0 + excess / noise2 * (FREE_CORRELATION_PX / MODEL_CORRELATION_PX) ** 2
    widened = replace(estimate, covariance=growth * estimate.covariance)
    return widened.doubted(Reason.SURFACE_MISFIT) if is_misfit(estimate) else widened
