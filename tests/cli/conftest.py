"""Pictures of a board, taken once; tests copy what they change."""

import json
from pathlib import Path

import pytest

from tests.calibration.photographed import KEYS, good_poses, photograph


@pytest.fixture(scope="session")
def board_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("board") / "board.json"
    path.write_text(json.dumps(KEYS), encoding="utf-8")
    return path


@pytest.fixture(scope="session")
def good_pairs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Ten pairs that give an accepted rig; nobody writes into this folder."""
    return photograph(tmp_path_factory.mktemp("good"), good_poses())
