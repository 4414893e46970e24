"""`navapp run` with projector and mirror on simulated firmware, from the configuration on."""

import json
from pathlib import Path

import pytest

from navapp.cli.main import run
from tests.drivers.firmware_rigs import SERIAL, STAGE_SERIAL, projector_terminal, stage_terminal

DEVICES = """
[projector]
backend = "escvp21"
port = "{folder}/projector"
serial = "{projector}"
[mirror]
backend = "zaber"
port = "{folder}/stage"
serial = "{stage}"
calibrated_deg = 30.0
"""


def configured(folder: Path, stage: str = STAGE_SERIAL) -> list[str]:
    path = folder / "devices.toml"
    path.write_text(DEVICES.format(folder=folder, projector=SERIAL, stage=stage), encoding="utf-8")
    return ["--quiet", "--config", str(path)]


@pytest.mark.slow
def test_a_session_turns_the_mirror_to_its_place_and_replays_without_it(tmp_path: Path) -> None:
    session, first, second = tmp_path / "session", tmp_path / "a.json", tmp_path / "b.json"
    recording = ["run", "--headless", "--frames", "7", "--record", str(session)]
    with projector_terminal(tmp_path), stage_terminal(tmp_path) as stage:
        assert run([*configured(tmp_path), *recording, "--json", str(first)]) == 0
        assert stage.wire.firmware.true_deg == pytest.approx(30.0, abs=0.01)
    assert run(["--quiet", "replay", str(session), "--json", str(second)]) == 0
    frames = [json.loads(path.read_text(encoding="utf-8"))["frames"] for path in (first, second)]
    for a, b in zip(*frames, strict=True):
        assert a["camera_from_model"] == b["camera_from_model"]
    events = (session / "events.jsonl").read_text(encoding="utf-8")
    assert "no longer: the mirror does not stand" in events


def test_another_mount_is_refused_in_one_sentence(tmp_path: Path, capsys) -> None:
    with projector_terminal(tmp_path), stage_terminal(tmp_path):
        assert run([*configured(tmp_path, "1"), "run", "--headless", "--frames", "1"]) == 5
    assert "serial number 990123, the rig's is 1" in capsys.readouterr().err


def test_a_device_that_is_not_plugged_in_is_said_in_one_sentence(tmp_path: Path, capsys) -> None:
    assert run([*configured(tmp_path), "run", "--headless", "--frames", "1"]) == 5
    assert "connect the device, or check the port" in capsys.readouterr().err
