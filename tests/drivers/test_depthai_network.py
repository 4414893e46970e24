"""An OAK camera is looked for on USB; nothing of ours or of DepthAI's goes to the network."""

from pathlib import Path

import pytest

from navapp import environment
from tests.drivers.preloading import compiled, python

pytestmark = pytest.mark.waits

pytest.importorskip("depthai", reason="the package depthai is not installed (navapp[oak])")

# Import, pipeline on the host, search, and the driver's own opening without a camera.
USE = """
import navapp
from drivers.clock import SystemClock
from drivers.depthai_settings import DepthaiSettings
from drivers.depthai_stereo import DepthaiStereo
from navapp.errors import DeviceNotFound
from tests.drivers.host_oak import HEIGHT, RATE_HZ, WIDTH, HostOak
settings = DepthaiSettings("", WIDTH, HEIGHT, RATE_HZ)
camera = DepthaiStereo(settings, SystemClock(), open_device=HostOak().open_parts)
camera.open(); camera.read(2.0); camera.close()
for device in ("", "14442C10D13EABCE00"):
    try:
        DepthaiStereo(DepthaiSettings(device), SystemClock()).open()
    except DeviceNotFound as error:
        print(error)
"""
SEARCH_EVERYWHERE = """
import time
import depthai
try:
    depthai.Device.getAllAvailableDevices()
except RuntimeError:
    pass
time.sleep(0.5)
"""


def asked_of_the_network(tmp_path: Path, code: str) -> tuple[list[str], str]:
    """Sockets and names that the program asked for, and its output."""
    library = compiled("sockets_made.c", tmp_path)
    log = tmp_path / "log"
    ours = tuple(name for name in environment._DEFAULTS if name.startswith("DEPTHAI"))
    done = python(library, "-c", code, removed=ours, SOCKETS_MADE=str(log))
    assert done.returncode == 0, done.stderr[-3000:]
    return (log.read_text().split() if log.exists() else []), done.stdout


def test_no_socket_is_made_and_no_name_is_looked_up(tmp_path):
    asked, output = asked_of_the_network(tmp_path, USE)
    if "no OAK camera is connected" not in output:
        pytest.skip("an OAK camera is connected")
    assert asked == []


def test_the_watch_would_see_what_depthai_does_by_itself(tmp_path):
    asked, _ = asked_of_the_network(tmp_path, SEARCH_EVERYWHERE)
    assert asked
