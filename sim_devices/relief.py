"""Relief of bone surfaces: seeded roughness and osteophytes, as heights in mm over points."""

from dataclasses import dataclass

import numpy as np

from navapp.geometry.transform import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Waves:
    """Smooth seeded relief: a sum of plane waves in random directions."""

    wave_vectors: FloatArray  # (W, 3) rad per mm
    phases_rad: FloatArray  # (W,)
    amplitudes_mm: FloatArray  # (W,)

    def __call__(self, points: FloatArray) -> FloatArray:
        """Heights in mm, (N,) at points (N, 3)."""
        # Single precision: several times faster, and an error of nanometres.
        phases = points.astype(np.float32) @ self.wave_vectors.T.astype(np.float32)
        phases += self.phases_rad.astype(np.float32)
        np.cos(phases, out=phases)
        value: FloatArray = (phases @ self.amplitudes_mm.astype(np.float32)).astype(np.float64)
        return value


def make_waves(
    rng: np.random.Generator, rms_mm: float, wavelengths_mm: tuple[float, float], count: int = 32
) -> Waves:
    """Waves with log-uniform wavelengths and an RMS value; equally steep."""
    low, high = np.log(wavelengths_mm)
    wavelength = np.exp(rng.uniform(low, high, count))
    direction = rng.standard_normal((count, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    amplitude = wavelength * rms_mm * np.sqrt(2.0 / np.sum(wavelength**2))
    return Waves(
        direction * (2.0 * np.pi / wavelength)[:, None],
        rng.uniform(0.0, 2.0 * np.pi, count),
        amplitude,
    )


@dataclass(frozen=True, slots=True, eq=False)
class Bumps:
    """Relief of round bumps, such as osteophytes."""

    centres_mm: FloatArray  # (M, 3)
    widths_mm: FloatArray  # (M,) standard deviations
    heights_mm: FloatArray  # (M,)

    def __call__(self, points: FloatArray) -> FloatArray:
        """Heights in mm, (N,) at points (N, 3)."""
        # Single precision about the bumps' middle: fast, and exact enough where they are high.
        middle = self.centres_mm.mean(axis=0)
        near, centres = (points - middle).astype(np.float32), self.centres_mm - middle
        exponent = near @ (2.0 * centres.T).astype(np.float32)
        exponent -= np.einsum("ij,ij->i", near, near)[:, None]
        exponent -= np.einsum("ij,ij->i", centres, centres).astype(np.float32)
        exponent *= (0.5 / self.widths_mm**2).astype(np.float32)
        np.exp(np.minimum(exponent, np.float32(0.0), out=exponent), out=exponent)
        value: FloatArray = (exponent @ self.heights_mm.astype(np.float32)).astype(np.float64)
        return value
