"""`navapp calibrate latency` on the simulated display and cameras."""

import io
import json
import sys
import tomllib

import pytest

from navapp.cli.main import run
from navapp.config import parse

SMALL = "[camera.simulated]\nscale = 0.1\n"
HALF_REFRESH_MS = 500.0 / 59.94


@pytest.fixture
def measure(tmp_path):
    """Runs it with that configuration; exit code and the file of its result."""

    def measured(toml: str, *more: str):
        path, out = tmp_path / "navapp.toml", tmp_path / "latency.json"
        path.write_text(toml)
        arguments = ["calibrate", "latency", "--json", str(out), *more]
        return run(["--config", str(path), *arguments]), out

    return measured


def test_what_the_configuration_simulates_is_found(measure, capsys) -> None:
    toml = SMALL + "unstamped_skew_ms = 7.5\nskew_ms = 2.0\n[display.simulated]\ndelay_ms = 63.0\n"
    code, out = measure(toml)
    assert code == 0
    told = json.loads(out.read_text(encoding="utf-8"))
    assert told["command"] == "calibrate latency"
    assert told["display_delay_ms"]["value"] == pytest.approx(63.0 + HALF_REFRESH_MS, abs=3.0)
    assert told["capture_offset_ms"]["value"] == pytest.approx(9.5, abs=3.0)
    assert told["capture_offset_ms"]["stamped"] == pytest.approx(2.0)
    assert told["display_delay_ms"]["bound"] < 3.0
    assert (told["display"], told["camera"]) == ("sim:display", "sim:stereo camera")
    said = capsys.readouterr()
    assert "ms too early" in said.err
    # What it offers for the configuration is one.
    offered = tomllib.loads(said.out[said.out.index("[display]") :])
    delay_ms = parse(offered, "x").display.delay_ms
    assert delay_ms == pytest.approx(told["display_delay_ms"]["value"], abs=0.051)


def test_stamps_that_are_right_are_not_warned_of(measure, capsys) -> None:
    code, _ = measure(SMALL + "skew_ms = 4.0\n", "--seconds", "20")
    assert code == 0
    said = capsys.readouterr()
    assert "warning" not in said.err
    assert "+4.0 ms" in said.out


@pytest.mark.parametrize(
    ("toml", "code", "words"),
    [
        ('faults = [{kind = "blackout_left", start_s = 0.0, duration_s = inf}]', 4, "left camera"),
        ('faults = [{kind = "unplug", start_s = 4.0, duration_s = inf}]', 5, "unplugged"),
        # The right eye's exposures lie between two refreshes, always the same ones.
        (
            "unstamped_skew_ms = 8.0\n[display.simulated]\nrefresh_hz = 60.0",
            4,
            "right camera is in step with the display",
        ),
        ("[camera]\nrate_hz = 4.0", 4, "200 are needed"),
        ('[display]\nbackend = "window"\nsize_px = [640, 480]', 2, "cannot see a display"),
    ],
)
def test_what_fails_is_one_sentence_and_writes_nothing(measure, capsys, toml, code, words) -> None:
    found, out = measure(toml + "\n" + SMALL if toml.startswith("[camera]") else SMALL + toml)
    assert found == code
    said = capsys.readouterr()
    assert words in said.err
    assert said.err.count("\n") == 1
    assert not said.out
    assert not out.exists()


@pytest.mark.parametrize(
    "wrong", [("--seconds", "0"), ("--seconds", "nan"), ("--refresh-hz", "-1")]
)
def test_wrong_arguments_are_refused(measure, capsys, wrong) -> None:
    code, out = measure(SMALL, *wrong)
    assert code == 2
    assert wrong[0] in capsys.readouterr().err
    assert not out.exists()


class InterruptedTerminal(io.StringIO):
    """Somebody presses Ctrl-C while half of the bar is drawn."""

    def isatty(self) -> bool:
        return True

    def write(self, text: str) -> int:
        if " 50 %" in text:
            raise KeyboardInterrupt
        return super().write(text)


def test_an_interrupt_is_130_and_writes_nothing(measure, monkeypatch) -> None:
    terminal = InterruptedTerminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    code, out = measure(SMALL)
    assert code == 130
    assert terminal.getvalue().endswith("navapp: error: interrupted\n")
    assert not out.exists()
