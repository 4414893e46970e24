from collections.abc import Iterator
from contextlib import ExitStack

import pytest

from tests.control.cuts import Faces
from tests.control.fakes import Bench


@pytest.fixture
def bench() -> Bench:
    return Bench()


@pytest.fixture
def undo() -> Iterator[ExitStack]:
    """What is entered here ends with the test."""
    with ExitStack() as stack:
        yield stack


@pytest.fixture
def faces(monkeypatch: pytest.MonkeyPatch) -> Faces:
    return Faces(monkeypatch)
