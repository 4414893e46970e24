"""A simulated pointer from its calibration to places on a registered femur, by commands alone."""

import json

import numpy as np
import pytest

from navapp.cli.main import run

ROOM = '[camera.simulated]\ntool = "pointer"\n[tools]\npointer = "{}"\n'


@pytest.mark.slow
@pytest.mark.release
def test_the_tip_of_a_calibrated_pointer_lies_on_the_bone_that_it_touches(tmp_path) -> None:
    """The simulated hand rests at each place for 1.6 s, its tip on the femur's surface."""
    tool, out = tmp_path / "pointer.json", tmp_path / "run.json"
    assert run(["calibrate", "pivot", "--headless", "--out", str(tool)]) == 0
    config = tmp_path / "room.toml"
    config.write_text(ROOM.format(tool), encoding="utf-8")
    options = ["run", "--headless", "--frames", "150", "--json", str(out)]
    assert run(["--config", str(config), *options]) == 0
    frames = json.loads(out.read_text(encoding="utf-8"))["frames"]
    readings = [frame["tools"]["pointer"] for frame in frames if frame["tools"]]
    placed = [one for one in readings if "tip_mm" in one]
    assert len(placed) > 60
    tips = np.array([one["tip_mm"] for one in placed])
    steps_mm = np.linalg.norm(np.diff(tips, axis=0), axis=1)
    # Resting on the bone: from frame to frame in the same place of it.
    resting = [one for one, step in zip(placed[1:], steps_mm, strict=True) if step < 0.05]
    assert len(resting) > 20
    off_mm = np.array([abs(one["surface_mm"]) for one in resting])
    bounds_mm = np.array([one["bound_mm"] for one in resting])
    assert np.median(off_mm) < 0.15
    assert np.mean(off_mm <= bounds_mm) > 0.9
