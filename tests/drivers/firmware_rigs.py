"""Drivers on firmware: in memory on a clock that stands, or behind a pseudo-terminal."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from drivers import escvp21_projector, zaber_line
from drivers.clock import ManualClock, SystemClock
from drivers.escvp21_projector import EscVp21Projector
from drivers.serial_port import SerialAddress
from drivers.zaber_mirror import ZaberMirror
from sim_devices.firmware.escvp21 import ProjectorFirmware, ProjectorModel
from sim_devices.firmware.fast_clock import FastClock
from sim_devices.firmware.memory_port import MemoryAddress
from sim_devices.firmware.pseudo_terminal import PseudoTerminal
from sim_devices.firmware.stage_motion import StageModel
from sim_devices.firmware.wire import Wire
from sim_devices.firmware.zaber import StageFirmware

SERIAL = "SIM1200123"
STAGE_SERIAL = "990123"


class ProjectorRig:
    """A projector in memory."""

    def __init__(self, model: ProjectorModel | None = None, serial: str = SERIAL) -> None:
        self.clock = ManualClock(10**9)
        self.firmware = ProjectorFirmware(self.clock, model)
        self.wire = Wire(self.firmware, self.clock)
        self.driver = EscVp21Projector(MemoryAddress(self.wire), self.clock, serial)

    def lit(self) -> "ProjectorRig":
        self.driver.open()
        self.driver.set_power(True, 150.0)
        return self

    @property
    def now_s(self) -> float:
        return self.clock.now_ns() / 1e9


class StageRig:
    """A mirror mount in memory."""

    def __init__(self, model: StageModel | None = None, serial: str = STAGE_SERIAL) -> None:
        self.clock = ManualClock(10**9)
        self.firmware = StageFirmware(self.clock, model)
        self.wire = Wire(self.firmware, self.clock)
        self.driver = ZaberMirror(MemoryAddress(self.wire), self.clock, serial)

    def homed(self) -> "StageRig":
        self.driver.open()
        self.driver.home(30.0)
        return self

    @property
    def now_s(self) -> float:
        return self.clock.now_ns() / 1e9


@contextmanager
def projector_terminal(folder: Path, speed: float = 200.0) -> Iterator[PseudoTerminal]:
    """A projector behind a pseudo-terminal, faster than the real one."""
    clock = FastClock(speed)
    with _plugged(Wire(ProjectorFirmware(clock), clock), folder / "projector") as terminal:
        yield terminal


@contextmanager
def stage_terminal(folder: Path, speed: float = 20.0) -> Iterator[PseudoTerminal]:
    """A mount behind a pseudo-terminal, faster than the real one."""
    clock = FastClock(speed)
    with _plugged(Wire(StageFirmware(clock), clock), folder / "stage") as terminal:
        yield terminal


@contextmanager
def _plugged(wire: Wire, path: Path) -> Iterator[PseudoTerminal]:
    terminal = PseudoTerminal(wire, path)
    terminal.plug()
    try:
        yield terminal
    finally:
        terminal.unplug()


def projector_at(terminal: PseudoTerminal, serial: str = SERIAL) -> EscVp21Projector:
    address = SerialAddress(str(terminal.path), escvp21_projector.BAUD_RATE)
    return EscVp21Projector(address, SystemClock(), serial)


def mirror_at(terminal: PseudoTerminal, serial: str = STAGE_SERIAL) -> ZaberMirror:
    address = SerialAddress(str(terminal.path), zaber_line.BAUD_RATE)
    return ZaberMirror(address, SystemClock(), serial)
