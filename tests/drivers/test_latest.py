import threading

import pytest

from drivers.clock import ManualClock
from drivers.latest import LatestSlot, ReaderThread
from navapp.errors import DeviceLost, DeviceTimeout
from sim_devices.camera import SimulatedCamera
from tests.sim_devices.plain_world import PlainWorld


def test_newer_value_replaces_an_unread_one_and_is_counted():
    slot: LatestSlot[int] = LatestSlot()
    for value in (1, 2, 3):
        slot.put(value)
    assert slot.take(0.0) == 3
    assert slot.n_dropped == 2
    assert slot.take(0.0) is None


def test_last_value_comes_before_the_error():
    slot: LatestSlot[int] = LatestSlot()
    slot.put(1)
    slot.fail(DeviceLost("gone"))
    assert slot.take(0.0) == 1
    for _ in range(2):
        with pytest.raises(DeviceLost):
            slot.take(0.0)


def test_waiting_reader_wakes_up():
    slot: LatestSlot[int] = LatestSlot()
    timer = threading.Timer(0.02, slot.put, (5,))
    timer.start()
    assert slot.take(5.0) == 5
    timer.join()


class Scripted(SimulatedCamera):
    """Raises what it is told, one after the other, in `read`."""

    def __init__(self, *errors: Exception) -> None:
        super().__init__(PlainWorld(), ManualClock(), is_stepped=True)
        self.errors = list(errors)
        self.n_closed = 0

    def read(self, timeout_s):
        raise self.errors.pop(0)

    def close(self):
        self.n_closed += 1
        super().close()


def run(camera: Scripted) -> tuple[LatestSlot, str]:
    slot: LatestSlot = LatestSlot()
    camera.open()
    reader = ReaderThread(camera, slot)
    reader.start()
    with pytest.raises(DeviceLost):
        slot.take(5.0)
    assert reader.stop()
    assert camera.n_closed == 1
    return slot, reader.silence


def test_timeouts_are_told_and_reading_goes_on():
    _, silence = run(Scripted(DeviceTimeout("late"), DeviceTimeout("later"), DeviceLost("gone")))
    assert silence == "later"


def test_bug_of_a_driver_becomes_a_lost_device_with_its_name():
    slot, _ = run(Scripted(ZeroDivisionError("oops")))
    with pytest.raises(DeviceLost, match="camera sim:stereo camera failed: oops") as caught:
        slot.take(0.0)
    assert isinstance(caught.value.__cause__, ZeroDivisionError)


def test_reader_that_never_started_can_be_stopped():
    assert ReaderThread(Scripted(), LatestSlot()).stop()
