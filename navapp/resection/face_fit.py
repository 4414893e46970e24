"""A plane through measured disparities: what a sawn face is, to the eyes of a stereo camera.

In a rectified pair a plane is an affine function of the pixel: with N . X = r for its points X,
d = f B / z = (B / r) (N_x (u - c_x) + N_y (v - c_y) + f N_z).
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.rectification import RectifiedGeometry
from navapp.geometry.transform import FloatArray
from navapp.stereo import MODEL_REFINEMENT

# All chosen. Widths of the kernel, px, from far to near, and the least one in sigmas.
_WIDTHS_PX = (0.6, 0.6, 0.4, 0.25, 0.2)
_MOST_STEPS, _REST_PX = 30, 1e-3
# Most of a nearly parallel plane lies within so much of another.
_WINDOW_PX = 0.6
_LEAST_WIDTH_SIGMAS = 1.6
# Errors of two pixels go together as far as their matching windows overlap: nearly as a Gaussian of
# this width. A face must hold so many that do not.
_TOGETHER_PX = (2 * MODEL_REFINEMENT.radius_px + 1) / 6**0.5
_LEAST_APART = 6.0
# Residuals that show less noise than this are not believed.
_LEAST_NOISE_PX = 0.02
_MOST_CONDITION = 1e12
# What all disparities of a face may have in common.
_COMMON_PX = 0.02


@dataclass(frozen=True, slots=True, eq=False)
class DisparityPlane:
    """d = `coefficients` . (u - c_x, v - c_y, 1), of a rectified pair."""

    coefficients: FloatArray  # (3,) px per px, px per px, px
    covariance: FloatArray  # (3, 3) of the coefficients, `_COMMON_PX` included
    is_on: NDArray[np.bool_]  # (N,) measured pixels that lie on it
    width_px: float  # what lies nearer than this is on it

    def with_error(self, coefficients: FloatArray) -> "DisparityPlane":
        """The same plane, one more deviation of which are these coefficients (3,)."""
        return replace(self, covariance=self.covariance + np.outer(coefficients, coefficients))

    def in_camera(self, geometry: RectifiedGeometry) -> tuple[FloatArray, float]:
        """Unit normal N (3,) towards the camera, and N . X in mm of its points X."""
        return plane_in_camera(self.coefficients, geometry)


def plane_in_camera(
    coefficients: FloatArray, geometry: RectifiedGeometry
) -> tuple[FloatArray, float]:
    """Unit normal N (3,) towards the rectified left camera, and N . X in mm (below 0)."""
    a, b, c = coefficients
    scaled = np.array([a, b, c / geometry.focal_px]) / geometry.baseline_mm
    length = float(np.linalg.norm(scaled))
    normal: FloatArray = -scaled / length
    return normal, -1.0 / length


def disparity_coefficients(
    normal: FloatArray, distance_mm: float, geometry: RectifiedGeometry
) -> FloatArray:
    """(3,) of the plane N . X = distance in the rectified left camera."""
    n_x, n_y, n_z = normal
    per_mm = geometry.baseline_mm / distance_mm
    return per_mm * np.array([n_x, n_y, geometry.focal_px * n_z])


def fit_disparity_plane(
    places: FloatArray,
    disparity_px: FloatArray,
    sigma_px: FloatArray,
    start: FloatArray,
    reach_px: float,
) -> DisparityPlane | None:
    """The plane that most of the measured pixels share.

    Weighted least squares under a kernel that narrows (Welsch's, the correntropy of the paper's
    equation 7), so that a hand, tissue and blood do not count. The covariance is that of an error
    as large as the residuals, which neighbouring pixels share.

    Args:
        places: (N, 3) of (u - c_x, v - c_y, 1), pixels of the rectified left picture.
        disparity_px: (N,) measured.
        sigma_px: (N,) its standard deviation.
        start: (3,) coefficients of a plane that is nearly parallel to the one looked for,
        reach_px: and no further from it.

    Returns:
        None when too little of the plane is there to tell how well it is known.
    """
    weight = np.zeros(len(places))
    coefficients = np.array(start, dtype=np.float64)
    coefficients[2] += _find_densest(disparity_px - places @ coefficients, reach_px)
    least_px = _LEAST_WIDTH_SIGMAS * sigma_px
    for width_px in _WIDTHS_PX:
        for _ in range(_MOST_STEPS):
            residual = disparity_px - places @ coefficients
            kernel_px = np.maximum(width_px, least_px)
            weight = np.exp(-0.5 * (residual / kernel_px) ** 2) / sigma_px**2
            normal_matrix = (places * weight[:, None]).T @ places
            if not np.linalg.cond(normal_matrix) < _MOST_CONDITION:
                return None
            step = np.linalg.solve(normal_matrix, (places * weight[:, None]).T @ residual)
            coefficients = coefficients + step
            if np.abs(places @ step).max() < _REST_PX:
                break
    residual = disparity_px - places @ coefficients
    width_px = 2.0 * max(_WIDTHS_PX[-1], float(np.median(least_px)))
    is_on = np.abs(residual) < width_px
    kernel_px = np.maximum(_WIDTHS_PX[-1], least_px)
    # How fast the pull of a residual grows: less than its weight says, near the kernel's edge.
    growth = weight * (1.0 - (residual / kernel_px) ** 2)
    covariance = find_covariance(places[is_on], weight[is_on], growth[is_on], residual[is_on])
    return None if covariance is None else DisparityPlane(coefficients, covariance, is_on, width_px)


def _find_densest(residual: FloatArray, reach_px: float) -> float:
    """The middle of the window that holds most of the residuals within reach; 0 without any."""
    near = np.sort(residual[np.abs(residual) <= reach_px + 0.5 * _WINDOW_PX])
    if len(near) == 0:
        return 0.0
    ends = np.searchsorted(near, near + _WINDOW_PX, side="right")
    first = int((ends - np.arange(len(near))).argmax())
    middle = float(np.median(near[first : ends[first]]))
    return min(max(middle, -reach_px), reach_px)


def find_covariance(
    places: FloatArray, weight: FloatArray, growth: FloatArray, residual: FloatArray
) -> FloatArray | None:
    """(3, 3) of the coefficients of a fit; None from too few pixels with independent errors.

    That of an M-estimator under correlated errors: H^-1 X' W K W X H^-1 with H = X' G X, where the
    errors' correlation K is Gaussian in distance.

    Args:
        places: (N, 3) of pixels, whole px apart.
        weight: (N,) of their residuals in the fit, W.
        growth: (N,) by how much a residual's pull grows with it, G.
        residual: (N,) px.
    """
    import cv2

    if len(places) < len(places.T):
        return None
    first = places[:, :2].min(axis=0)
    columns, rows = np.rint(places[:, :2] - first).astype(np.intp).T
    # Room around the pixels: at its border the filter mirrors what is there.
    margin = int(4.0 * _TOGETHER_PX) + 1
    shape = int(rows.max()) + 2 * margin + 1, int(columns.max()) + 2 * margin + 1
    pulls = np.zeros((*shape, 4))
    pulls[rows + margin, columns + margin, :3] = places * weight[:, None]
    pulls[rows + margin, columns + margin, 3] = weight
    spread = 2.0 * np.pi * _TOGETHER_PX**2 * cv2.GaussianBlur(pulls, (0, 0), _TOGETHER_PX)
    shared = np.einsum("ijk,ijl->kl", pulls, spread)
    n_apart = float(weight.sum()) ** 2 / float(shared[3, 3])
    stiffness = (places * growth[:, None]).T @ places
    if n_apart < _LEAST_APART or not np.linalg.eigvalsh(stiffness)[0] > 0.0:
        return None
    noise_px2 = float(weight**2 @ residual**2) / float(weight @ weight)
    noise_px2 = max(noise_px2, _LEAST_NOISE_PX**2) * n_apart / (n_apart - 3.0)
    inverse = np.linalg.inv(stiffness)
    covariance = noise_px2 * inverse @ shared[:3, :3] @ inverse
    covariance[2, 2] += _COMMON_PX**2
    return np.asarray(covariance)
