"""`navapp doctor`: what is there, what is missing, and what to do about it."""

import argparse
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from navapp.cli.diagnostics import Diagnostics, check_writable, write_json


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing looked at.

    Attributes:
        name: of it.
        is_fine: it is as it must be.
        is_needed: the simulated session cannot do without it.
        detail: what was seen.
        remedy: what to do when it is not fine.
    """

    name: str
    is_fine: bool
    is_needed: bool
    detail: str
    remedy: str = ""


def add_parser(subparsers: Any) -> None:
    """Declare the verb."""
    parser = subparsers.add_parser(
        "doctor",
        help="what is there, what is missing, and what to do about it",
        epilog="example: navapp doctor",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--json", metavar="FILE", help="result for programs (- is stdout)")


def run(options: argparse.Namespace, diagnostics: Diagnostics) -> int:
    """Do it."""
    check_writable(options.json)
    findings = [check() for check in _CHECKS]
    is_well = all(finding.is_fine for finding in findings if finding.is_needed)
    content = {"well": is_well, "findings": [asdict(finding) for finding in findings]}
    write_json(options.json, "doctor", content)
    if options.json != "-":
        for finding in findings:
            word = "ok  " if finding.is_fine else ("MISS" if finding.is_needed else "none")
            remedy = f" -> {finding.remedy}" if finding.remedy and not finding.is_fine else ""
            diagnostics.say(f"{word}  {finding.name}: {finding.detail}{remedy}")
    return 0 if is_well else 4


def _python() -> Finding:
    version = ".".join(str(part) for part in sys.version_info[:3])
    return Finding(
        "python", sys.version_info >= (3, 11), True, version, "install Python 3.11 or newer"
    )


def _package(name: str, module: str, is_needed: bool, use: str) -> Callable[[], Finding]:
    """Whether a package imports, tried in a process of its own: a broken one may crash."""

    def check() -> Finding:
        from importlib.metadata import PackageNotFoundError, version

        try:
            installed = version(name)
        except PackageNotFoundError:
            return Finding(name, False, is_needed, f"not installed ({use})", "run `make setup`")
        done = subprocess.run(
            [sys.executable, "-c", f"import navapp, {module}"],
            capture_output=True,
            text=True,
            timeout=120,
            check=False,
        )
        if done.returncode == 0:
            return Finding(name, True, is_needed, f"{installed} ({use})")
        last = (done.stderr.strip().splitlines() or ["it crashed"])[-1]
        return Finding(name, False, is_needed, f"{installed} {last}", "run `make system-deps`")

    return check


def _kernel_cache() -> Finding:
    folder = Path(os.environ["NUMBA_CACHE_DIR"])
    try:
        folder.mkdir(parents=True, exist_ok=True)
        is_writable = os.access(folder, os.W_OK)
    except OSError:
        is_writable = False
    n_files = len(list(folder.rglob("*.nbc"))) if is_writable else 0
    detail = f"{folder}, {n_files} compiled kernels" if is_writable else f"{folder} not writable"
    return Finding("kernel cache", is_writable, True, detail, "set NUMBA_CACHE_DIR")


def _terminal() -> Finding:
    encoding = (sys.stdout.encoding or "").lower()
    is_unicode = "utf" in encoding
    return Finding(
        "terminal",
        is_unicode,
        False,
        f"{os.environ.get('TERM', 'none')}, {encoding or 'no encoding'}",
        "set a UTF-8 locale (LANG=C.UTF-8) for the full picture",
    )


def _configuration() -> Finding:
    from navapp.config import find_file, load
    from navapp.errors import ConfigurationError

    try:
        path = find_file(None)
        load(path)
    except ConfigurationError as error:
        return Finding("configuration", False, True, error.problem, error.remedy)
    return Finding("configuration", True, True, str(path) if path else "defaults (no file)")


_CHECKS: tuple[Callable[[], Finding], ...] = (
    _python,
    _package("numpy", "numpy", True, "arrays"),
    _package("scipy", "scipy.spatial", True, "look-ups"),
    _package("numba", "numba", True, "compiled kernels"),
    _package("opencv-python-headless", "cv2", True, "pictures and stereo"),
    _package("pydantic", "pydantic", True, "configuration"),
    _package("textual", "textual.app", True, "operator's screen"),
    _package("open3d-cpu", "open3d", False, "referee in tests; needs system libraries"),
    _package("depthai", "depthai", False, "OAK cameras"),
    _package("pyserial", "serial", False, "projector and mirror lines"),
    _package("pygame-ce", "pygame", False, "window on a monitor or projector"),
    _kernel_cache,
    _terminal,
    _configuration,
)
