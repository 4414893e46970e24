"""A camera package that is installed, as far as the application can tell."""

import importlib.metadata
from collections.abc import Callable

import pytest

from drivers.clock import Clock, ManualClock
from sim_devices.camera import SimulatedCamera
from sim_devices.faults import Fault, FaultKind, FaultScript
from tests.sim_devices.plain_world import PlainWorld


class Entry:
    """An installed camera, as its package announces it."""

    name = "camera.acme"

    def __init__(self) -> None:
        self.camera = SimulatedCamera(
            PlainWorld(), ManualClock(), is_stepped=True,
            faults=FaultScript((Fault(FaultKind.WRONG_SERIAL, 0.1, 9.0),)),
        )  # fmt: skip

    def load(self) -> Callable[[object, Clock], SimulatedCamera]:
        return lambda settings, clock: self.camera


def announce(monkeypatch: pytest.MonkeyPatch, entries: list[Entry]) -> None:
    real = importlib.metadata.entry_points

    def entry_points(**selection: str) -> object:
        return entries if selection.get("group") == "navapp.devices" else real(**selection)

    monkeypatch.setattr(importlib.metadata, "entry_points", entry_points)
