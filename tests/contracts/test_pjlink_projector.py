"""The PJLink driver keeps the contract of every projector, over a socket to simulated firmware."""

from collections.abc import Iterator
from functools import partial

import pytest

from drivers.clock import ManualClock
from drivers.contracts import PROJECTOR_CHECKS, ProjectorUnderTest
from drivers.pjlink_line import TcpConnection
from drivers.pjlink_projector import PjlinkProjector
from sim_devices.firmware import pjlink
from sim_devices.firmware.pjlink_server import PjlinkServer, Trouble

TROUBLES = {"whole": Trouble(), "split": Trouble(is_split=True)}


@pytest.fixture(params=TROUBLES)
def server(request) -> Iterator[PjlinkServer]:
    firmware = pjlink.PjlinkProjector(ManualClock(), password="secret")
    serving = PjlinkServer(firmware, TROUBLES[request.param])
    serving.start()
    yield serving
    serving.close()


@pytest.mark.parametrize("check", PROJECTOR_CHECKS, ids=lambda check: check.__name__)
def test_pjlink_projector_keeps_its_contract(check, server) -> None:
    # Both ends share a clock that waiting moves: a lamp that warms for 40 s takes no time.
    connect = partial(TcpConnection, "127.0.0.1", server.port)
    clock = server.projector.clock

    def make() -> ProjectorUnderTest:
        projector = PjlinkProjector("127.0.0.1", clock, connect, "secret")
        return ProjectorUnderTest(projector, source="32")

    check(make)
