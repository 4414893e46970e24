"""The noise that is told of a simulated sensor, against pictures that it takes."""

import numpy as np
import pytest

from navapp.evaluation.noise_limit.sensor import find_variances, tabulate_variance
from navapp.geometry.rectification import luma, rectifier_of
from sim_devices.rigs import make_default_rig
from sim_devices.sensor import SensorModel


@pytest.mark.parametrize(
    "sensor",
    [SensorModel(seed=3), SensorModel(full_well_e=3000.0, read_noise_e=20.0, seed=4)],
    ids=["usual", "noisy"],
)
@pytest.mark.parametrize("level", [0.03, 0.2, 0.6])
def test_the_table_is_the_noise_of_a_flat_picture(sensor, level) -> None:
    radiance = np.full((200, 300, 3), level, dtype=np.float32)
    picture = sensor.picture(radiance, "right", 1)
    told = tabulate_variance(sensor, sensor.gain_right)[int(np.median(picture))]
    assert told == pytest.approx(picture.astype(float).var(), rel=0.1)


def test_a_grey_picture_has_the_noise_of_its_colours_and_of_its_raw_pixels() -> None:
    rectifier, sensor = rectifier_of(make_default_rig()), SensorModel(seed=5)
    radiance = np.empty((720, 1280, 3), dtype=np.float32)
    radiance[:] = (0.1, 0.2, 0.5)
    left, right = (sensor.picture(radiance, eye, 1) for eye in ("left", "right"))
    for picture, variance in zip(
        (left, right), find_variances(left, right, rectifier, sensor), strict=True
    ):
        assert np.median(variance) == pytest.approx(luma(picture).astype(float).var(), rel=0.1)


def test_what_is_saturated_tells_nothing() -> None:
    rectifier = rectifier_of(make_default_rig())
    white = np.full((720, 1280), 255, dtype=np.uint8)
    left, _ = find_variances(white, white, rectifier, SensorModel())
    assert np.median(left) > 1e5
