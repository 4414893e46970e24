"""Which compiled kernels a test run has run: with --every-kernel one that it has not is a failure.

The run with checked indices protects the kernels that it reaches, and no others.
"""

import importlib
from collections.abc import Iterable
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from numba.core.dispatcher import Dispatcher

ROOT = Path(__file__).resolve().parent.parent
PACKAGES = ("navapp", "sim_devices", "drivers", "calibration")


def kernels_of(module: ModuleType) -> dict[str, Dispatcher]:
    """By full name: those that the module itself holds."""
    return {
        f"{module.__name__}.{name}": value
        for name, value in vars(module).items()
        if isinstance(value, Dispatcher) and value.py_func.__module__ == module.__name__
    }


def all_kernels() -> dict[str, Dispatcher]:
    """Every kernel of the product, by full name."""
    found: dict[str, Dispatcher] = {}
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*kernels.py")):
            name = ".".join(path.relative_to(ROOT).with_suffix("").parts)
            found |= kernels_of(importlib.import_module(name))
    return found


def were_run(kernels: Iterable[Dispatcher]) -> set[int]:
    """The `id` of those that were called, and of those that they call."""
    left = [kernel for kernel in kernels if kernel.signatures]
    found: set[int] = set()
    while left:
        kernel = left.pop()
        if id(kernel) in found:
            continue
        found.add(id(kernel))
        function = kernel.py_func
        named = (function.__globals__.get(name) for name in function.__code__.co_names)
        left += [other for other in named if isinstance(other, Dispatcher)]
    return found


class EveryKernel:
    """Gathers what all workers ran, and fails the session when a kernel is missing."""

    def __init__(self) -> None:
        self._were_run: set[str] = set()
        self._missing: list[str] = []

    def pytest_testnodedown(self, node: Any) -> None:
        """A worker has ended and says what it ran."""
        self._were_run |= set(getattr(node, "workeroutput", {}).get("kernels", ()))

    @pytest.hookimpl(trylast=True)
    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        kernels = all_kernels()
        ids = were_run(kernels.values())
        self._were_run |= {name for name, kernel in kernels.items() if id(kernel) in ids}
        if hasattr(session.config, "workeroutput"):
            session.config.workeroutput["kernels"] = sorted(self._were_run)
            return
        self._missing = sorted(kernels.keys() - self._were_run)
        if self._missing and session.exitstatus == pytest.ExitCode.OK:
            session.exitstatus = pytest.ExitCode.TESTS_FAILED

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        for name in self._missing:
            terminalreporter.write_line(f"no test has run the kernel {name}", red=True)
