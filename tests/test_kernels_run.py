"""What a run has run of the kernels, and that a missing one fails it."""

from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
from numba import njit

from tests.kernels_run import EveryKernel, all_kernels, kernels_of, were_run


def module_of_kernels() -> ModuleType:
    module = ModuleType("some_kernels")
    source = "def inner(x): return x + 1\ndef outer(x): return inner(x)\ndef other(x): return x\n"
    exec(source, vars(module))
    for name in ("inner", "outer", "other"):
        setattr(module, name, njit(getattr(module, name)))
    return module


def test_what_was_called_and_what_it_calls_was_run() -> None:
    kernels = kernels_of(module_of_kernels())
    assert sorted(kernels) == ["some_kernels.inner", "some_kernels.other", "some_kernels.outer"]
    assert were_run(kernels.values()) == set()
    assert kernels["some_kernels.outer"](np.int64(1)) == 2
    ids = {id(kernels[f"some_kernels.{name}"]) for name in ("inner", "outer")}
    assert were_run(kernels.values()) == ids


def test_every_kernels_file_is_looked_into() -> None:
    found = all_kernels()
    assert "navapp.geometry.zbuffer_kernels.raster_nearest" in found
    assert {name.split(".")[0] for name in found} >= {"navapp", "sim_devices", "calibration"}


@pytest.mark.parametrize("is_all", [True, False])
def test_a_kernel_that_no_worker_has_run_fails_the_session(monkeypatch, is_all: bool) -> None:
    kernels = kernels_of(module_of_kernels())
    monkeypatch.setattr("tests.kernels_run.all_kernels", lambda: kernels)
    gathering, lines = EveryKernel(), []
    for names in (["inner", "outer"], ["other"] if is_all else []):
        told = {"kernels": [f"some_kernels.{name}" for name in names]}
        gathering.pytest_testnodedown(SimpleNamespace(workeroutput=told))
    session = SimpleNamespace(config=object(), exitstatus=pytest.ExitCode.OK)
    gathering.pytest_sessionfinish(session)
    gathering.pytest_terminal_summary(
        SimpleNamespace(write_line=lambda line, **more: lines.append(line))
    )
    assert session.exitstatus == (pytest.ExitCode.OK if is_all else pytest.ExitCode.TESTS_FAILED)
    assert lines == ([] if is_all else ["no test has run the kernel some_kernels.other"])


def test_a_worker_tells_what_it_ran(monkeypatch) -> None:
    kernels = kernels_of(module_of_kernels())
    monkeypatch.setattr("tests.kernels_run.all_kernels", lambda: kernels)
    assert kernels["some_kernels.other"](np.int64(3)) == 3
    output: dict[str, list[str]] = {}
    EveryKernel().pytest_sessionfinish(
        SimpleNamespace(config=SimpleNamespace(workeroutput=output), exitstatus=0)
    )
    assert output == {"kernels": ["some_kernels.other"]}
