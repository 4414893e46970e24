"""Every bench can be started: docs quote figures by their commands."""

import importlib
from pathlib import Path

import pytest

import tests.bench

NAMES = sorted(path.stem for path in Path(tests.bench.__path__[0]).glob("[a-z]*.py"))
# Installed by `make peers` alone.
PEERS = {"open3d", "skimage", "pyransac3d"}


@pytest.mark.parametrize("name", NAMES)
def test_a_bench_imports(name: str) -> None:
    try:
        importlib.import_module(f"tests.bench.{name}")
    except ModuleNotFoundError as error:
        if error.name not in PEERS:
            raise
        pytest.skip(f"{error.name} is a peer")


@pytest.mark.release
def test_the_bench_of_faces_counts_them(capsys, monkeypatch) -> None:
    """Its scene stands for the simulator's: whoever changes how those are rendered is told here."""
    monkeypatch.setattr("sys.argv", ["tool_faces", "--frames", "2"])
    assert importlib.import_module("tests.bench.tool_faces").main() == 0
    assert capsys.readouterr().out
