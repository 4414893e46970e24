"""The noise of a simulated picture, from what is known of the simulated sensor."""

from functools import lru_cache

import numpy as np

from navapp.evaluation.noise_limit.limit import Floats
from navapp.geometry.rectification import Image, Rectifier
from navapp.geometry.transform import FloatArray
from sim_devices.sensor import SensorModel, compute_tone_curve

# Of blue, green and red in the grey picture (Recommendation ITU-R BT.601).
_LUMA = (0.114, 0.587, 0.299)
_ROUNDING = 1.0 / 12.0
# Of a saturated channel: it tells nothing.
_SATURATED = 1e6
_N_SIGNALS = 20_000


def find_variances(
    left: Image, right: Image, rectifier: Rectifier, sensor: SensorModel
) -> tuple[Floats, Floats]:
    """(H, W) of both rectified grey pictures: variance of the noise, grey levels squared.

    Args:
        left: picture of the left camera, as it came.
        right: of the right one.
        rectifier: of their rig.
        sensor: that took both.

    The variance is that of a raw pixel, over the number of raw pixels to a rectified one: what the
    rectification's interpolation smooths, it makes no more certain.
    """
    import cv2

    maps, found = rectifier.maps, []
    for picture, gain, columns, rows in (
        (left, sensor.gain_left, *maps[:2]),
        (right, sensor.gain_right, *maps[2:]),
    ):
        table = tabulate_variance(sensor, gain)
        raw = _variance_of_grey(picture, table)
        found.append(cv2.remap(raw, columns, rows, cv2.INTER_LINEAR) / _density(columns, rows))
    return found[0], found[1]


@lru_cache(maxsize=8)
def tabulate_variance(sensor: SensorModel, gain: float) -> FloatArray:
    """(256,) variance of a channel by its grey value: of shot and read noise, and of rounding."""
    signal = np.linspace(0.0, 1.0, _N_SIGNALS)
    grey = 255.0 * compute_tone_curve(np.minimum(gain * signal, 1.0))
    noise = np.sqrt(signal * sensor.full_well_e + sensor.read_noise_e**2) / sensor.full_well_e
    variance = (np.gradient(grey, signal) * noise) ** 2
    place = np.minimum(np.searchsorted(grey, np.arange(256.0)), _N_SIGNALS - 1)
    table = variance[place] + _ROUNDING
    table[255] = _SATURATED
    table.setflags(write=False)
    return np.asarray(table)


def _variance_of_grey(picture: Image, table: FloatArray) -> Floats:
    """(H, W) of a grey picture, or of what becomes of a coloured one."""
    import cv2

    if picture.ndim == 2:
        return table[picture].astype(np.float32)
    weighted = [table * weight**2 for weight in _LUMA]
    channels = [np.asarray(one, dtype=np.float32) for one in weighted]
    parts = [cv2.LUT(np.ascontiguousarray(picture[..., n]), channels[n]) for n in range(3)]
    return np.asarray(parts[0] + parts[1] + parts[2] + np.float32(_ROUNDING), dtype=np.float32)


def _density(columns: Floats, rows: Floats) -> np.float32:
    """Raw pixels to a rectified one, mean over the picture."""
    by_row, by_column = np.gradient(columns), np.gradient(rows)
    area = np.abs(by_row[1] * by_column[0] - by_row[0] * by_column[1])
    return np.float32(np.median(area))
