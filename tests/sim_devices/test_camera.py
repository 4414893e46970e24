import threading
import time

import numpy as np
import pytest

from drivers.clock import ManualClock, SystemClock
from drivers.latest import LatestSlot, ReaderThread
from navapp.errors import (
    DeviceLost,
    DeviceNotFound,
    DeviceTimeout,
    EndOfSequence,
    UnsupportedControl,
)
from sim_devices.camera import SimulatedCamera
from sim_devices.faults import Fault, FaultKind, FaultScript
from sim_devices.sensor import SensorModel
from tests.sim_devices.plain_world import PlainWorld

START_NS = 7_000_000_000
S = 1_000_000_000


class Bench:
    """An opened camera in a plain world, on a clock that the test turns."""

    def __init__(self, *faults: Fault, is_stepped: bool = True, **options) -> None:
        self.world = PlainWorld()
        self.clock = ManualClock(START_NS)
        options.setdefault("rate_hz", 10.0)
        self.camera = SimulatedCamera(
            self.world, self.clock, is_stepped=is_stepped, faults=FaultScript(faults), **options
        )
        self.camera.open()

    def elapsed_s(self) -> float:
        return (self.clock.now_ns() - START_NS) / S

    def captured_s(self, n: int, timeout_s: float = 1.0) -> list[float]:
        frames = [self.camera.read(timeout_s) for _ in range(n)]
        return [round((frame.captured_ns - START_NS) / S, 6) for frame in frames]


both_modes = pytest.mark.parametrize("is_stepped", [True, False])


def test_stepped_camera_takes_every_instant_and_moves_the_clock():
    bench = Bench()
    assert bench.captured_s(3) == [0.0, 0.1, 0.2]
    assert bench.elapsed_s() == pytest.approx(0.2)
    bench.clock.advance_ns(S)
    assert bench.captured_s(2) == [0.3, 0.4]


def test_instants_do_not_drift():
    bench = Bench(rate_hz=15.0)
    assert bench.captured_s(46)[-1] == 3.0


def test_free_running_camera_skips_the_instants_that_nobody_waited_for():
    bench = Bench(is_stepped=False)
    assert bench.captured_s(2) == [0.0, 0.1]
    bench.clock.advance_ns(round(0.35 * S))
    assert bench.captured_s(2) == [0.5, 0.6]


def test_slow_rendering_lowers_the_rate_of_a_free_running_camera():
    bench = Bench(is_stepped=False)
    render = bench.world.render

    def slow(eye, time_ns, *how):
        bench.clock.advance_ns(round(0.08 * S))
        return render(eye, time_ns, *how)

    bench.world.render = slow
    frames = [bench.camera.read(1.0) for _ in range(4)]
    received_s = [(frame.received_ns - START_NS) / S for frame in frames]
    assert received_s == pytest.approx([0.16, 0.32, 0.48, 0.64])
    captured_s = [(frame.captured_ns - START_NS) / S for frame in frames]
    assert captured_s == pytest.approx([0.0, 0.2, 0.4, 0.5])


@both_modes
def test_same_settings_give_the_same_pictures(is_stepped):
    first, second = Bench(is_stepped=is_stepped), Bench(is_stepped=is_stepped)
    for _ in range(3):
        a, b = first.camera.read(1.0), second.camera.read(1.0)
        assert np.array_equal(a.left, b.left)
        assert np.array_equal(a.right, b.right)


def test_right_eye_is_rendered_later_by_the_skew():
    bench = Bench(skew_ns=4_000_000)
    frame = [bench.camera.read(1.0) for _ in range(2)][1]
    assert frame.skew_ns == 4_000_000
    assert bench.world.rendered[2:] == [("left", S // 10), ("right", S // 10 + 4_000_000)]
    assert frame.received_ns >= frame.captured_ns + frame.skew_ns
    assert bench.camera.info.measured_skew_ms == pytest.approx(4.0)


def test_an_unstamped_skew_moves_the_right_exposure_and_no_stamp():
    bench = Bench(skew_ns=4_000_000, unstamped_skew_ns=-1_000_000)
    frame = [bench.camera.read(1.0) for _ in range(2)][1]
    assert frame.skew_ns == 4_000_000
    assert bench.world.rendered[2:] == [("left", S // 10), ("right", S // 10 + 3_000_000)]


def test_scale_makes_smaller_pictures_and_another_rig():
    bench = Bench(scale=0.5)
    frame, info = bench.camera.read(1.0), bench.camera.info
    assert frame.left.shape == (24, 32, 3)
    assert (info.width, info.height) == (32, 24)
    assert frame.rig_id == info.factory_rig.rig_id != bench.world.rig.rig_id


def test_info_tells_what_it_is():
    bench = Bench(n_frames=9)
    bench.captured_s(3)
    info = bench.camera.info
    assert info.name.startswith("sim:")
    assert info.is_simulated
    assert info.serials == ("L1", "R1")
    assert info.n_frames == 9
    assert info.measured_rate_hz == pytest.approx(10.0)


def test_grey_sensor_gives_grey_frames():
    assert Bench(sensor=SensorModel(is_grey=True)).camera.read(1.0).left.shape == (48, 64)


def test_finite_sequence_ends():
    bench = Bench(n_frames=2)
    bench.captured_s(2)
    with pytest.raises(EndOfSequence):
        bench.camera.read(1.0)


def test_world_time_counts_from_the_first_opening():
    bench = Bench()
    bench.captured_s(5)
    bench.camera.close()
    bench.clock.advance_ns(S)
    bench.camera.open()
    frame = bench.camera.read(1.0)
    assert bench.camera.world_time_ns(frame.captured_ns) == round(1.4 * S)
    assert bench.world.rendered[-2] == ("left", round(1.4 * S))


def test_longer_exposure_is_brighter_and_read_back_in_its_steps():
    bench = Bench()
    dark = bench.camera.read(1.0).left.mean()
    assert bench.camera.set("exposure_ms", 16.04) == 16.0
    assert bench.camera.read(1.0).left.mean() > dark + 30
    assert bench.camera.set("exposure_ms", 8.0) == 8.0
    assert bench.camera.set("gain_db", 6.0) == 6.0
    assert bench.camera.read(1.0).left.mean() > dark + 30


@pytest.mark.parametrize(
    ("control", "value"),
    [("focus", 1.0), ("exposure_ms", 0.0), ("exposure_ms", 101.0), ("gain_db", float("nan"))],
)
def test_controls_that_it_cannot_set_are_refused(control, value):
    with pytest.raises(UnsupportedControl, match=control):
        Bench().camera.set(control, value)


@both_modes
def test_unplugged_camera_is_lost_until_it_is_plugged_in_and_opened_again(is_stepped):
    bench = Bench(Fault(FaultKind.UNPLUG, 0.25, 1.0), is_stepped=is_stepped)
    assert bench.captured_s(3) == [0.0, 0.1, 0.2]
    with pytest.raises(DeviceLost, match="unplugged"):
        bench.camera.read(1.0)
    assert bench.elapsed_s() == pytest.approx(0.25)
    bench.camera.close()
    with pytest.raises(DeviceNotFound, match="unplugged"):
        bench.camera.open()
    bench.clock.advance_ns(S)
    bench.camera.open()
    assert bench.captured_s(2) == [1.3, 1.4]


@both_modes
def test_short_unplugging_between_two_reads_is_noticed(is_stepped):
    bench = Bench(Fault(FaultKind.UNPLUG, 0.25, 0.01), is_stepped=is_stepped)
    bench.captured_s(2)
    bench.clock.advance_ns(S)
    for _ in range(2):
        with pytest.raises(DeviceLost):
            bench.camera.read(1.0)


@both_modes
def test_frozen_camera_repeats_picture_and_capture_time(is_stepped):
    bench = Bench(Fault(FaultKind.FREEZE, 0.15, 0.3), is_stepped=is_stepped)
    frames = [bench.camera.read(1.0) for _ in range(7)]
    times_s = [(frame.captured_ns - START_NS) / S for frame in frames]
    assert times_s == pytest.approx([0.0, 0.1, 0.1, 0.1, 0.1, 0.5, 0.6])
    assert np.array_equal(frames[1].left, frames[4].left)
    received_s = [(frame.received_ns - START_NS) / S for frame in frames]
    assert received_s == pytest.approx([0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6])
    assert [frame.sequence for frame in frames] == list(range(7))


@both_modes
def test_dropped_frames_vanish(is_stepped):
    bench = Bench(Fault(FaultKind.DROP, 0.15, 0.3), is_stepped=is_stepped)
    assert bench.captured_s(4) == [0.0, 0.1, 0.5, 0.6]


@both_modes
def test_long_drop_ends_in_timeouts_that_take_their_time(is_stepped):
    bench = Bench(Fault(FaultKind.DROP, 0.15, 1.0), is_stepped=is_stepped)
    assert bench.captured_s(2) == [0.0, 0.1]
    for elapsed_s in (0.6, 1.1):
        with pytest.raises(DeviceTimeout):
            bench.camera.read(0.5)
        assert bench.elapsed_s() == pytest.approx(elapsed_s)
    assert bench.captured_s(2, 0.5) == [1.2, 1.3]


@both_modes
def test_delayed_frames_are_old_and_still_in_order(is_stepped):
    bench = Bench(Fault(FaultKind.DELAY, 0.15, 0.5, delay_s=0.3), is_stepped=is_stepped)
    frames = [bench.camera.read(1.0) for _ in range(10)]
    captured_ns = [frame.captured_ns for frame in frames]
    assert captured_ns == sorted(set(captured_ns))
    for frame in frames:
        elapsed_s = (frame.captured_ns - START_NS) / S
        age_s = (frame.received_ns - frame.captured_ns) / S
        if 0.15 <= elapsed_s < 0.65:
            assert age_s == pytest.approx(0.3)
    assert (frames[-1].received_ns - frames[-1].captured_ns) / S == pytest.approx(0.0, abs=1e-6)


def test_blackout_darkens_one_eye_only():
    bench = Bench(
        Fault(FaultKind.BLACKOUT_LEFT, 0.05, 0.1), Fault(FaultKind.BLACKOUT_RIGHT, 0.15, 0.1)
    )
    frames = [bench.camera.read(1.0) for _ in range(4)]
    is_lit = [(bool(f.left.mean() > 20), bool(f.right.mean() > 20)) for f in frames]
    assert is_lit == [(True, True), (False, True), (True, False), (True, True)]


def test_wrong_serial_shows_after_reopening_and_goes_after_the_next():
    bench = Bench(Fault(FaultKind.WRONG_SERIAL, 1.0, 1.0))
    assert bench.camera.info.serials == ("L1", "R1")
    for expected in (("L1-other", "R1-other"), ("L1", "R1")):
        bench.camera.close()
        bench.clock.advance_ns(round(1.1 * S))
        bench.camera.open()
        assert bench.camera.info.serials == expected


@both_modes
def test_faults_leave_no_trace_after_they_end(is_stepped):
    faulty = Bench(
        Fault(FaultKind.FREEZE, 0.05, 0.1),
        Fault(FaultKind.BLACKOUT_LEFT, 0.05, 0.1),
        is_stepped=is_stepped,
    )
    healthy = Bench(is_stepped=is_stepped)
    for _ in range(4):
        a, b = faulty.camera.read(1.0), healthy.camera.read(1.0)
    assert np.array_equal(a.left, b.left)


def test_closing_from_another_thread_ends_a_waiting_read():
    camera = SimulatedCamera(PlainWorld(), SystemClock(), is_stepped=False, rate_hz=0.05)
    camera.open()
    errors: list[Exception] = []

    def read() -> None:
        try:
            # The instant of opening may be met or just missed: the next is 20 s away.
            for _ in range(2):
                camera.read(30.0)
        except DeviceLost as error:
            errors.append(error)

    reader = threading.Thread(target=read)
    reader.start()
    time.sleep(0.05)
    camera.close()
    reader.join(5.0)
    assert not reader.is_alive()
    assert len(errors) == 1


def test_closing_and_reopening_ends_the_read_of_the_old_opening():
    bench = Bench()
    render = bench.world.render

    def reopen(eye, time_ns, *how):
        bench.camera.close()
        bench.camera.open()
        return render(eye, time_ns, *how)

    bench.world.render = reopen
    with pytest.raises(DeviceLost):
        bench.camera.read(1.0)
    bench.world.render = render
    bench.camera.read(1.0)


def test_reader_thread_hands_out_the_newest_frame_and_the_loss():
    clock = SystemClock()
    faults = FaultScript((Fault(FaultKind.UNPLUG, 0.3, 10.0),))
    camera = SimulatedCamera(PlainWorld(), clock, is_stepped=False, rate_hz=100.0, faults=faults)
    camera.open()
    slot: LatestSlot = LatestSlot()
    reader = ReaderThread(camera, slot)
    reader.start()
    time.sleep(0.1)
    first, second = slot.take(1.0), slot.take(1.0)
    assert second.sequence > first.sequence
    assert slot.n_dropped > 0
    assert clock.now_ns() - second.captured_ns < S // 2
    time.sleep(0.3)
    slot.take(0.0)
    with pytest.raises(DeviceLost):
        slot.take(1.0)
    assert reader.stop()


def test_a_turn_reaches_the_world_while_it_lasts():
    bench = Bench(Fault(FaultKind.TURN, 0.1, 0.1, turn_deg=(0.0, 90.0, 0.0)))
    bench.captured_s(3)
    still, turned = (0.0, 0.0, 0.0), (0.0, np.pi / 2, 0.0)
    assert bench.world.turns_rad == [still, still, turned, turned, still, still]
