"""What is made once, or faster: pictures of a board, plans."""

import json
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.calibration.photographed import KEYS, good_poses, photograph
from tests.few_sides import from_few_sides


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Who works on the good pairs does so in one worker: they are photographed there."""
    for item in items:
        if "good_pairs" in getattr(item, "fixturenames", ()):
            item.add_marker(pytest.mark.xdist_group("good pairs"))


@pytest.fixture(scope="session")
def board_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("board") / "board.json"
    path.write_text(json.dumps(KEYS), encoding="utf-8")
    return path


@pytest.fixture(scope="session")
def good_pairs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Ten pairs that give an accepted rig; nobody writes into this folder."""
    return photograph(tmp_path_factory.mktemp("good"), good_poses())


@pytest.fixture
def few_sides() -> Iterator[None]:
    with from_few_sides():
        yield
