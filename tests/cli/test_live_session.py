"""A session as the configuration describes it."""

from contextlib import ExitStack

import pytest

from navapp.cli.diagnostics import Diagnostics
from navapp.cli.live_session import make_controller, prepare_session
from navapp.cli.main import _parser
from navapp.config import parse


@pytest.mark.parametrize(("delay_ms", "withdrawn_ms"), [(0.0, 400.0), (90.0, 310.0)])
def test_pictures_are_withdrawn_as_much_earlier_as_they_are_seen_late(
    delay_ms: float, withdrawn_ms: float
) -> None:
    content = {
        "camera": {"simulated": {"scale": 0.2}},
        "display": {"valid_ms": 400.0, "delay_ms": delay_ms},
    }
    options = _parser().parse_args(["run", "--headless"])
    with ExitStack() as undo:
        session = prepare_session(parse(content, "test"), options, Diagnostics(is_quiet=True))
        devices = session.opened.devices
        undo.callback(devices.close)
        controller = make_controller(session, is_inline=True, on_frame=[], undo=undo)
        undo.callback(controller.close)
        shown_until_ns = []
        devices.display.show = lambda _, until_ns: shown_until_ns.append(until_ns)
        controller.step()
        # The clock of a stepped camera stands at the capture of its frame.
        assert shown_until_ns == [devices.clock.now_ns() + withdrawn_ms * 1e6]
