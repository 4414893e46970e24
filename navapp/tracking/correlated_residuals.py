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


def with_correlated_residuals(estimate: PoseEstimate, *, lies_open: bool = False) -> PoseEstimate:
    """An estimate on the model whose covariance is what its residuals show, not what they claim.

    Of a bone that lies in the open, noise counts as what right poses show of the claim at most: an
    a posteriori variance factor, but never less than theirs. Of one that is hidden for the most
    part the claim stands: what lies flush with it may fit as well. What is beyond the noise goes
    together over as many pixels as errors of a free measurement do, noise over a matching window:
    with s^2 the ratio that is shown and s0^2 that of noise, what is beyond adds
    max(0, s^2 - s0^2) (l_free / l_model)^2. When it is as large as the noise, the surface does not
    fit.

    Args:
        estimate: of a fit on the model.
        lies_open: more of the model is seen than is hidden.
    """
    noise_ratio2 = _NOISE_RATIO**2
    excess = max(0.0, shown_ratio2(estimate) - noise_ratio2)
    together = excess * (FREE_CORRELATION_PX / MODEL_CORRELATION_PX) ** 2
    factor = (noise_ratio2 if lies_open else 1.0) + together
    scaled = replace(estimate, covariance=factor * estimate.covariance)
    return scaled.doubted(Reason.SURFACE_MISFIT) if is_misfit(estimate) else scaled
