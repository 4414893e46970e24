"""Checks of `navapp doctor`: Python, packages, the kernels' cache and the terminal."""

import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from drivers.child_python import find_last_words, run_python
from navapp.inventory.finding import Finding, Health, judge_health

if TYPE_CHECKING:
    from navapp.config import Configuration

_IMPORTING_S = 120.0


@dataclass(frozen=True, slots=True)
class _Package:
    """A package, what is imported of it, what for, and which configurations need it."""

    name: str
    module: str
    use: str
    needs_it: "Callable[[Configuration], bool] | None" = None


def _has_a_line(configuration: "Configuration") -> bool:
    return configuration.projector.backend == "escvp21" or configuration.mirror.backend == "zaber"


_PACKAGES = (
    _Package("numpy", "numpy", "arrays"),
    _Package("scipy", "scipy.spatial", "look-ups"),
    _Package("numba", "numba", "compiled kernels"),
    _Package("opencv-python-headless", "cv2", "pictures and stereo"),
    _Package("pydantic", "pydantic", "configuration"),
    _Package("textual", "textual.app", "operator's screen"),
    _Package("open3d-cpu", "open3d", "surfaces of a CT, a file's cartilage", lambda c: False),
    _Package("simpleitk", "SimpleITK", "reading a CT", lambda c: False),
    _Package("pydicom", "pydicom", "reading a CT from DICOM", lambda c: False),
    _Package("depthai", "depthai", "OAK cameras", lambda c: c.camera.backend == "depthai"),
    _Package("pyserial", "serial", "projector and mirror lines", _has_a_line),
    _Package("pygame-ce", "pygame", "window", lambda c: c.display.backend != "simulated"),
)


def check_software(configuration: "Configuration | None") -> list[Finding]:
    """All of it; packages that only other configurations need give warnings."""
    packages = [_package(one, _is_needed(one, configuration)) for one in _PACKAGES]
    return [_python(), *packages, _kernel_cache(), _terminal()]


def _is_needed(package: _Package, configuration: "Configuration | None") -> bool:
    if package.needs_it is None:
        return True
    return configuration is not None and package.needs_it(configuration)


def _python() -> Finding:
    version = ".".join(str(part) for part in sys.version_info[:3])
    is_new = sys.version_info >= (3, 11)
    return Finding("python", judge_health(is_new, True), version, "install Python 3.11 or newer")


def _package(package: _Package, is_needed: bool) -> Finding:
    """Whether a package imports, tried in a process of its own: a broken one may crash."""
    from importlib.metadata import PackageNotFoundError, version

    health = judge_health(False, is_needed)
    try:
        installed = version(package.name)
    except PackageNotFoundError:
        detail = f"not installed ({package.use})"
        return Finding(package.name, health, detail, "run `make setup`")
    try:
        done = run_python("-c", f"import navapp, {package.module}", timeout_s=_IMPORTING_S)
    except subprocess.TimeoutExpired:
        detail = f"{installed} does not load within {_IMPORTING_S:.0f} s"
        return Finding(package.name, health, detail, "run `make setup`")
    if done.returncode == 0:
        return Finding(package.name, Health.OK, f"{installed} ({package.use})")
    detail = f"{installed} {find_last_words(done)}"
    return Finding(package.name, health, detail, "run `make system-deps`")


def _kernel_cache() -> Finding:
    folder = Path(os.environ["NUMBA_CACHE_DIR"])
    try:
        folder.mkdir(parents=True, exist_ok=True)
        is_writable = os.access(folder, os.W_OK)
    except OSError:
        is_writable = False
    n_files = len(list(folder.rglob("*.nbc"))) if is_writable else 0
    detail = f"{folder}, {n_files} compiled kernels" if is_writable else f"{folder} not writable"
    return Finding("kernel cache", judge_health(is_writable, True), detail, "set NUMBA_CACHE_DIR")


def _terminal() -> Finding:
    encoding = (sys.stdout.encoding or "").lower()
    detail = f"{os.environ.get('TERM', 'none')}, {encoding or 'no encoding'}"
    remedy = "set a UTF-8 locale (LANG=C.UTF-8) for the full picture"
    return Finding("terminal", judge_health("utf" in encoding, False), detail, remedy)
