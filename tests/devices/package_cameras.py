"""A camera package that is installed, as far as the application can tell."""

import importlib.metadata
from collections.abc import Callable, Mapping
from pathlib import Path

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


def install(
    folder: Path, package: str, entries: Mapping[str, str], modules: Mapping[str, str]
) -> None:
    """Leave in a folder what an installer leaves: modules, and a description of the package.

    Args:
        folder: to be found by Python.
        package: its name; the version is 1.0.
        entries: of the group `navapp.devices`: name -> `module:function`.
        modules: file -> source.
    """
    # As installers escape it: up to the first hyphen stands the package's name.
    described = folder / f"{package.replace('-', '_')}-1.0.dist-info"
    described.mkdir(parents=True)
    metadata = f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n"
    (described / "METADATA").write_text(metadata, encoding="utf-8")
    lines = "".join(f"{name} = {factory}\n" for name, factory in entries.items())
    (described / "entry_points.txt").write_text(f"[navapp.devices]\n{lines}", encoding="utf-8")
    for file, source in modules.items():
        (folder / file).parent.mkdir(parents=True, exist_ok=True)
        (folder / file).write_text(source, encoding="utf-8")
