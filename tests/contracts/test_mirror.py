"""Every mirror backend keeps the contract, and the contract notices those that do not."""

import pytest

from drivers.contracts import MIRROR_CHECKS, ContractViolation, MirrorUnderTest
from drivers.fixed_mirror import FixedMirror
from drivers.interfaces import MirrorInfo
from navapp.errors import DeviceLost, UnsupportedControl
from tests.drivers.firmware_rigs import StageRig, mirror_at, stage_terminal


class Stage:
    """A movable mount in memory: the shortest that keeps the contract."""

    info = MirrorInfo("sim:stage", "test", is_simulated=True, is_movable=True)

    def __init__(self, _: float = 0.0) -> None:
        self.is_open = False
        self.angle_deg: float | None = None

    def open(self):
        self.is_open = True

    def close(self):
        self.is_open = False

    def require_open(self):
        if not self.is_open:
            raise DeviceLost("not open")

    def home(self, timeout_s):
        self.require_open()
        self.angle_deg = 0.0

    def move_to(self, angle_deg, timeout_s):
        self.require_open()
        if self.angle_deg is None or not 0.0 <= angle_deg <= 90.0:
            raise UnsupportedControl("not homed or out of range")
        self.angle_deg = angle_deg

    def position_deg(self):
        self.require_open()
        return self.angle_deg

    def stop(self):
        self.require_open()


@pytest.mark.parametrize("check", MIRROR_CHECKS, ids=lambda check: check.__name__)
@pytest.mark.parametrize("kind", [FixedMirror, Stage])
def test_mirror_keeps_its_contract(kind, check):
    check(lambda: MirrorUnderTest(kind(45.0), 45.0, timeout_s=1.0))


@pytest.mark.parametrize("check", MIRROR_CHECKS, ids=lambda check: check.__name__)
def test_a_zaber_mount_keeps_its_contract_in_memory(check):
    check(lambda: MirrorUnderTest(StageRig().driver, 45.0))


@pytest.mark.parametrize("check", MIRROR_CHECKS, ids=lambda check: check.__name__)
def test_a_zaber_mount_keeps_its_contract_on_a_terminal(check, tmp_path):
    with stage_terminal(tmp_path) as terminal:

        def make() -> MirrorUnderTest:
            # Every mount is new: it has just got power.
            with terminal.held:
                terminal.wire.firmware.restore_power()
            return MirrorUnderTest(mirror_at(terminal), 45.0, timeout_s=5.0)

        check(make)


class MovesUnhomed(Stage):
    def move_to(self, angle_deg, timeout_s):
        self.angle_deg = self.angle_deg or 0.0
        super().move_to(angle_deg, timeout_s)


class KnowsItsPlaceUnhomed(Stage):
    def position_deg(self):
        return super().position_deg() or 0.0


class MissesItsTarget(Stage):
    def move_to(self, angle_deg, timeout_s):
        super().move_to(angle_deg, timeout_s)
        self.angle_deg += 0.5


class GoesAnywhere(Stage):
    def move_to(self, angle_deg, timeout_s):
        self.require_open()
        if self.angle_deg is None:
            raise UnsupportedControl("not homed")
        self.angle_deg = angle_deg


class MovesWhenClosed(Stage):
    def require_open(self):
        pass


class StopFails(Stage):
    def stop(self):
        raise UnsupportedControl("nothing moves")


class HidesThatItIsSimulated(Stage):
    info = MirrorInfo("stage", "test", is_simulated=True, is_movable=True)


class FixedThatMoves(FixedMirror):
    def move_to(self, angle_deg, timeout_s):
        self._angle_deg = angle_deg


class FixedThatDoesNotKnow(FixedMirror):
    def position_deg(self):
        return None


BROKEN = (*Stage.__subclasses__(), FixedThatMoves, FixedThatDoesNotKnow)


@pytest.mark.parametrize("kind", BROKEN, ids=lambda kind: kind.__name__)
def test_broken_mirrors_are_caught(kind):
    def run_all() -> None:
        for check in MIRROR_CHECKS:
            check(lambda: MirrorUnderTest(kind(45.0), 45.0, timeout_s=1.0))

    with pytest.raises(ContractViolation):
        run_all()
