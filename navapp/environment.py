"""Environment variables that must be set before a heavy package is imported.

Values that the user has set are respected. Nothing of navapp is imported here.
"""

import hashlib
import os
import sys
from pathlib import Path

_DEFAULTS = {
    # DepthAI: no telemetry, no crash upload, no network search, no start-up noise on stdout.
    "DEPTHAI_TELEMETRY": "0",
    "DEPTHAI_DISABLE_FEEDBACK": "1",
    "DEPTHAI_DISABLE_STARTUP_NOTIFICATIONS": "1",
    "DEPTHAI_DISABLE_CRASHDUMP_COLLECTION": "1",
    "DEPTHAI_CRASHDUMP": "0",
    "DEPTHAI_ZOO_INTERNET_CHECK": "0",
    "DEPTHAI_LEVEL": "off",
    "DEPTHAI_INSTALL_SIGNAL_HANDLER": "0",
    "DEPTHAI_PROTOCOL": "usb",
    "DEPTHAI_SEARCH_TIMEOUT": "1500",
    # OpenCV writes to file descriptor 2, into the operator's picture; a stalled camera blocks 10 s.
    "OPENCV_LOG_LEVEL": "OFF",
    "OPENCV_VIDEOIO_V4L_SELECT_TIMEOUT": "1",
    # Two cores are shared by camera, line, display and screen: one thread for each library.
    "OPENBLAS_NUM_THREADS": "1",
    "OMP_NUM_THREADS": "1",
    # SDL takes SIGTERM away from Python, and prints a banner.
    "PYGAME_HIDE_SUPPORT_PROMPT": "1",
    "SDL_NO_SIGNAL_HANDLERS": "1",
}

_PACKAGES = ("navapp", "sim_devices", "calibration", "drivers")
_prepared = False


def prepare() -> None:
    """Set every variable that is not set yet; cheap when called again."""
    global _prepared
    if _prepared:
        return
    _prepared = True
    for name, value in _DEFAULTS.items():
        os.environ.setdefault(name, value)
    if "NUMBA_CACHE_DIR" not in os.environ:
        os.environ["NUMBA_CACHE_DIR"] = str(_user_cache() / "navapp" / f"numba-{kernel_hash()}")


def kernel_hash() -> str:
    """Hash of every kernel source.

    numba's cache notices an edit in the file of a kernel, but not in a kernel called from another
    file; a folder named after all of them together does.
    """
    return _hash_files("*kernels.py", sys.version)


def source_hash() -> str:
    """Hash of every module: results with the same one are of the same code."""
    return _hash_files("*.py", "")


def _hash_files(pattern: str, start: str) -> str:
    root = Path(__file__).resolve().parent.parent
    digest = hashlib.sha256(start.encode())
    for package in _PACKAGES:
        for path in sorted((root / package).rglob(pattern)):
            digest.update(path.name.encode())
            digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


def _user_cache() -> Path:
    configured = os.environ.get("XDG_CACHE_HOME")
    candidates = [Path(configured)] if configured else []
    home = os.path.expanduser("~")
    if home != "~":
        candidates.append(Path(home) / ".cache")
    for candidate in candidates:
        try:
            candidate.mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if os.access(candidate, os.W_OK):
            return candidate
    return Path(os.environ.get("TMPDIR", "/tmp")) / f"navapp-cache-{os.getuid()}"
