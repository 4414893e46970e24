"""Lists cameras of other packages: entry points `camera.NAME` of group `navapp.devices`."""

import subprocess
from collections import Counter
from dataclasses import dataclass
from importlib import metadata

from drivers.child_python import find_last_words, run_python
from drivers.discovery import Listing, Unseen

GROUP, KIND = "navapp.devices", "camera."
_OUR_OWN = ("simulated", "opencv", "depthai")
_LOAD = "import sys; from importlib.metadata import EntryPoint as E; E('', sys.argv[1], '').load()"
_LOADING_S = 60.0


@dataclass(frozen=True, slots=True)
class InstalledCamera:
    """A driver that another package brings."""

    backend: str  # what `[camera] backend` takes
    factory: str  # `module:function` that makes the camera
    package: str  # name and version of the package


def list_installed() -> Listing[InstalledCamera]:
    """Every driver that loads and can be chosen; the others are named with what is wrong.

    Each is loaded in a process of its own: a stranger may print, hang or crash.
    """
    entries = list(metadata.entry_points(group=GROUP))
    counts = Counter(entry.name for entry in entries)
    found, unseen = [], []
    for entry in sorted(entries, key=lambda entry: (entry.name, entry.value)):
        package = "?" if entry.dist is None else f"{entry.dist.name} {entry.dist.version}"
        problem, remedy = _fault(entry, counts)
        if problem:
            told = f"driver '{entry.name}' of the package {package} {problem}"
            unseen.append(Unseen(entry.name, told, remedy))
        else:
            backend = entry.name.removeprefix(KIND)
            found.append(InstalledCamera(backend, entry.value, package))
    return Listing(tuple(found), tuple(unseen))


def _fault(entry: metadata.EntryPoint, counts: Counter[str]) -> tuple[str, str]:
    """Why a driver cannot be used, and what to do; empty texts when it can."""
    renaming = "ask its makers for another name"
    if not entry.name.startswith(KIND):
        return "is of a kind that navapp does not know", f"its name must begin with {KIND}"
    if entry.name.removeprefix(KIND) in _OUR_OWN:
        return "has the name of one of navapp's own, which is used instead", renaming
    if counts[entry.name] > 1:
        return "is not the only one of that name", "uninstall all but one of the packages"
    why = _why_not_loading(entry.value)
    remedy = "install what it needs, or update or uninstall the package"
    return (f"cannot be loaded ({why})", remedy) if why else ("", "")


def _why_not_loading(factory: str) -> str:
    """Last words of a process that loads it; empty when all went well."""
    try:
        done = run_python("-c", _LOAD, factory, timeout_s=_LOADING_S)
    except subprocess.TimeoutExpired:
        return f"it takes longer than {_LOADING_S:.0f} s"
    return "" if done.returncode == 0 else find_last_words(done)
