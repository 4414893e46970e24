"""`navapp run --mirror`: a simulated display, configured and read as a calibrated one."""

from contextlib import ExitStack
from datetime import date
from pathlib import Path

import numpy as np
import pytest

from navapp.cli.live_session import _read_display
from navapp.cli.main import _parser, run
from navapp.cli.practice_mirror import add_practice_mirror
from navapp.config import load, parse
from navapp.devices import make_practice_display
from navapp.errors import UsageError
from navapp.geometry.display_model_files import read_display_model
from tests.bench.mirror_docs import practice


def test_its_display_goes_through_the_file_of_a_calibration() -> None:
    options = _parser().parse_args(["run", "--mirror"])
    with ExitStack() as undo:
        configuration = add_practice_mirror(parse({}, "test"), undo)
        path = Path(configuration.display.model or "")
        display = _read_display(configuration, options)
        assert display is not None
        assert display.eyes == "left"
        assert display.model.display_name == "sim:display"
        quality = read_display_model(path).quality
        assert quality is not None
        assert quality.is_accepted
        assert quality.error_mm == pytest.approx(0.27, abs=0.1)
        assert not quality.has_expired(date.today())
    assert not path.exists()


@pytest.mark.parametrize(
    "content",
    [
        {"display": {"backend": "window", "size_px": [1920, 1080]}},
        {"display": {"model": "display.yml"}},
        {"mirror": {"backend": "zaber", "port": "/dev/ttyUSB0"}},
        {"projector": {"backend": "pjlink", "host": "10.0.0.2"}},
    ],
)
def test_it_is_refused_beside_what_is_real_or_calibrated(content: dict) -> None:
    with ExitStack() as undo, pytest.raises(UsageError, match="--mirror"):
        add_practice_mirror(parse(content, "test"), undo)


def test_the_eye_sees_the_site_and_the_display_of_the_session() -> None:
    """The status line is lit although nothing is registered."""
    with practice({"scale": 0.2}) as (opened, controller):
        assert opened.look is not None
        snapshot = controller.step()
        assert snapshot.has_mirror
        assert snapshot.has_eye
        seen, alone = opened.look()
        assert seen.shape == alone.shape == (300, 480, 3)
        brighter = seen.astype(int) - alone
        assert brighter.min() >= 0
        rows = np.flatnonzero((brighter > 60).any(axis=(1, 2)))
        assert rows.min() > 0.9 * len(seen)


def test_the_picture_s_middle_is_at_the_bone() -> None:
    model = make_practice_display(date.today())
    assert 450.0 < model.distance_mm() < 550.0
    assert model.flips_columns
    assert not model.flips_rows


@pytest.mark.release
def test_a_recorded_session_holds_the_display_that_its_configuration_names(tmp_path: Path) -> None:
    folder = tmp_path / "kept"
    run(["--quiet", "run", "--mirror", "--headless", "--frames", "2", "--record", str(folder)])
    configured = load(folder / "configuration.toml").display.model
    assert configured == str(folder / "display.yml")
    assert read_display_model(configured).display_name == "sim:display"
