"""How a pose's model and the measured surface agree, pixel by pixel.

A right pose has the measured surface on the model, or something nearer in front of it: a hand, an
instrument, tissue. Nothing that is opaque can be seen behind it. Where the scene is seen through
the model, the pose is wrong, however well the rest fits.
"""

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.masks import mark_large
from navapp.geometry.rectification import RectifiedGeometry
from navapp.geometry.transform import RigidTransform
from navapp.geometry.zbuffer import RenderedView, render_rectified
from navapp.registration.model import RegistrationModel
from navapp.registration.verdict import NO_AGREEMENT, Agreement
from navapp.tracking.agreement_kernels import (
    COARSELY_FURTHER,
    COARSELY_NEARER,
    FURTHER,
    NEARER,
    Comparison,
    classify_pixels,
    gather_open,
)
from navapp.values import DisparityMap, Origin

# Nearer or further than the model by at least this, and by so many sigma, is not the model.
_OFF_MM, _OFF_SIGMAS = 2.0, 4.0
_OFF_COARSE_PX = 1.5
_LEAST_REGION_PX2 = 25
# Matching blurs depth over the model's rim, and what lies beside the bone is further away.
_RIM_PX = 4
_FIT_SIGMAS = 3.0
_MAD_TO_SIGMA = 1.4826
# Errors of neighbours go together: the spread is as well known from every second pixel each way.
_SPREAD_STRIDE_PX = 2


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
        coarse_px: (h, w) coarse disparity of whatever is there, where `measured` is silent.
    """
    classes = np.empty(view.face_index.shape, dtype=np.uint8)
    deviation, sigma = (np.empty(classes.shape, dtype=np.float32) for _ in range(2))
    limits = Comparison(
        geometry.focal_px * geometry.baseline_mm, _OFF_MM, _OFF_SIGMAS, _OFF_COARSE_PX, _FIT_SIGMAS
    )
    if coarse_px is None:
        coarse_px = np.full(classes.shape, np.nan, dtype=np.float32)
    n_visible, n_agreeing = classify_pixels(
        view.depth_mm, view.face_index, model.drawn_face_sigma_mm, measured.disparity_px,
        measured.sigma_px, measured.origin == Origin.MATCHED, coarse_px, limits, classes,
        deviation, sigma,
    )  # fmt: skip
    if n_visible == 0:
        return NO_AGREEMENT
    is_hidden, is_behind = (np.zeros(classes.shape, dtype=np.bool_) for _ in range(2))
    mark_large(classes, (NEARER, COARSELY_NEARER), _LEAST_REGION_PX2, is_hidden)
    inner = _without_rim(classes, view.mask)
    mark_large(inner, (FURTHER, COARSELY_FURTHER), _LEAST_REGION_PX2, is_behind)
    room = classes[::_SPREAD_STRIDE_PX, ::_SPREAD_STRIDE_PX].size
    deviations, sigmas = (np.empty(room, dtype=np.float32) for _ in range(2))
    n_open, n = gather_open(
        classes, is_hidden, deviation, sigma, _SPREAD_STRIDE_PX, deviations, sigmas
    )
    return Agreement(
        n_visible,
        n_agreeing / n_visible,
        float(np.count_nonzero(is_hidden)) / n_visible,
        float(np.count_nonzero(is_behind)) / n_visible,
        n_agreeing / n_open if n_open else 0.0,
        _spread_ratio(deviations[:n], sigmas[:n]),
    )


def compare_at(
    pose: RigidTransform,
    model: RegistrationModel,
    measured: DisparityMap,
    geometry: RectifiedGeometry,
    coarse_px: NDArray[np.float32] | None = None,
) -> Agreement:
    """As `compare`, of the model rendered at a pose (rectified left camera from bone)."""
    view = render_rectified(
        model.drawn_mesh, pose, geometry, measured.box, is_closed=model.is_closed
    )
    return compare(view, model, measured, geometry, coarse_px)


def _spread_ratio(deviations_px: NDArray[np.float32], sigmas_px: NDArray[np.float32]) -> float:
    if len(deviations_px) == 0:
        return 0.0
    from_middle = np.abs(deviations_px - np.median(deviations_px))
    return float(_MAD_TO_SIGMA * np.median(from_middle / sigmas_px))


def _without_rim(classes: NDArray[np.uint8], mask: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """(h, w) classes, 0 beside a mask and on its rim."""
    import cv2

    size = 2 * _RIM_PX + 1
    inner = cv2.erode(mask.astype(np.uint8), np.ones((size, size), np.uint8), borderValue=0)
    return np.asarray(cv2.copyTo(classes, inner), dtype=np.uint8)
