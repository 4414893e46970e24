from drivers.clock import ManualClock
from drivers.fixed_mirror import FixedMirror
from drivers.interfaces import DeviceSet
from drivers.no_projector import NoProjector
from sim_devices.camera import SimulatedCamera
from sim_devices.display import SimulatedDisplay
from tests.sim_devices.plain_world import PlainWorld


def test_closing_all_begins_with_the_display_and_survives_a_failure(monkeypatch):
    clock = ManualClock()
    devices = DeviceSet(
        SimulatedCamera(PlainWorld(), clock, is_stepped=True),
        SimulatedDisplay(clock, 8, 8),
        NoProjector(),
        FixedMirror(45.0),
        clock,
    )
    closed: list[str] = []

    def fail() -> None:
        closed.append("display")
        raise RuntimeError("stuck")

    monkeypatch.setattr(devices.display, "close", fail)
    for name in ("camera", "projector", "mirror"):
        monkeypatch.setattr(getattr(devices, name), "close", lambda name=name: closed.append(name))
    try:
        devices.close()
    except RuntimeError:
        closed.append("told")
    assert closed == ["display", "camera", "projector", "mirror", "told"]
