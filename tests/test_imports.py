"""Import rules, proven at run time and by import-linter; each contract is seen to fail."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.many import few_rows_of

ROOT = Path(__file__).resolve().parent.parent
HEAVY = (
    "open3d", "depthai", "textual", "SimpleITK", "pydicom", "pygame", "numba", "scipy", "cv2",
    "serial",
)  # fmt: skip


def modules_after(statement: str) -> set[str]:
    code = f"{statement}; import sys; sys.stdout.write(' '.join(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(done.stdout.split())


def test_the_command_line_starts_without_any_heavy_package() -> None:
    loaded = modules_after("import navapp.cli.main as m; m._parser()")
    assert not loaded & set(HEAVY)


def test_the_whole_line_runs_without_hardware_packages_and_open3d() -> None:
    loaded = modules_after("import navapp.control.controller, navapp.devices, navapp.cli.run")
    hardware = {"depthai", "serial", "pygame"}
    assert not loaded & (hardware | {"open3d", "textual", "SimpleITK", "pydicom"})


def test_a_ct_reader_that_is_not_used_loads_nothing() -> None:
    assert not modules_after("import navapp.preop.volume") & {"SimpleITK", "pydicom"}


def test_what_is_missing_is_told_without_what_may_be_missing() -> None:
    rooms = "navapp.inventory.configured_checks, navapp.inventory.system_checks"
    assert not modules_after(f"import {rooms}") & {*HEAVY, "numpy"}
    assert not modules_after(f"import navapp.cli.doctor, {rooms}") & set(HEAVY)


def test_the_simulator_loads_nothing_that_it_is_used_to_test() -> None:
    loaded = modules_after("import sim_devices.world, sim_devices.camera, sim_devices.truth")
    ours = {name for name in loaded if name.startswith("navapp.")}
    allowed = ("navapp.geometry", "navapp.errors", "navapp.environment")
    assert {name for name in ours if not name.startswith(allowed)} == set()
    assert not any("zbuffer" in name for name in ours)


def lint(folder: Path) -> subprocess.CompletedProcess[str]:
    runner = "import sys; from importlinter.cli import lint_imports_command as c; c(sys.argv[1:])"
    return subprocess.run(
        [sys.executable, "-c", runner, "--no-cache"],
        cwd=folder,
        env={"PYTHONPATH": str(folder), "PATH": ""},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.fixture(scope="module")
def checkout(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the packages that can be spoiled."""
    folder = tmp_path_factory.mktemp("checkout")
    for package in ("navapp", "drivers", "sim_devices", "calibration"):
        shutil.copytree(
            ROOT / package, folder / package, ignore=shutil.ignore_patterns("__pycache__")
        )
    shutil.copy(ROOT / "pyproject.toml", folder)
    return folder


def test_the_contracts_hold(checkout: Path) -> None:
    done = lint(checkout)
    assert done.returncode == 0, done.stdout + done.stderr


# File, breach, and the contract that must break.
BREACHES = [
    ("navapp/geometry/camera.py", "import navapp.values", "the rooms of navapp"),
    ("navapp/tracking/tracker.py", "import sim_devices.truth", "the pipeline never sees"),
    ("navapp/tracking/tracker.py", "import pydicom", "only planning reads a CT"),
    ("navapp/tracking/judging.py", "import navapp.overlay", "tracking stands on"),
    ("navapp/control/trackers.py", "import sim_devices.world", "control is handed"),
    ("navapp/control/states.py", "import navapp.inventory.connected_devices", "control is handed"),
    ("navapp/control/frame_sources.py", "import drivers.replay_camera", "control knows the device"),
    ("navapp/ui/app.py", "import navapp.devices", "the screen reads snapshots"),
    ("drivers/clock.py", "import navapp.cli.main", "only the command line"),
    ("drivers/frames.py", "import navapp.values", "drivers stand on"),
    ("sim_devices/sensor.py", "import navapp.geometry.zbuffer", "the simulator uses no code"),
    (
        "sim_devices/mirror_view.py",
        "import navapp.geometry.display_model_optics",
        "the simulator uses no code",
    ),
    ("calibration/__init__.py", "import drivers.frames", "calibration works on"),
]


@pytest.mark.parametrize(("path", "breach", "contract"), few_rows_of(BREACHES))
def test_a_deliberate_breach_is_found(
    checkout: Path, path: str, breach: str, contract: str
) -> None:
    file = checkout / path
    text = file.read_text(encoding="utf-8")
    file.write_text(f"{text}\n{breach}\n", encoding="utf-8")
    try:
        done = lint(checkout)
    finally:
        file.write_text(text, encoding="utf-8")
    assert done.returncode == 1
    broken = [line for line in done.stdout.splitlines() if "BROKEN" in line]
    assert any(line.startswith(contract) for line in broken), done.stdout


def test_a_package_without_a_place_is_found(checkout: Path) -> None:
    stray = checkout / "navapp" / "stray.py"
    stray.write_text('"""Nowhere."""\n', encoding="utf-8")
    try:
        assert lint(checkout).returncode == 1
    finally:
        stray.unlink()
