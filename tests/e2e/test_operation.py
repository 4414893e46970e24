"""`navapp run` on the simulated operation: any stage to start in, and all five in one session."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from navapp.cli.main import run
from tests.many import few_of

REGISTER = "[[step]]\ndo = 'register'\n"
STARTS = [(stage, seed) for seed in range(1, 6) for stage in ("implant", "patella", "spacer")]
# Of one knee's few frames: their errors go together.
WORST_MM = 0.25


def run_headless(folder: Path, seed: int, script: str, *options: str) -> list[dict[str, Any]]:
    """Frames of a session of the simulated room."""
    config, operator, result = (folder / name for name in ("c.toml", "script.toml", "r.json"))
    config.write_text(f"[camera.simulated]\nseed = {seed}\n", encoding="utf-8")
    operator.write_text(script, encoding="utf-8")
    arguments = ["--config", str(config), "run", "--headless", "--operator", str(operator)]
    assert run([*arguments, "--json", str(result), *options]) == 0
    frames: list[dict[str, Any]] = json.loads(result.read_text(encoding="utf-8"))["frames"]
    return frames


@pytest.mark.parametrize("start", few_of(STARTS))
def test_a_stage_to_start_in_is_known_with_the_cuts_that_were_made(start, tmp_path) -> None:
    stage, seed = start
    frames = run_headless(tmp_path, seed, REGISTER, "--stage", stage, "--frames", "5")
    assert [frame["status"] for frame in frames[1:]] == ["OK"] * 4
    assert np.median([frame["tre_mm"] for frame in frames[1:]]) <= WORST_MM


@pytest.mark.release
def test_one_session_walks_through_all_five_stages(tmp_path) -> None:
    entered = {"drilling": 4, "implant": 7, "patella": 11, "spacer": 15}
    script = REGISTER
    for stage, at_frame in entered.items():
        script += f"[[step]]\ndo = 'stage'\nstage = '{stage}'\nat_frame = {at_frame}\n"
        script += REGISTER if stage in ("patella", "spacer") else ""
    frames = run_headless(tmp_path, 1, script, "--frames", "21")
    assert list(dict.fromkeys(frame["stage"] for frame in frames)) == ["opening", *entered]
    for stage in ("opening", *entered):
        of_stage = [frame for frame in frames if frame["stage"] == stage]
        assert of_stage[-1]["status"] == "OK", stage
        assert of_stage[-1]["tre_mm"] < 0.3, stage
