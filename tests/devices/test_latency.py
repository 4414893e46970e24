"""A camera and a display for their delays: what is opened together, and closed again."""

import pytest

from navapp.config import parse
from navapp.devices import open_latency
from navapp.errors import ConfigurationError, DeviceLost, DeviceNotFound
from tests.devices.package_cameras import Entry, announce

SMALL = {"simulated": {"scale": 0.1}}


def test_simulated_ones_are_opened_and_closed() -> None:
    opened = open_latency(parse({"camera": SMALL}, "x"))
    assert opened.camera.read(1.0).left.shape == (72, 128, 3)
    opened.close()
    with pytest.raises(DeviceLost):
        opened.camera.read(0.1)


@pytest.mark.parametrize(
    "content",
    [
        {"camera": {"backend": "acme"}},
        {"display": {"backend": "window", "size_px": [640, 480]}},
    ],
)
def test_a_real_device_beside_a_simulated_one_is_refused(content) -> None:
    with pytest.raises(ConfigurationError, match="cannot see a display"):
        open_latency(parse(content, "x"))


def test_a_window_that_cannot_be_opened_leaves_no_camera_open(monkeypatch) -> None:
    entry = Entry()
    announce(monkeypatch, [entry])
    monkeypatch.delenv("DISPLAY", raising=False)
    display = {"backend": "window", "size_px": [640, 480]}
    with pytest.raises(DeviceNotFound):
        open_latency(parse({"camera": {"backend": "acme"}, "display": display}, "x"))
    with pytest.raises(DeviceLost):
        entry.camera.read(0.0)
