import pytest

from tests.control.fakes import Bench


@pytest.fixture
def bench(monkeypatch) -> Bench:
    return Bench(monkeypatch)
