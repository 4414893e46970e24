"""What is said of compilation, and when work is done again for its timings."""

import sys

import numba
import pytest

from navapp.cli import compiling
from navapp.cli.compiling import run_compiled
from navapp.cli.diagnostics import Diagnostics


@pytest.fixture
def work(monkeypatch):
    """Work with a kernel of its own, and how often it was done; never short."""
    monkeypatch.setattr(compiling, "_SHORT_S", 0.0)
    kernel, calls = numba.njit(lambda number: number + 1), []

    def do():
        calls.append(kernel(1))
        return len(calls)

    return do, calls


def test_work_that_compiles_is_done_again_and_says_so_once(work, capsys):
    do, calls = work
    assert run_compiled(do, Diagnostics()) == 2
    assert capsys.readouterr().err == "navapp: compiling kernels, once on a machine\n"
    assert run_compiled(do, Diagnostics()) == 3
    assert capsys.readouterr().err == ""
    assert calls == [2, 2, 2]


def test_nothing_is_said_to_who_asked_for_quiet(work, capsys):
    run_compiled(work[0], Diagnostics(is_quiet=True))
    assert capsys.readouterr().err == ""


def test_a_terminal_sees_how_many_were_compiled(work, capsys, monkeypatch):
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    run_compiled(work[0], Diagnostics())
    told = capsys.readouterr().err
    assert "compiling kernels, once on a machine: 1 (<lambda>)" in told
    assert told.endswith("kernels compiled: 1\n")


def test_short_work_is_done_again_for_its_timings(work, monkeypatch):
    do, _ = work
    run_compiled(do, Diagnostics())
    monkeypatch.setattr(compiling, "_SHORT_S", 60.0)
    assert run_compiled(do, Diagnostics()) == 4
