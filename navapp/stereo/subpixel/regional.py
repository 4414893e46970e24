"""A smooth robust surface through samples of a disparity map.

It bridges holes, bumps and outliers and gives the next matching a slanted support. It is never a
measurement: what it says of a pixel comes from the pixels around.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.bands import in_row_bands
from navapp.stereo.subpixel.regional_kernels import N_TERMS, Rules, blend_rows, fit_rows

_TAPER = 1.5
# For each known sample: on 1, u, v, u^2, uv, v^2. A quadratic that hangs on few samples may
# neither tilt nor bend much.
_RIDGE = np.array([1e-6, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3], dtype=np.float32)


@dataclass(frozen=True, slots=True)
class RegionalSettings:
    """How the surface is fitted."""

    radius_px: int = 12  # of the square window of a node
    node_px: int = 8  # distance of the nodes, at most the radius
    thin: int = 2  # every thin-th pixel each way is a sample; divides `node_px`
    # residual that counts a quarter; one for each iteration.
    scales_px: tuple[float, ...] = (3.0, 1.5, 0.7, 0.35)
    min_samples: int = 20  # a node with fewer known samples in its window has no quadratic

    def __post_init__(self) -> None:
        if not 1 <= self.thin <= self.node_px <= self.radius_px or self.node_px % self.thin:
            raise ValueError(
                "regional needs thin <= node_px <= radius_px, and thin divides node_px"
            )
        if not self.scales_px or min(self.scales_px) <= 0.0 or self.min_samples < 1:
            raise ValueError("regional needs scales above 0, at least one, and min_samples above 0")

    @property
    def rules(self) -> Rules:
        """What the compiled fit reads."""
        reach = self.radius_px // self.thin
        offsets = np.arange(-reach, reach + 1) * (self.thin / self.radius_px)
        return Rules(
            node_step=self.node_px // self.thin,
            reach=reach,
            offsets=offsets.astype(np.float32),
            taper=np.exp(-_TAPER * offsets**2).astype(np.float32),
            ridge=_RIDGE,
            scales_px=np.array(self.scales_px, dtype=np.float32),
            min_samples=self.min_samples,
        )


def regional_support(
    samples_px: NDArray[np.float32],
    weights: NDArray[np.float32],
    shape: tuple[int, int],
    settings: RegionalSettings | None = None,
) -> NDArray[np.float32]:
    """Robust locally weighted quadratics around the nodes of a grid, blended into one surface.

    Args:
        samples_px: (ceil(h / thin), ceil(w / thin)) float32 disparity px, NaN where unknown; sample
            (j, i) lies at the pixel (thin * j, thin * i).
        weights: float32 of the same size, 0 for a sample that does not count, about 1 for one that
            does.
        shape: (h, w) of the surface.
        settings: of the fit.

    Returns:
        (h, w) float32 px; NaN where no node around has a quadratic.

    Raises:
        ValueError: sizes that do not fit together.

    Source: Cleveland 1979, robust locally weighted regression, with w = 1 / (1 + r^2)^2, each
    quadratic's residuals being its own. It begins at a median and the scale falls, so near a step
    it takes the side that most samples are on.
    """
    settings = settings or RegionalSettings()
    expected = tuple(-(-size // settings.thin) for size in shape)
    if samples_px.shape != expected or weights.shape != expected:
        raise ValueError("samples and weights need the size of the map, thinned")
    side, rules = settings.node_px, settings.rules
    n_rows, n_columns = ((size - 1) // side + 2 for size in shape)
    nodes = np.empty((n_rows, n_columns, 1 + N_TERMS), dtype=np.float32)
    samples_px = np.ascontiguousarray(samples_px, dtype=np.float32)
    weights = np.where(np.isfinite(samples_px), weights, np.float32(0.0)).astype(np.float32)
    in_row_bands(
        n_rows * side,
        lambda rows: fit_rows(
            samples_px, weights, rules, -(-rows[0] // side), -(-rows[1] // side), nodes
        ),
    )
    surface_px = np.empty(shape, dtype=np.float32)
    radius_px = settings.radius_px
    in_row_bands(shape[0], lambda rows: blend_rows(nodes, side, radius_px, *rows, surface_px))
    return surface_px
