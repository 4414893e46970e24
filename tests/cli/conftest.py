"""What is made once, or faster: pictures of a board, plans."""

import json
from functools import partial
from pathlib import Path

import pytest

import navapp.preop
from navapp.preop import AspectSettings
from tests.calibration.photographed import KEYS, good_poses, photograph


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
def few_views(monkeypatch: pytest.MonkeyPatch) -> None:
    """Bones are looked at from few sides: a plan is made in a fraction of the time."""
    coarse = partial(navapp.preop.build_aspects, settings=AspectSettings(step_deg=45.0))
    monkeypatch.setattr(navapp.preop, "build_aspects", coarse)
