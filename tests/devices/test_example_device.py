"""The package in docs/example_device, installed beside navapp: found, tested, opened."""

import os
import re
import shutil
import subprocess
import sys
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from drivers.contracts import CAMERA_CHECKS
from navapp.config import parse
from navapp.devices import open_live
from navapp.errors import WrongDevice
from navapp.geometry import write_rig
from navapp.inventory.camera_packages import list_installed
from navapp.inventory.connected_devices import make_choice_toml
from tests.devices.package_cameras import install
from tests.sim_devices.plain_world import plain_rig

SOURCE = Path(__file__).resolve().parents[2] / "docs" / "example_device"


@pytest.fixture
def site(tmp_path, monkeypatch):
    """Its modules and entry points as an installer takes them from its pyproject.toml."""
    told = tomllib.loads((SOURCE / "pyproject.toml").read_text(encoding="utf-8"))
    files = [f"{module}.py" for module in told["tool"]["setuptools"]["py-modules"]]
    modules = {file: (SOURCE / file).read_text(encoding="utf-8") for file in files}
    entries = told["project"]["entry-points"]["navapp.devices"]
    site = tmp_path / "site"
    install(site, told["project"]["name"], entries, modules)
    monkeypatch.syspath_prepend(str(site))
    paths = [str(site), *filter(None, sys.path)]
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(paths))
    return site


def test_its_own_tests_run_the_whole_contract(site, tmp_path):
    shutil.copy(SOURCE / "test_example_camera.py", tmp_path)
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider"]
    done = subprocess.run(
        [*command, "test_example_camera.py"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-4000:]
    passed = re.search(r"(\d+) passed", done.stdout)
    assert passed is not None
    assert int(passed[1]) >= len(CAMERA_CHECKS) + 2


@pytest.mark.release
def test_the_contract_runs_on_the_camera_of_a_configuration(site, tmp_path):
    """As it does on hardware: `pytest --hardware=FILE tests/contracts`."""
    path = tmp_path / "connected.toml"
    path.write_text('[camera]\nbackend = "example"\n', encoding="utf-8")
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider"]
    done = subprocess.run(
        [*command, f"--hardware={path}", "tests/contracts/test_camera_on_hardware.py"],
        cwd=SOURCE.parents[1],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-4000:]
    assert f"{len(CAMERA_CHECKS)} passed" in done.stdout
    assert "skipped: 0 tests" in done.stdout


@pytest.fixture
def configuration(site, tmp_path):
    """What `navapp devices` says to write, a rig and a setting of its own."""
    listing = list_installed()
    assert listing.unseen == ()
    (camera,) = listing.found
    assert camera.package == "navapp-example-camera 1.0"
    content = tomllib.loads(make_choice_toml(camera))
    content["camera"] |= {"rig": str(tmp_path / "rig.yml"), "example": {"rate_hz": 50.0}}
    return parse(content, "x")


def test_it_is_listed_and_what_is_listed_opens_it(tmp_path, configuration):
    write_rig(tmp_path / "rig.yml", replace(plain_rig(64, 48), serials=("EX-L", "EX-R")))
    opened = open_live(configuration, is_headless=True)
    try:
        first, second = (opened.devices.camera.read(1.0) for _ in range(2))
    finally:
        opened.devices.close()
    gap_ns = second.captured_ns - first.captured_ns
    assert gap_ns > 0
    assert gap_ns % 20_000_000 == 0
    assert np.array_equal(first.left[:, 5:], first.right[:, :-5])


def test_another_cameras_rig_is_refused(tmp_path, configuration):
    write_rig(tmp_path / "rig.yml", plain_rig(64, 48))
    with pytest.raises(WrongDevice, match="the rig was calibrated with L1 and R1"):
        open_live(configuration, is_headless=True)
