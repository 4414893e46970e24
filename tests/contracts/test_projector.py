"""Every projector backend keeps the contract, and the contract notices those that do not."""

import pytest

from drivers.contracts import PROJECTOR_CHECKS, ContractViolation, ProjectorUnderTest
from drivers.interfaces import CommandResult, PowerState, ProjectorStatus
from drivers.no_projector import NoProjector
from navapp.errors import DeviceLost, UnsupportedControl
from sim_devices.firmware.escvp21 import ProjectorModel
from tests.drivers.firmware_rigs import ProjectorRig, projector_at, projector_terminal

pytestmark = pytest.mark.waits


class Lamp:
    """A projector in memory: the shortest that keeps the contract with all commands."""

    name = "sim:lamp"

    def __init__(self) -> None:
        self.is_open = False
        self.state = ProjectorStatus(PowerState.STANDBY, "30", False, False, False)

    def open(self):
        self.is_open = True

    def close(self):
        self.is_open = False

    def change(self, **values):
        if not self.is_open:
            raise DeviceLost("not open")
        known = {name: getattr(self.state, name) for name in ProjectorStatus.__slots__}
        self.state = ProjectorStatus(**{**known, **values})
        return CommandResult.VERIFIED

    def set_power(self, is_on, timeout_s):
        return self.change(power=PowerState.ON if is_on else PowerState.STANDBY)

    def set_source(self, source, timeout_s):
        if self.is_open and source not in ("30", "A0"):
            raise UnsupportedControl("no such source")
        return self.change(source=source)

    def set_mute(self, is_muted, timeout_s):
        return self.change(is_muted=is_muted)

    def set_flips(self, horizontally, vertically, timeout_s):
        return self.change(flips_horizontally=horizontally, flips_vertically=vertically)

    def status(self):
        self.change()
        return self.state


@pytest.mark.parametrize("check", PROJECTOR_CHECKS, ids=lambda check: check.__name__)
@pytest.mark.parametrize("kind", [NoProjector, Lamp])
def test_projector_keeps_its_contract(kind, check):
    check(lambda: ProjectorUnderTest(kind(), source="A0", timeout_s=1.0))


@pytest.mark.parametrize("check", PROJECTOR_CHECKS, ids=lambda check: check.__name__)
@pytest.mark.parametrize("is_quick", [False, True])
def test_an_escvp21_projector_keeps_its_contract_in_memory(is_quick, check):
    def make() -> ProjectorUnderTest:
        rig = ProjectorRig(ProjectorModel(is_quick=is_quick, has_events=is_quick))
        return ProjectorUnderTest(rig.driver, source="A0")

    check(make)


@pytest.mark.parametrize("check", PROJECTOR_CHECKS, ids=lambda check: check.__name__)
def test_an_escvp21_projector_keeps_its_contract_on_a_terminal(check, tmp_path):
    with projector_terminal(tmp_path) as terminal:
        check(lambda: ProjectorUnderTest(projector_at(terminal), source="A0", timeout_s=10.0))


class LiesAboutPower(Lamp):
    def set_power(self, is_on, timeout_s):
        return self.change()


class LiesAboutMute(Lamp):
    def set_mute(self, is_muted, timeout_s):
        return self.change()


class SwapsFlips(Lamp):
    def set_flips(self, horizontally, vertically, timeout_s):
        return super().set_flips(vertically, horizontally, timeout_s)


class TakesAnySource(Lamp):
    def set_source(self, source, timeout_s):
        return self.change(source=source)


class ReturnsNothing(Lamp):
    def set_power(self, is_on, timeout_s):
        self.change(power=PowerState.ON if is_on else PowerState.STANDBY)


class ObeysWhenClosed(Lamp):
    def set_mute(self, is_muted, timeout_s):
        return CommandResult.ACCEPTED


class ForgetsThatItIsAbsent(NoProjector):
    def set_power(self, is_on, timeout_s):
        return CommandResult.VERIFIED


class CloseFails(Lamp):
    def close(self):
        if not self.is_open:
            raise DeviceLost("closed already")
        super().close()


BROKEN = (*Lamp.__subclasses__(), ForgetsThatItIsAbsent)


@pytest.mark.parametrize("kind", BROKEN, ids=lambda kind: kind.__name__)
def test_broken_projectors_are_caught(kind):
    def run_all() -> None:
        for check in PROJECTOR_CHECKS:
            check(lambda: ProjectorUnderTest(kind(), source="A0", timeout_s=1.0))

    with pytest.raises(ContractViolation):
        run_all()
