"""`navapp stereo` on pairs with ground truth; skipped, and counted, without the data."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from navapp.cli.main import run


def disparity(left: Path, right: Path, n_disparities: int, out: Path) -> np.ndarray:
    arguments = ["--disparities", str(n_disparities), "--out", str(out)]
    assert run(["--quiet", "stereo", str(left), str(right), *arguments]) == 0
    return np.load(out)


def truth_of(path: Path, scale: float) -> np.ndarray:
    values = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE).astype(float) / scale
    values[values <= 0.0] = np.nan
    return values


@pytest.mark.data
@pytest.mark.slow
def test_cones(data: Path, tmp_path: Path) -> None:
    folder = data / "stereo" / "cones"
    found = disparity(folder / "im2.png", folder / "im6.png", 64, tmp_path / "d.npy")
    truth, other = (truth_of(folder / name, 4.0) for name in ("disp2.png", "disp6.png"))
    rows, columns = np.indices(truth.shape)
    partner = np.rint(columns - np.nan_to_num(truth)).astype(int)
    inside = (partner >= 0) & (partner < truth.shape[1])
    seen = np.where(inside, other[rows, np.clip(partner, 0, truth.shape[1] - 1)], np.nan)
    visible = np.isfinite(truth) & inside & (np.abs(seen - truth) <= 1.0)
    occluded = np.isfinite(truth) & ~visible
    error = np.abs(found - truth)
    known = np.isfinite(found)
    assert known[visible].mean() >= 0.99
    assert (error[visible & known] > 1.0).mean() <= 0.036
    assert known[occluded].mean() >= 0.98
    assert error[occluded & known].mean() <= 3.3


@pytest.mark.data
@pytest.mark.slow
def test_aloe(data: Path, tmp_path: Path) -> None:
    folder = data / "stereo" / "aloe"
    found = disparity(folder / "aloeL.jpg", folder / "aloeR.jpg", 224, tmp_path / "d.npy")
    truth = truth_of(folder / "aloeGT.png", 1.0)
    judged = np.isfinite(truth)
    known = np.isfinite(found)
    assert known[judged].mean() >= 0.98
    assert (np.abs(found - truth)[judged & known] > 1.0).mean() <= 0.15
