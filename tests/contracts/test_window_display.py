"""The window keeps the contract of every display, on an X server without a monitor."""

from collections.abc import Iterator

import pytest

from drivers.clock import SystemClock
from drivers.contracts import DISPLAY_CHECKS, DisplayUnderTest
from drivers.window_display import WindowDisplay
from drivers.window_process import WindowSettings
from tests.many import few_of
from tests.x_servers import seen, xvfb

pytestmark = pytest.mark.waits

WIDTH, HEIGHT = 320, 200
# A hundred times what it takes on an idle machine.
LATENCY_NS = 500_000_000


@pytest.fixture(scope="module")
def server() -> Iterator[str]:
    with xvfb(WIDTH, HEIGHT) as display:
        yield display


@pytest.mark.parametrize("check", DISPLAY_CHECKS, ids=lambda check: check.__name__)
@pytest.mark.parametrize("is_flipped", few_of([True, False]))
def test_window_display_keeps_its_contract(check, is_flipped, server, monkeypatch) -> None:
    monkeypatch.setenv("DISPLAY", server)
    clock = SystemClock()
    settings = WindowSettings("", WIDTH, HEIGHT, flips_horizontally=is_flipped)

    def make() -> DisplayUnderTest:
        display = WindowDisplay(clock, settings)
        return DisplayUnderTest(
            display, clock, lambda: seen(server, 0, 0, WIDTH, HEIGHT), LATENCY_NS
        )

    check(make)
