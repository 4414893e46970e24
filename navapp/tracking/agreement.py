"""How a pose's model and the measured surface agree, pixel by pixel.

A right pose has the measured surface on the model, or something nearer in front of it: a hand, an
instrument, tissue. Nothing that is opaque can be seen behind it. Where the scene is seen through
the model, the pose is wrong, however well the rest fits.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.rectification import RectifiedGeometry
from navapp.geometry.zbuffer import RenderedView
from navapp.registration.model import RegistrationModel
from navapp.tracking.regions import large_regions
from navapp.values import DisparityMap, Origin

# Nearer or further than the model by at least this, and by so many sigma, is not the model.
_OFF_MM, _OFF_SIGMAS = 2.0, 4.0
_OFF_COARSE_PX = 1.5
_LEAST_REGION_PX2 = 25
# Matching blurs depth over the model's rim, and what lies beside the bone is further away.
_RIM_PX = 4
_FIT_SIGMAS = 3.0
_MAD_TO_SIGMA = 1.4826


@dataclass(frozen=True, slots=True)
class Agreement:
    """Comparison of the rendered model with what was measured.

    Attributes:
        n_visible: model pixels in the box.
        coverage: share of them that was measured and agrees.
        hidden_share: share of them that something nearer hides.
        behind_share: share of them through which the scene is seen.
        inlier_share: share of the measured ones that agrees; hidden ones do not count.
        spread_ratio: spread of the differences over the sigma that they claim; 0 when none is
            measured.
    """

    n_visible: int
    coverage: float
    hidden_share: float
    behind_share: float
    inlier_share: float
    spread_ratio: float

    @property
    def open_coverage(self) -> float:
        """Share of what nothing hides that was measured and agrees."""
        return self.coverage / max(1.0 - self.hidden_share, 1e-9)


NO_AGREEMENT = Agreement(0, 0.0, 0.0, 0.0, 0.0, 0.0)


def compare(
    view: RenderedView,
    model: RegistrationModel,
    measured: DisparityMap,
    geometry: RectifiedGeometry,
    coarse_px: NDArray[np.float32] | None = None,
) -> Agreement:
    """Compare a rendered model with what was measured in the same box.

    Args:
        view: of the model at the pose.
        model: for what its surface is uncertain by.
        measured: disparity over the view's box; only matched pixels count.
        geometry: of the rectified pair.
        coarse_px: (h, w) rough disparity of whatever is there, where `measured` is silent.
    """
    seen = view.mask
    n_visible = int(seen.sum())
    if n_visible == 0:
        return NO_AGREEMENT
    scale = geometry.focal_px * geometry.baseline_mm
    expected_px = np.where(seen, scale / view.depth_mm, np.nan)
    is_measured = seen & (measured.origin == Origin.MATCHED)
    difference_px = np.where(is_measured, measured.disparity_px - expected_px, np.nan)
    px_per_mm = expected_px**2 / scale
    surface_mm = model.seen_face_sigma_mm[np.maximum(view.face_index, 0)]
    sigma_px = np.hypot(measured.sigma_px, surface_mm * px_per_mm)
    off_px = np.maximum(_OFF_SIGMAS * sigma_px, _OFF_MM * px_per_mm)
    is_hidden = _large_regions(difference_px > off_px)
    inner = _without_rim(seen)
    is_behind = _large_regions(inner & (difference_px < -off_px))
    if coarse_px is not None:
        silent = seen & ~is_measured
        rough_px = np.where(silent, coarse_px - expected_px, np.nan)
        off_px = np.maximum(np.float32(_OFF_COARSE_PX), _OFF_MM * px_per_mm)
        is_hidden |= _large_regions(rough_px > off_px)
        is_behind |= _large_regions(inner & (rough_px < -off_px))
    agrees = np.abs(difference_px) < _FIT_SIGMAS * sigma_px
    is_open = is_measured & ~is_hidden
    n_agreeing, n_open = int(agrees.sum()), int(is_open.sum())
    return Agreement(
        n_visible,
        n_agreeing / n_visible,
        float(is_hidden.sum()) / n_visible,
        float(is_behind.sum()) / n_visible,
        n_agreeing / n_open if n_open else 0.0,
        _spread_ratio(difference_px[is_open], sigma_px[is_open]),
    )


def _spread_ratio(difference_px: NDArray[np.floating], sigma_px: NDArray[np.floating]) -> float:
    if len(difference_px) == 0:
        return 0.0
    deviation = np.abs(difference_px - np.median(difference_px))
    return float(_MAD_TO_SIGMA * np.median(deviation / sigma_px))


def _large_regions(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    return large_regions(mask, _LEAST_REGION_PX2)


def _without_rim(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    import cv2

    size = 2 * _RIM_PX + 1
    inner = cv2.erode(mask.astype(np.uint8), np.ones((size, size), np.uint8), borderValue=0)
    return np.asarray(inner > 0)
