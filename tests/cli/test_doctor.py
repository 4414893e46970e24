"""`navapp doctor`: one finding a line, and an exit code that says whether a session can begin."""

import json
import os
import subprocess
import sys

import pytest

from navapp.cli import software_checks
from navapp.cli.main import run
from navapp.inventory import connected_devices
from tests.inventory.inventories import NOTHING


@pytest.fixture(autouse=True)
def _quick(monkeypatch):
    """Nothing connected, and of the packages only those that load at once."""
    monkeypatch.setattr(connected_devices, "list_all_devices", lambda: NOTHING)
    kept = [one for one in software_checks._PACKAGES if one.name in ("numpy", "pyserial")]
    monkeypatch.setattr(software_checks, "_PACKAGES", tuple(kept))


def doctor(capsys, *options, config=None):
    before = [] if config is None else ["--config", str(config)]
    code = run([*before, "doctor", "--json", "-", *options])
    return code, json.loads(capsys.readouterr().out)


def test_a_simulated_session_is_well(capsys):
    code, content = doctor(capsys)
    assert (code, content["well"], content["command"]) == (0, True, "doctor")
    for finding in content["findings"]:
        assert set(finding) == {"name", "status", "detail", "remedy"}
        assert finding["status"] in ("ok", "warning", "failed")
        assert bool(finding["remedy"]) == (finding["status"] != "ok")
    assert {one["name"] for one in content["findings"]} >= {
        "python", "numpy", "pyserial", "kernel cache", "terminal", "configuration",
        "window libraries", "display server", "camera", "display", "projector", "mirror",
    }  # fmt: skip


def test_the_configuration_that_is_named_is_the_one_that_is_looked_at(tmp_path, capsys):
    config = tmp_path / "rig.toml"
    config.write_text('[mirror]\nbackend = "zaber"\nport = "/dev/serial/by-id/none"\n')
    code, content = doctor(capsys, config=config)
    failed = [one for one in content["findings"] if one["status"] == "failed"]
    assert (code, content["well"]) == (4, False)
    assert [(one["name"], one["detail"]) for one in failed] == [
        ("mirror", "there is no port /dev/serial/by-id/none")
    ]


def test_a_configuration_that_is_not_valid_is_a_finding(tmp_path, capsys):
    config = tmp_path / "rig.toml"
    config.write_text("[camera]\nbackend = 7\n")
    code, content = doctor(capsys, config=config)
    told = {one["name"]: one for one in content["findings"]}
    assert (code, told["configuration"]["status"]) == (4, "failed")
    assert "camera.backend" in told["configuration"]["detail"]
    assert told["camera"]["status"] == "ok"  # the rest is looked at all the same


def test_people_see_the_remedy_below_what_is_not_right(tmp_path, capsys):
    config = tmp_path / "rig.toml"
    config.write_text('[display]\nbackend = "window"\nsize_px = [8, 6]\n')
    assert run(["--config", str(config), "doctor"]) == 4
    lines = capsys.readouterr().out.splitlines()
    (number,) = [n for n, line in enumerate(lines) if line.startswith("failed   display server")]
    assert lines[number].endswith("it cannot be looked at")
    assert lines[number + 1].strip() == "-> let me look"


@pytest.mark.parametrize(
    ("table", "status"),
    [("", "warning"), ('[mirror]\nbackend = "zaber"\nport = "socket://x:1"\n', "failed")],
)
def test_a_package_is_needed_by_those_who_configured_it(
    tmp_path, monkeypatch, capsys, table, status
):
    (tmp_path / "serial.py").write_text("raise ImportError('libserial is missing')")
    paths = [str(tmp_path), os.environ.get("PYTHONPATH", "")]
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, paths)))
    config = tmp_path / "rig.toml"
    config.write_text(table)
    _, content = doctor(capsys, config=config)
    told = {one["name"]: one for one in content["findings"]}["pyserial"]
    assert told["status"] == status
    assert told["detail"].endswith("ImportError: libserial is missing")


@pytest.mark.release
@pytest.mark.slow
@pytest.mark.parametrize("broken", ["pydantic", "numba"])
def test_a_broken_package_that_all_need_is_told_and_nothing_breaks(tmp_path, broken):
    (tmp_path / f"{broken}.py").write_text("raise ImportError('libbroken.so is missing')")
    paths = [str(tmp_path), *filter(None, sys.path)]
    done = subprocess.run(
        [sys.executable, "-m", "navapp", "doctor", "--json", "-"],
        env=os.environ | {"PYTHONPATH": os.pathsep.join(paths)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 4, done.stderr
    told = {one["name"]: one for one in json.loads(done.stdout)["findings"]}[broken]
    assert told["status"] == "failed"
    assert told["detail"].endswith("ImportError: libbroken.so is missing")
