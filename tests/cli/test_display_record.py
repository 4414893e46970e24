"""What a display's file says of the display and its projector."""

import numpy as np
import pytest

from drivers.clock import ManualClock
from drivers.interfaces import PowerState, ProjectorStatus
from navapp.cli.display_record import read_record
from navapp.config import parse
from navapp.devices import peripherals, read_display_name, read_projector
from navapp.devices.peripherals import make_window_display
from navapp.errors import DeviceError
from sim_devices.mirror_setups import draw_setup
from tests.calibration.mirror.simulated_operators import SimulatedOperator
from tests.calibration.mirror.test_alignments import EVERY_THIRD, aligned, solve_alignments
from tests.x_servers import xvfb

WINDOW = {"backend": "window", "size_px": [320, 200]}
PJLINK = {"display": {}, "projector": {"backend": "pjlink", "host": "127.0.0.1"}}


class Projector:
    """Answers with one status."""

    def __init__(self, status: ProjectorStatus | DeviceError) -> None:
        self.told, self.n_closed = status, 0

    def open(self) -> None:
        pass

    def status(self) -> ProjectorStatus:
        if isinstance(self.told, DeviceError):
            raise self.told
        return self.told

    def close(self) -> None:
        self.n_closed += 1


def with_projector(monkeypatch, **told) -> Projector:
    projector = Projector(ProjectorStatus(PowerState.ON, **told))
    monkeypatch.setattr(peripherals, "_projector", lambda settings: projector)
    return projector


def test_a_simulated_display_without_projector_has_its_name_alone():
    record = read_record(parse({}, "x"))
    assert record.name == "sim:display"
    assert (record.projector_flips, record.keystone) == (None, None)


def test_flips_and_keystone_are_read_back_from_the_projector(monkeypatch):
    flips = {"flips_horizontally": False, "flips_vertically": True}
    projector = with_projector(monkeypatch, **flips, keystone=(0, 0))
    record = read_record(parse(PJLINK, "x"))
    assert (record.projector_flips, record.keystone) == ((False, True), (0, 0))
    assert projector.n_closed == 1


def test_a_projector_that_cannot_say_leaves_them_out(monkeypatch):
    with_projector(monkeypatch)
    record = read_record(parse(PJLINK, "x"))
    assert (record.projector_flips, record.keystone) == (None, None)


def test_a_projector_that_bends_the_picture_is_refused(monkeypatch):
    with_projector(monkeypatch, keystone=(0, -3))
    with pytest.raises(DeviceError, match=r"keystone 0, -3.*set its keystone to 0"):
        read_record(parse(PJLINK, "x"))


def test_a_projector_that_is_off_is_refused(monkeypatch):
    with_projector(monkeypatch).told = ProjectorStatus(PowerState.STANDBY)
    with pytest.raises(DeviceError, match=r"not on \(standby\).*switch it on"):
        read_record(parse(PJLINK, "x"))


def test_a_projector_that_does_not_answer_is_told_and_closed(monkeypatch):
    projector = with_projector(monkeypatch)
    projector.told = DeviceError("no answer")
    with pytest.raises(DeviceError, match="no answer"):
        read_projector(parse(PJLINK, "x").projector)
    assert projector.n_closed == 1


def test_the_model_gets_the_record(monkeypatch):
    with_projector(monkeypatch, flips_horizontally=True, flips_vertically=False, keystone=(0, 0))
    rng = np.random.default_rng(3)
    operator = SimulatedOperator(draw_setup(rng), rng, 0.5)
    found = solve_alignments(operator.display, aligned(operator, EVERY_THIRD), operator.anatomy_mm)
    model = read_record(parse(PJLINK, "x")).add_to(found.model)
    assert (model.display_name, model.projector_flips) == ("sim:display", (True, False))
    assert model.keystone == (0, 0)
    assert model.quality is not None
    assert model.quality.expires_on is not None


def test_a_named_output_needs_no_window():
    settings = parse({"display": {**WINDOW, "output": "DP-1"}}, "x").display
    assert read_display_name(settings) == "DP-1"


def test_a_window_without_output_is_known_by_the_name_of_the_only_one(monkeypatch):
    with xvfb(320, 200) as server:
        monkeypatch.setenv("DISPLAY", server)
        settings = parse({"display": WINDOW}, "x").display
        name = read_display_name(settings)
        assert name not in ("", "window")
        display = make_window_display(settings, ManualClock())
        assert display is not None
        assert display.info.name == "window"
        display.open()
        assert display.info.name == name
        display.close()
        assert display.info.name == name
