"""`navapp stereo` on pairs with ground truth; skipped, and counted, without the data."""

from pathlib import Path

import numpy as np
import pytest

from navapp.cli.main import run
from tests.bench.stereo_pairs import ALOE, CONES, Known, Score, score_of


def score(data: Path, known: Known, out: Path) -> Score:
    """Of the file that the command writes."""
    folder = data / "stereo" / known.name
    pictures = [str(folder / name) for name in known.files]
    options = ["--disparities", str(known.n_disparities), "--out", str(out)]
    assert run(["--quiet", "stereo", *pictures, *options]) == 0
    return score_of(data / "stereo", known, np.load(out))


@pytest.mark.data
@pytest.mark.slow
def test_cones(data: Path, tmp_path: Path) -> None:
    found = score(data, CONES, tmp_path / "d.npy")
    assert found.density >= 0.99
    assert found.bad_1 <= 0.036
    assert found.occluded_density >= 0.98
    assert found.occluded_px <= 3.3


@pytest.mark.release
@pytest.mark.data
@pytest.mark.slow
def test_aloe(data: Path, tmp_path: Path) -> None:
    found = score(data, ALOE, tmp_path / "d.npy")
    assert found.density >= 0.98
    assert found.bad_1 <= 0.15
