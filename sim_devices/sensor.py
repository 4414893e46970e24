"""An image sensor: from radiance to grey values."""

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from drivers.frames import Image
from sim_devices.sensor_kernels import expose_rows

Eye = Literal["left", "right"]
# First row, and the first one after the last.
Rows = tuple[int, int]

_TABLE_SIZE = 4096
_NOISE_SIZE = 1 << 19


@dataclass(frozen=True, slots=True)
class SensorModel:
    """What turns light into a picture, the same for both eyes except for the gain.

    The noise is shot noise (variance = signal, in electrons) and read noise, both Gaussian. It is
    read from one tile of random numbers, every row from its own place, which depends on the seed,
    the frame and the eye alone: the same frame always gets the same noise.

    Raises:
        ValueError: a value that no sensor has.
    """

    full_well_e: float = 20000.0  # electrons of a saturated pixel
    read_noise_e: float = 7.0  # standard deviation of the read-out, electrons
    psf_sigma_px: float = 0.5  # blur of the lens
    exposure: float = 1.0  # relative to the nominal one
    # gain_left, gain_right: amplification after the noise; two cameras are never quite equal.
    gain_left: float = 1.0
    gain_right: float = 1.04
    seed: int = 0  # of the noise
    is_grey: bool = False  # one channel instead of three

    def __post_init__(self) -> None:
        positive = (self.full_well_e, self.exposure, self.gain_left, self.gain_right)
        if not all(0.0 < value < np.inf for value in positive):
            raise ValueError("full well, exposure and gains of a sensor must be positive")
        if not (self.read_noise_e >= 0.0 and self.psf_sigma_px >= 0.0 and self.seed >= 0):
            raise ValueError("read noise, blur and seed of a sensor cannot be negative")

    def with_exposure(self, exposure_factor: float, gain_db: float) -> "SensorModel":
        """The same sensor exposed longer or shorter, its amplifiers turned up."""
        gain = 10.0 ** (gain_db / 20.0)
        return replace(
            self,
            exposure=self.exposure * exposure_factor,
            gain_left=self.gain_left * gain,
            gain_right=self.gain_right * gain,
        )

    def picture(self, radiance: NDArray[np.float32], eye: Eye, sequence: int) -> Image:
        """The picture that one eye takes.

        Args:
            radiance: (H, W, 3) float32 BGR, linear, 1.0 = full well at nominal exposure.
            eye: its gain and its noise.
            sequence: number of the frame; another number, other noise.

        Returns:
            uint8, (H, W, 3) BGR, or (H, W) of a grey sensor.
        """
        import cv2

        light = np.ascontiguousarray(radiance, dtype=np.float32)
        if self.is_grey:
            light = np.asarray(cv2.cvtColor(light, cv2.COLOR_BGR2GRAY), dtype=np.float32)
        if self.psf_sigma_px > 0.0:
            blurred = cv2.GaussianBlur(light, (0, 0), self.psf_sigma_px)
            light = np.asarray(blurred, dtype=np.float32)
        rows = light.reshape(light.shape[0], -1)
        picture = np.empty(rows.shape, np.uint8)
        noise = _noise(self.seed, max(_NOISE_SIZE, 2 * rows.shape[1]))
        generator = np.random.default_rng((self.seed, sequence, int(eye == "right")))
        row_starts = generator.integers(0, noise.size - rows.shape[1], rows.shape[0])
        expose_rows(
            rows,
            noise,
            row_starts,
            self.kernel_parameters(),
            make_tone_table(self.gain_left if eye == "left" else self.gain_right),
            np.empty(rows.shape[1], np.int32),
            picture,
        )
        return picture.reshape(light.shape)

    def kernel_parameters(self) -> NDArray[np.float32]:
        """(4,) what `expose_rows` wants."""
        steps_per_e = (_TABLE_SIZE - 1) / self.full_well_e
        values = (self.full_well_e, self.read_noise_e**2, self.exposure, steps_per_e)
        return np.array(values, np.float32)


@lru_cache(maxsize=16)
def make_tone_table(gain: float) -> NDArray[np.uint8]:
    """(4096,) grey value of a signal between nothing and full well, after amplification."""
    signal = np.minimum(gain * np.linspace(0.0, 1.0, _TABLE_SIZE), 1.0)
    table = np.rint(255.0 * compute_tone_curve(signal)).astype(np.uint8)
    table.setflags(write=False)
    return table


def compute_tone_curve(signal: NDArray[np.float64]) -> NDArray[np.float64]:
    """Transfer curve of video cameras over 0..1 (Recommendation ITU-R BT.709, item 1.2)."""
    bright = 1.099 * np.power(np.maximum(signal, 0.018), 0.45) - 0.099
    return np.asarray(np.where(signal < 0.018, 4.5 * signal, bright), dtype=np.float64)


@lru_cache(maxsize=4)
def _noise(seed: int, size: int) -> NDArray[np.float32]:
    """(size,) numbers with mean 0 and variance 1 exactly."""
    values = np.random.default_rng(seed).standard_normal(size)
    values = (values - values.mean()) / values.std()
    noise = np.asarray(values, dtype=np.float32)
    noise.setflags(write=False)
    return noise
