"""Solid noise: a periodic block of procedural texture, looked up at points of a body."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

TILE_SIZE = 128
# One lookup is fine, one coarse; together their octaves span 0.5 to 20 mm.
FINE_VOXEL_MM = 0.3
COARSE_VOXEL_MM = 1.13
# A standard deviation of the noise in steps of the 8-bit tile.
STEPS_PER_SIGMA = 40.0

# Of the amplitude over the frequency: -1.5 gives every octave the same contrast, the second channel
# is smoother and makes patches.
_SLOPES = (-1.5, -2.1)
_SHORTEST_VOXELS = 2.7
_LONGEST_VOXELS = 28.0


@dataclass(frozen=True, slots=True, eq=False)
class NoiseTile:
    """Two independent channels of noise, periodic in all directions."""

    # (n, n, n) uint16: the first channel in the low byte, the second in the high one; mean 128, 40
    # steps per standard deviation.
    values: NDArray[np.uint16]

    @property
    def size(self) -> int:
        """Voxels along an edge."""
        return int(self.values.shape[0])


@lru_cache(maxsize=4)
def make_noise_tile(seed: int, blur_voxels: float = 0.0, size: int = TILE_SIZE) -> NoiseTile:
    """The tile of a seed; `blur_voxels` (Gaussian sigma) is for pictures of few pixels."""
    from scipy import fft

    rng = np.random.default_rng([seed, 128])
    frequency = np.fft.fftfreq(size).astype(np.float32)
    half = np.fft.rfftfreq(size).astype(np.float32)
    squared = (
        frequency[:, None, None] ** 2 + frequency[None, :, None] ** 2 + half[None, None, :] ** 2
    )
    radius = np.sqrt(squared)
    radius[0, 0, 0] = 1.0
    band = (radius > 1.0 / _LONGEST_VOXELS) & (radius < 1.0 / _SHORTEST_VOXELS)
    weight = np.full(half.size, 2.0)
    weight[0] = weight[-1] = 1.0
    blur = np.exp(-2.0 * (np.pi * blur_voxels) ** 2 * squared)
    values = np.zeros((size, size, size), dtype=np.uint16)
    for channel, slope in enumerate(_SLOPES):
        gain = np.where(band, radius**slope, 0.0).astype(np.float32)
        # Parseval: the deviation before the blur, which lowers the contrast as optics do.
        sigma = float(np.sqrt((gain**2 * weight).sum() / size**3))
        gain *= blur * (STEPS_PER_SIGMA / sigma)
        white = rng.standard_normal((size, size, size), dtype=np.float32)
        noise = fft.irfftn(fft.rfftn(white) * gain, s=(size, size, size))
        values |= np.clip(np.rint(noise + 128.0), 0, 255).astype(np.uint16) << (8 * channel)
    values.setflags(write=False)
    return NoiseTile(values)


def make_smooth_noise(
    points: NDArray[np.float64], wavelength_mm: float, seed: int
) -> NDArray[np.float64]:
    """(N,) values of zero mean and about unit deviation at points (N, d) mm: a sum of waves.

    For shapes, not for surfaces: it is smooth everywhere and has no period.
    """
    rng = np.random.default_rng([seed, 77])
    total = np.zeros(len(points))
    waves = 24
    for _ in range(waves):
        direction = rng.standard_normal((1, points.shape[1]))
        direction /= np.linalg.norm(direction)
        length = wavelength_mm * float(rng.uniform(0.6, 1.7))
        phase = float(rng.uniform(0.0, 2.0 * np.pi))
        total = total + np.sin((2.0 * np.pi / length) * (points @ direction[0]) + phase)
    scaled: NDArray[np.float64] = total * np.sqrt(2.0 / waves)
    return scaled
