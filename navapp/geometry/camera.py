"""A calibrated camera: pinhole with OpenCV's polynomial distortion."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from navapp.geometry.transform import FloatArray, read_only


@dataclass(frozen=True, slots=True, eq=False)
class Camera:
    """Intrinsics of one camera, OpenCV axes (x right, y down, z forward).

    Pixel (0, 0) is the centre of the top-left pixel.

    Raises:
        ValueError: a shape or a value that no camera has.
    """

    matrix: FloatArray  # (3, 3) K, px, without skew
    # (n,) OpenCV coefficients k1 k2 p1 p2 [k3 [k4 k5 k6 [s1..s4 [tx ty]]]]; n may be 0, 4, 5, 8, 12
    # or 14, the tilt (tx, ty) only 0.
    distortion: FloatArray
    # width, height: of the picture, px.
    width: int
    height: int

    def __post_init__(self) -> None:
        matrix = read_only(self.matrix)
        distortion = read_only(np.asarray(self.distortion, dtype=np.float64).reshape(-1))
        if matrix.shape != (3, 3) or not np.isfinite(matrix).all():
            raise ValueError("a camera matrix is a finite 3x3 matrix")
        if matrix[0, 0] <= 0.0 or matrix[1, 1] <= 0.0:
            raise ValueError("focal lengths must be positive")
        if np.abs(matrix[[1, 2, 2, 2], [0, 0, 1, 2]] - (0.0, 0.0, 0.0, 1.0)).max() > 1e-9:
            raise ValueError("a camera matrix has the rows fx 0 cx, 0 fy cy and 0 0 1")
        # OpenCV's rectification would silently ignore it.
        if abs(matrix[0, 1]) > 1e-9:
            raise ValueError("a camera matrix with skew is not supported")
        if distortion.size not in (0, 4, 5, 8, 12, 14) or not np.isfinite(distortion).all():
            raise ValueError("distortion needs 0, 4, 5, 8, 12 or 14 finite coefficients")
        if distortion[12:].any():
            raise ValueError("a tilted sensor (tx, ty) is not supported")
        if self.width <= 0 or self.height <= 0:
            raise ValueError("width and height must be positive")
        object.__setattr__(self, "matrix", matrix)
        object.__setattr__(self, "distortion", distortion)

    @property
    def focal_px(self) -> float:
        """Mean focal length in px."""
        return float(0.5 * (self.matrix[0, 0] + self.matrix[1, 1]))

    @property
    def is_distorted(self) -> bool:
        """Whether straight lines bend."""
        return bool(np.any(self.distortion != 0.0))

    def project(self, points_mm: ArrayLike) -> FloatArray:
        """(N, 2) px of points (N, 3) mm in this camera's frame.

        NaN at or behind the camera, and where its lens shows nothing.
        """
        # What is compiled is not loaded by those who only read rigs.
        from navapp.geometry.lens_kernels import project_through_lens

        points = np.ascontiguousarray(points_mm, dtype=np.float64).reshape(-1, 3)
        pixels = np.empty((len(points), 2))
        k = np.zeros(14)
        k[: self.distortion.size] = self.distortion
        project_through_lens(points, self.matrix, k, pixels)
        return pixels

    def rays(self, pixels: ArrayLike) -> FloatArray:
        """(N, 3) directions with z = 1 through pixels (N, 2), distortion removed."""
        import cv2

        points = np.array(pixels, dtype=np.float64).reshape(-1, 1, 2)
        if len(points) == 0:
            return np.empty((0, 3))
        criteria = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 50, 1e-12)
        flat = cv2.undistortPoints(
            points, np.array(self.matrix), np.array(self.distortion), criteria=criteria
        )
        flat = flat.reshape(-1, 2)
        return np.column_stack([flat, np.ones(len(flat))])

    def scale(self, factor: float) -> "Camera":
        """The same camera with its picture resized: u' = s (u + 0.5) - 0.5."""
        matrix = np.array(self.matrix)
        matrix[:2, 2] += 0.5
        matrix[:2] *= factor
        matrix[:2, 2] -= 0.5
        return Camera(
            matrix,
            self.distortion,
            max(1, round(self.width * factor)),
            max(1, round(self.height * factor)),
        )


def distort(x: FloatArray, y: FloatArray, distortion: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Distorted normalised coordinates of undistorted ones (OpenCV's model up to thin prism).

    NaN at and beyond the pole of a rational lens: it shows nothing there.
    """
    k = np.zeros(14)
    k[: distortion.size] = distortion
    r2 = x * x + y * y
    below = 1.0 + r2 * (k[5] + r2 * (k[6] + r2 * k[7]))
    radial = (1.0 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]))) / np.where(below > 0.0, below, np.nan)
    xy2 = 2.0 * x * y
    x_distorted = x * radial + k[2] * xy2 + k[3] * (r2 + 2.0 * x * x) + k[8] * r2 + k[9] * r2 * r2
    y_distorted = y * radial + k[2] * (r2 + 2.0 * y * y) + k[3] * xy2 + k[10] * r2 + k[11] * r2 * r2
    return x_distorted, y_distorted
