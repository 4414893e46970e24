"""A smooth robust surface through samples of a disparity map.

It bridges holes, bumps and outliers and gives the next matching a slanted support. It is never a
measurement: what it says of a pixel comes from the pixels around.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.bands import in_row_bands
from navapp.geometry.lane_kernels import FLOAT_LANES, lanes_for
from navapp.stereo.subpixel.regional_kernels import Rules, Samples, Window, fit_rows
from navapp.stereo.subpixel.regional_picture_kernels import picture_rows

_TAPER = 1.5
# For each known sample: on 1, u, v, u^2, uv, v^2. A polynomial that hangs on few samples may
# neither tilt nor bend much.
_RIDGE = np.array([1e-6, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3], dtype=np.float32)
# Each way; a start needs no more.
_N_START = 7


@dataclass(frozen=True, slots=True)
class RegionalSettings:
    """How the surface is fitted."""

    radius_px: int = 12  # of the square window of a node
    node_px: int = 8  # distance of the nodes, at most the radius
    thin: int = 2  # every thin-th pixel each way is a sample; divides `node_px`
    # residual that counts a quarter; one for each iteration.
    scales_px: tuple[float, ...] = (3.0, 1.5, 0.7, 0.35)
    min_samples: int = 20  # a node with fewer known samples in its window has no polynomial

    def __post_init__(self) -> None:
        if not 1 <= self.thin <= self.node_px <= self.radius_px or self.node_px % self.thin:
            raise ValueError(
                "regional needs thin <= node_px <= radius_px, and thin divides node_px"
            )
        if not self.scales_px or min(self.scales_px) <= 0.0 or self.min_samples < 1:
            raise ValueError("regional needs scales above 0, at least one, and min_samples above 0")


def regional_support(
    samples_px: NDArray[np.float32],
    weights: NDArray[np.float32],
    shape: tuple[int, int],
    settings: RegionalSettings,
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
        (h, w) float32 px; NaN where no node around has a polynomial.

    Raises:
        ValueError: sizes that do not fit together.

    Source: Cleveland 1979, robust locally weighted regression, with w = 1 / (1 + r^2)^2, each
    polynomial's residuals being its own. It begins at a median and the scale falls, so near a step
    it takes the side that most samples are on.
    """
    expected = tuple(-(-size // settings.thin) for size in shape)
    if samples_px.shape != expected or weights.shape != expected:
        raise ValueError("samples and weights need the size of the map, thinned")
    side = settings.node_px
    n_rows, n_columns = ((size - 1) // side + 2 for size in shape)
    nodes = np.empty((n_rows, 7, lanes_for(n_columns, FLOAT_LANES)), dtype=np.float32)
    samples = _samples(samples_px, weights, nodes.shape, settings)
    window, scales = _window(samples, settings), np.array(settings.scales_px, dtype=np.float32)
    rules = Rules(scales, _RIDGE, np.float32(settings.min_samples))
    in_row_bands(n_rows, lambda rows: fit_rows(samples, window, rules, *rows, nodes), every=1)
    picture = np.empty(shape, dtype=np.float32)
    unit = np.float32(side / settings.radius_px)
    in_row_bands(shape[0], lambda rows: picture_rows(nodes, side, unit, *rows, picture))
    return picture


def _samples(
    samples_px: NDArray[np.float32],
    weights: NDArray[np.float32],
    nodes: tuple[int, ...],
    settings: RegionalSettings,
) -> Samples:
    """The samples in planes for nodes (rows, 7, columns)."""
    spacing, reach = settings.node_px // settings.thin, settings.radius_px // settings.thin
    margin = -(-reach // spacing)
    stride = nodes[2] + 2 * margin
    planes = np.zeros(
        (2, spacing * (nodes[0] - 1) + 2 * reach + 1, spacing, stride), dtype=np.float32
    )
    is_known = (weights > 0.0) & np.isfinite(samples_px)
    for plane, given in zip(planes, (samples_px, weights), strict=True):
        kept = np.where(is_known, given, np.float32(0.0))
        for phase in range(spacing):
            part = kept[:, phase::spacing]
            plane[reach : reach + len(part), phase, margin : margin + part.shape[1]] = part
    values, known = planes.reshape(2, -1)
    return Samples(values, known, spacing * stride, stride, spacing, reach, margin)


def _window(samples: Samples, settings: RegionalSettings) -> Window:
    steps = np.arange(-samples.reach, samples.reach + 1)
    u = (steps * settings.thin / settings.radius_px).astype(np.float32)
    across = steps % samples.spacing * samples.stride + steps // samples.spacing + samples.margin
    taps = np.unique(np.round(np.linspace(0, 2 * samples.reach, _N_START)).astype(int))
    start = (taps[:, None] * samples.width + across[taps]).ravel()
    return Window(across, u, np.exp(-np.float32(_TAPER) * u * u), start)
