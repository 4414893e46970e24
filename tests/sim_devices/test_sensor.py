import numpy as np
import pytest

from sim_devices.sensor import SensorModel, _noise, compute_tone_curve, make_tone_table
from sim_devices.sensor_kernels import expose_rows
from tests.reference.sensor_reference import expose_reference

QUIET = SensorModel(read_noise_e=0.0, full_well_e=1e9, psf_sigma_px=0.0)


def flat(level: float, shape: tuple[int, int] = (120, 160)) -> np.ndarray:
    return np.full((*shape, 3), level, np.float32)


def grey_value(signal: float) -> float:
    return float(255.0 * compute_tone_curve(np.array([signal]))[0])


@pytest.mark.kernel
def test_kernel_equals_reference():
    rng = np.random.default_rng(1)
    radiance = rng.uniform(-0.2, 1.4, (37, 90)).astype(np.float32)
    noise = _noise(3, 4096)
    starts = rng.integers(0, 4096 - 90, 37)
    parameters = SensorModel(exposure=0.9).kernel_parameters()
    picture = np.empty((37, 90), np.uint8)
    scratch = np.empty(90, np.int32)
    curve = make_tone_table(1.3)
    expose_rows(radiance, noise, starts, parameters, curve, scratch, picture)
    expected = expose_reference(radiance, noise, starts, parameters, curve)
    difference = np.abs(picture.astype(int) - expected)
    # float32 against float64 may round to the neighbouring table entry, one grey value at most.
    assert difference.max() <= 1
    assert (difference > 0).mean() < 0.005


def test_light_that_is_no_number_is_black():
    light = flat(0.5)
    light[10, 20] = np.nan
    light[30, 40] = np.inf
    light[50, 60] = -1.0
    picture = QUIET.picture(light, "left", 0)
    assert picture[10, 20].max() == 0
    assert picture[30, 40].min() == 255
    assert picture[50, 60].max() == 0


@pytest.mark.parametrize("level", [0.05, 0.2, 0.6])
def test_mean_and_variance_follow_photon_statistics(level):
    sensor = SensorModel(full_well_e=5000.0, read_noise_e=20.0)
    pictures = [sensor.picture(flat(level), "left", k).astype(float) for k in range(8)]
    values = np.stack(pictures)
    slope = (grey_value(level + 1e-4) - grey_value(level - 1e-4)) / 2e-4
    signal_variance = (level * 5000.0 + 20.0**2) / 5000.0**2
    expected_variance = slope**2 * signal_variance + 1.0 / 12.0
    assert values.mean() == pytest.approx(grey_value(level), abs=0.3)
    assert values.var() == pytest.approx(expected_variance, rel=0.05)


def test_noise_has_no_pattern():
    pictures = [SensorModel().picture(flat(0.4), "left", k).astype(float) for k in range(2)]
    left, right = pictures[0], SensorModel(gain_right=1.0).picture(flat(0.4), "right", 0)
    for a, b in (
        (left, pictures[1]),
        (left, right.astype(float)),
        (left[:, :-1], left[:, 1:]),
        (left[:-1], left[1:]),
        (left[..., 0], left[..., 1]),
    ):
        assert abs(np.corrcoef(a.ravel(), b.ravel())[0, 1]) < 0.02


def test_same_frame_gives_the_same_picture_and_every_frame_its_own():
    sensor = SensorModel(seed=5)
    first = sensor.picture(flat(0.4), "left", 7)
    assert np.array_equal(first, SensorModel(seed=5).picture(flat(0.4), "left", 7))
    assert not np.array_equal(first, sensor.picture(flat(0.4), "left", 8))
    assert not np.array_equal(first, SensorModel(seed=6).picture(flat(0.4), "left", 7))


def test_right_eye_is_four_percent_brighter():
    left = QUIET.picture(flat(0.5), "left", 0)
    right = QUIET.picture(flat(0.5), "right", 0)
    assert left.max() == left.min() == round(grey_value(0.5))
    assert right.max() == right.min() == round(grey_value(0.52))


def test_exposure_and_gain_brighten_up_to_saturation():
    assert QUIET.with_exposure(2.0, 0.0).picture(flat(0.2), "left", 0)[0, 0, 0] == round(
        grey_value(0.4)
    )
    doubled = 20.0 * np.log10(2.0)
    assert QUIET.with_exposure(1.0, doubled).picture(flat(0.2), "left", 0)[0, 0, 0] == round(
        grey_value(0.4)
    )
    assert SensorModel(exposure=8.0).picture(flat(0.5), "left", 0).min() == 255


def test_gain_raises_noise_that_exposure_would_not():
    exposed = SensorModel().with_exposure(4.0, 0.0).picture(flat(0.1), "left", 0).astype(float)
    amplified = SensorModel().with_exposure(1.0, 12.041).picture(flat(0.1), "left", 0).astype(float)
    assert amplified.mean() == pytest.approx(exposed.mean(), abs=0.5)
    assert amplified.std() > 1.5 * exposed.std()


def test_lens_blurs_a_point_without_losing_light():
    light = flat(0.0)
    light[60, 80] = 0.5
    sharp = QUIET.picture(light, "left", 0)
    blurred = SensorModel(read_noise_e=0.0, full_well_e=1e9).picture(light, "left", 0)
    assert np.count_nonzero(sharp[..., 0]) == 1
    assert np.count_nonzero(blurred[..., 0]) == 9
    assert blurred[60, 80, 0] < sharp[60, 80, 0]
    # The tone curve is undone to add up light.
    levels = np.linspace(0.0, 1.0, 20001)
    back = np.interp(blurred[..., 0] / 255.0, compute_tone_curve(levels), levels)
    assert back.sum() == pytest.approx(0.5, rel=0.03)


def test_grey_sensor_gives_one_channel():
    light = flat(0.0)
    light[..., 1] = 0.5
    picture = SensorModel(is_grey=True).picture(light, "left", 0)
    assert picture.shape == (120, 160)
    assert picture.mean() == pytest.approx(grey_value(0.587 * 0.5), abs=1.0)


def test_tone_curve_is_continuous_and_covers_all_grey_values():
    table = make_tone_table(1.0).astype(int)
    assert table[0] == 0
    assert table[-1] == 255
    assert set(np.diff(table)) <= {0, 1}


@pytest.mark.parametrize(
    "values", [{"full_well_e": 0.0}, {"exposure": -1.0}, {"gain_left": np.nan}, {"seed": -1}]
)
def test_impossible_sensors_are_refused(values):
    with pytest.raises(ValueError, match="sensor"):
        SensorModel(**values)
