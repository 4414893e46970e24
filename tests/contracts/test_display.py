"""Every display backend keeps the contract, and the contract notices displays that do not."""

import numpy as np
import pytest

from drivers.clock import ManualClock
from drivers.contracts import DISPLAY_CHECKS, ContractViolation, DisplayUnderTest
from sim_devices.display import SimulatedDisplay
from sim_devices.lit_display import LitDisplay


def subject(kind: type[SimulatedDisplay], **flips: bool) -> DisplayUnderTest:
    clock = ManualClock(10**9)
    display = kind(clock, 40, 24, **flips)
    return DisplayUnderTest(display, clock, display.visible_image)


@pytest.mark.parametrize("check", DISPLAY_CHECKS, ids=lambda check: check.__name__)
@pytest.mark.parametrize("flips", [{}, {"flips_horizontally": True}, {"flips_vertically": True}])
def test_simulated_display_keeps_its_contract(check, flips):
    check(lambda: subject(SimulatedDisplay, **flips))


@pytest.mark.parametrize("check", DISPLAY_CHECKS, ids=lambda check: check.__name__)
def test_display_in_view_of_simulated_cameras_keeps_the_contract(check):
    def make() -> DisplayUnderTest:
        clock = ManualClock(10**9)
        display = LitDisplay(clock, 40, 24, delay_ns=0, refresh_hz=60.0)
        return DisplayUnderTest(display, clock, display._display.visible_image)

    check(make)


class NeverExpires(SimulatedDisplay):
    def show(self, image, valid_until_ns):
        super().show(image, valid_until_ns)
        self._valid_until_ns = 10**18


class ShowsLatePictures(SimulatedDisplay):
    def show(self, image, valid_until_ns):
        super().show(image, max(valid_until_ns, self._clock.now_ns() + 10**6))


class StaysLitWhenClosed(SimulatedDisplay):
    def close(self):
        self._is_open = False


class IgnoresBlank(SimulatedDisplay):
    def blank(self):
        pass


class BlankNeedsToBeOpen(SimulatedDisplay):
    def blank(self):
        if not self._is_open:
            raise RuntimeError("closed")
        super().blank()


class FlipsInSecret(SimulatedDisplay):
    def visible_image(self):
        return super().visible_image()[:, ::-1]


class TakesAnySize(SimulatedDisplay):
    def show(self, image, valid_until_ns):
        if image.shape != (24, 40, 3):
            return
        super().show(image, valid_until_ns)


class KeepsTheCallersArray(SimulatedDisplay):
    def show(self, image, valid_until_ns):
        super().show(image, valid_until_ns)
        if self._picture is not None:
            self._picture = image


class ShowsWhenClosed(SimulatedDisplay):
    def show(self, image, valid_until_ns):
        self.open()
        super().show(image, valid_until_ns)


class SwapsColours(SimulatedDisplay):
    def visible_image(self):
        return np.ascontiguousarray(super().visible_image()[..., ::-1])


# Other tests have displays of their own.
BROKEN = [kind for kind in SimulatedDisplay.__subclasses__() if kind.__module__ == __name__]


@pytest.mark.parametrize("kind", BROKEN, ids=lambda kind: kind.__name__)
def test_broken_displays_are_caught(kind):
    def run_all() -> None:
        for check in DISPLAY_CHECKS:
            check(lambda: subject(kind))

    with pytest.raises(ContractViolation):
        run_all()
