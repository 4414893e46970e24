"""How a pose's model and the measured surface agree, pixel by pixel.

A right pose has the measured surface on the model, or something nearer in front of it: a hand, an
instrument, tissue. Bone is opaque: where something further is seen, the pose is wrong.
"""

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.masks import mark_large, shrink, where
from navapp.geometry.rectification import RectifiedGeometry
from navapp.geometry.zbuffer import RenderedView
from navapp.registration.model import RegistrationModel
from navapp.registration.verdict import Agreement
from navapp.tracking.agreement_kernels import (
    COARSELY_FURTHER,
    COARSELY_NEARER,
    FURTHER,
    NEARER,
    classify_pixels,
)
from navapp.values import DisparityMap

# All chosen. Smaller regions of nearer or further pixels do not count.
_LEAST_REGION_PX2 = 25
# Matching blurs depth over the model's rim, and what lies beside the bone is further away.
_RIM_PX = 4
# Windows of eleven pixels share their errors: every fourth row and column tells the spread as well.
_SPREAD_STRIDE_PX = 4
# So much of the model may show reflected lamps; as much as may be seen through at a right pose
# (`verdict.RULES`). Without a limit, a bone that was cut unknown to the plan would fit where
# highlights cover its face.
_MOST_REFLECTED = 0.05
# Of a normal distribution: its standard deviation over its median absolute deviation.
_MAD_TO_SIGMA = 1.4826


def compare(
    view: RenderedView,
    model: RegistrationModel,
    measured: DisparityMap,
    geometry: RectifiedGeometry,
    coarse_px: NDArray[np.float32] | None = None,
    is_near_clipped: NDArray[np.bool_] | None = None,
) -> Agreement:
    """Compare a rendered model with what was measured in the same box.

    Args:
        view: of the model at the pose.
        model: for the standard deviation of its surface.
        measured: disparity over the view's box; only matched pixels count.
        geometry: of the rectified pair.
        coarse_px: (h, w) coarse disparity of whatever is there, where `measured` is silent.
        is_near_clipped: (h, w) as of `find_near_clipped`: there the coarse map may show a lamp's
            image behind the surface. That much of the model, `_MOST_REFLECTED` at most, does not
            count as seen through.
    """
    shape, is_matched = view.face_index.shape, measured.is_matched
    if coarse_px is None:
        coarse_px = np.full(shape, np.nan, dtype=np.float32)
    classes, deviation, sigma, n_visible, n_agreeing = classify_pixels(
        view.depth_mm, view.face_index, model.rendered_face_sigma_mm, measured.disparity_px,
        measured.sigma_px, is_matched, coarse_px, geometry.focal_px * geometry.baseline_mm,
    )  # fmt: skip
    if n_visible == 0:
        return Agreement(0, 0.0, 0.0, 0.0, 0.0, 0.0)
    is_hidden, is_behind = np.zeros(shape, dtype=np.bool_), np.zeros(shape, dtype=np.bool_)
    n_hidden = mark_large(classes, (NEARER, COARSELY_NEARER), _LEAST_REGION_PX2, is_hidden)
    mask = view.mask
    inner = where(shrink(mask, _RIM_PX), classes, 0)
    n_behind = mark_large(inner, (FURTHER, COARSELY_FURTHER), _LEAST_REGION_PX2, is_behind)
    if is_near_clipped is not None and n_behind > 0:
        is_coarse = is_behind & (inner == COARSELY_FURTHER)
        n_reflected = int(np.count_nonzero(is_coarse & is_near_clipped))
        n_behind -= min(n_reflected, int(_MOST_REFLECTED * n_visible))
    is_open = is_matched & mask & ~is_hidden
    n_open = int(np.count_nonzero(is_open))
    stride = _SPREAD_STRIDE_PX
    stride = stride if is_open[::stride, ::stride].any() else 1
    sparse = np.s_[::stride, ::stride]
    is_asked = is_open[sparse]
    return Agreement(
        n_visible,
        n_agreeing / n_visible,
        n_hidden / n_visible,
        n_behind / n_visible,
        n_agreeing / n_open if n_open else 0.0,
        _spread_ratio(deviation[sparse][is_asked], sigma[sparse][is_asked]),
    )


def _spread_ratio(deviation_px: NDArray[np.float32], sigma_px: NDArray[np.float32]) -> float:
    if len(deviation_px) == 0:
        return 0.0
    from_middle = np.abs(deviation_px - np.median(deviation_px))
    return float(_MAD_TO_SIGMA * np.median(from_middle / sigma_px))
