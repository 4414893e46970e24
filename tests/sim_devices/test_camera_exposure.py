"""Motion blur and rolling shutter of the simulated camera."""

from dataclasses import replace

import numpy as np
import pytest

from drivers.clock import ManualClock
from navapp.errors import UnsupportedControl
from sim_devices.camera import SimulatedCamera
from sim_devices.scenario import Scenario
from sim_devices.sensor import SensorModel
from sim_devices.world import World
from tests.sim_devices.plain_world import PlainWorld

START_NS = 7_000_000_000
MS = 1_000_000
PERIOD_NS = 100 * MS


def opened(world, **options):
    camera = SimulatedCamera(world, ManualClock(START_NS), is_stepped=True, rate_hz=10.0, **options)
    camera.open()
    return camera


def rolling(world, shutter_ms):
    row_delay_ns = round(shutter_ms * MS / (world.rig.height - 1))
    world.rig = replace(world.rig, row_delay_ns=row_delay_ns)
    return world


def test_without_blur_and_shutter_each_eye_is_rendered_once_at_capture():
    world = PlainWorld()
    world.speed_px_s = 1e4
    camera = opened(world)
    frames = [camera.read(1.0) for _ in range(2)]
    assert world.rendered == [(eye, t) for t in (0, PERIOD_NS) for eye in ("left", "right")]
    assert [frame.received_ns - frame.captured_ns for frame in frames] == [0, 0]
    assert frames[0].row_delay_ns == 0


def test_what_stands_still_gives_the_same_pictures_with_blur_and_shutter():
    plain, blurred = opened(PlainWorld()), opened(rolling(PlainWorld(), 15.0), is_blurred=True)
    for _ in range(2):
        first, second = plain.read(1.0), blurred.read(1.0)
        assert first.captured_ns == second.captured_ns
        np.testing.assert_array_equal(first.left, second.left)
        np.testing.assert_array_equal(first.right, second.right)


def test_what_moves_is_rendered_through_the_exposure_of_both_eyes_alike():
    world = PlainWorld()
    world.speed_px_s = 3.0 / 0.008
    camera = opened(world, is_blurred=True, skew_ns=MS)
    camera.read(1.0)
    times_ms = {
        eye: [t / MS for seen, t in world.rendered if seen == eye] for eye in ("left", "right")
    }
    expected_ms = (np.arange(6) - 2.5) * 8.0 / 6.0
    np.testing.assert_allclose(times_ms["left"], expected_ms, atol=1e-5)
    np.testing.assert_allclose(times_ms["right"], expected_ms + 1.0, atol=1e-5)


def test_the_exposure_that_is_set_is_that_of_the_blur():
    world = PlainWorld()
    world.speed_px_s = 3.0 / 0.008
    camera = opened(world, is_blurred=True)
    camera.set("exposure_ms", 16.0)
    frame = camera.read(1.0)
    assert len(world.rendered) == 2 * 12
    assert frame.received_ns - frame.captured_ns == 8 * MS


def test_half_the_pictures_size_is_half_the_blur():
    world = PlainWorld()
    world.speed_px_s = 3.0 / 0.008
    opened(world, is_blurred=True, scale=0.5).read(1.0)
    assert len(world.rendered) == 2 * 3


def test_rows_are_taken_one_after_the_other_and_the_frame_says_so():
    world = rolling(PlainWorld(), 20.0)
    world.speed_px_s = 500.0
    camera = opened(world, sensor=SensorModel(read_noise_e=0.0, full_well_e=1e12))
    camera.read(1.0)
    frame = camera.read(1.0)
    assert frame.row_delay_ns == world.rig.row_delay_ns
    assert frame.received_ns - frame.captured_ns == pytest.approx(10 * MS, abs=2)
    times_ns = [t for eye, t in world.rendered[-80:] if eye == "left"]
    assert max(times_ns) - PERIOD_NS == pytest.approx(10 * MS, rel=1e-3)
    # This world becomes brighter with time: so do the rows, about the middle one at capture.
    plain = opened(PlainWorld(), sensor=SensorModel(read_noise_e=0.0, full_well_e=1e12))
    plain.read(1.0)
    even = plain.read(1.0)
    rise = frame.left.astype(int).mean(axis=(1, 2)) - even.left.astype(int).mean(axis=(1, 2))
    assert rise[0] < -0.5 < 0.5 < rise[-1]
    assert abs(rise[23:25]).max() < 0.5


def test_small_pictures_take_as_long_as_large_ones():
    camera = opened(rolling(PlainWorld(), 20.0), scale=0.5)
    frame = camera.read(1.0)
    # 24 rows of 48: the delay of a row is doubled.
    assert frame.row_delay_ns * 24 == pytest.approx(20 * MS * 48 / 47, rel=1e-6)


def test_shutter_and_exposure_must_fit_into_a_frame_period():
    with pytest.raises(ValueError, match="frame period"):
        opened(rolling(PlainWorld(), 95.0))
    camera = opened(rolling(PlainWorld(), 60.0))
    with pytest.raises(UnsupportedControl, match=r"exposure_ms to 41"):
        camera.set("exposure_ms", 41.0)
    assert camera.set("exposure_ms", 39.0) == 39.0


SCALE = 0.5
DRIFTING = Scenario(seed=5, motion="still", drift_mm_s=200.0)
AT_NS = 333 * MS  # it has its full speed


def grey(picture):
    return np.asarray(picture, dtype=np.float64).mean(axis=2)


def difference(first, second):
    """Root mean square over the part of the picture in which the leg is."""
    part = slice(80, 280), slice(220, 420)
    return float(np.sqrt(np.mean((grey(first)[part] - grey(second)[part]) ** 2)))


def take(scenario, shutter_ms=0.0, *, is_blurred=False):
    world = rolling(World(scenario), shutter_ms)
    camera = SimulatedCamera(
        world, ManualClock(), is_stepped=True, rate_hz=1e9 / AT_NS, scale=SCALE,
        is_blurred=is_blurred,
    )  # fmt: skip
    camera.open()
    camera.read(1.0)
    return world, camera.read(1.0)


@pytest.mark.release
def test_each_row_of_the_leg_is_as_a_picture_of_its_own_time_has_it():
    world, frame = take(DRIFTING, 16.0)
    assert frame.captured_ns == pytest.approx(AT_NS, abs=1)
    rows = slice(240, 250)  # of 360
    row_ns = AT_NS + round((244.5 - 179.5) * frame.row_delay_ns)
    sensor = SensorModel()
    own, middle = (
        sensor.picture(world.render("left", t, SCALE), "left", 1) for t in (row_ns, AT_NS)
    )
    moved = difference(own, middle)
    here = slice(rows.start - 80, rows.stop - 80)

    def band(picture):
        return grey(picture)[80:280, 220:420][here]

    own_error = np.sqrt(np.mean((band(frame.left) - band(own)) ** 2))
    middle_error = np.sqrt(np.mean((band(frame.left) - band(middle)) ** 2))
    assert moved > 4.0
    assert own_error < 0.4 * middle_error


@pytest.mark.release
def test_the_leg_is_the_mean_of_the_pictures_of_its_exposure():
    world, frame = take(DRIFTING, is_blurred=True)
    times_ns = AT_NS + np.linspace(-4.0 * MS, 4.0 * MS, 41).astype(int)
    light = np.mean([world.render("left", int(t), SCALE) for t in times_ns], axis=0)
    expected = SensorModel().picture(light.astype(np.float32), "left", 1)
    sharp = SensorModel().picture(world.render("left", AT_NS, SCALE), "left", 1)
    assert difference(frame.left, expected) < 0.25 * difference(frame.left, sharp)


def test_only_the_asked_rows_need_be_right_and_they_are():
    world = World(DRIFTING)
    whole = world.render("left", AT_NS, SCALE)
    part = world.render("left", AT_NS, SCALE, rows=(100, 130))
    np.testing.assert_array_equal(part[100:130], whole[100:130])
    assert (part[200] != whole[200]).any()
