"""Every bench can be started: docs quote figures by their commands."""

import importlib
from pathlib import Path

import pytest

import tests.bench

NAMES = sorted(path.stem for path in Path(tests.bench.__path__[0]).glob("[a-z]*.py"))
# Installed by `make bench-peers` alone.
PEERS = {"open3d", "skimage", "pyransac3d"}


@pytest.mark.parametrize("name", NAMES)
def test_a_bench_imports(name: str) -> None:
    try:
        importlib.import_module(f"tests.bench.{name}")
    except ModuleNotFoundError as error:
        if error.name not in PEERS:
            raise
        pytest.skip(f"{error.name} is a peer")
