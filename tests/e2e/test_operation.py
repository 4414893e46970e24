"""`navapp run` on the simulated operation: any stage to start in, and all five in one session."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from navapp.cli.main import run
from tests.many import few_of

OPERATION = Path(__file__).parents[2] / "docs" / "operation.toml"
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


def test_an_operation_goes_through_all_five_stages(tmp_path) -> None:
    """Every gate is refused once and met once (the script expects it); all that is made is told."""
    config, result = tmp_path / "c.toml", tmp_path / "r.json"
    config.write_text("[camera.simulated]\nmisses = 0.2\n", encoding="utf-8")
    arguments = ["--config", str(config), "run", "--headless", "--json", str(result)]
    assert run([*arguments, "--operator", str(OPERATION), "--frames", "300"]) == 0
    told = json.loads(result.read_text(encoding="utf-8"))
    stages = list(dict.fromkeys(frame["stage"] for frame in told["frames"]))
    assert stages == ["opening", "drilling", "implant", "patella", "spacer"]
    right = [frame["tre_mm"] for frame in told["frames"] if frame["status"] == "OK"]
    assert np.median(right) < 0.1
    assert max(right) < 0.5
    steps = {step["step"]: step for step in told["operation"]}
    assert len(steps) == 11
    assert all(step["made"] for step in steps.values())
    measured = [step for step in steps.values() if step["measured"] is not None]
    assert {step["step"] for step in measured} >= {
        "femur_distal",
        "tibia_proximal",
        "femoral_guide",
    }
    for step in measured:
        found, error = step["measured"], step["error"]
        assert error["mm"] <= found["bound_mm"]
        if step["kind"] == "cut":
            assert error["deg"] <= found["bound_deg"]
            assert step["thickness"]["planned_mm"] > 5.0
