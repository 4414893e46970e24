"""`navapp run` on the simulated operation: two stages and into the third; before a release all."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from navapp.cli.main import run
from tests.many import few_of

OPERATION = (Path(__file__).parents[2] / "docs" / "operation.toml").read_text(encoding="utf-8")
QUIT = "[[step]]\ndo = 'quit'\n"
REGISTER = "[[step]]\ndo = 'register'\n"
STARTS = [(stage, seed) for seed in range(1, 6) for stage in ("implant", "patella", "spacer")]
STEPS = {
    "femoral_guide", "femur_distal", "femur_anterior", "femur_chamfer_anterior",
    "femur_posterior", "femur_chamfer_posterior", "femoral_implant", "patella",
    "patellar_implant", "tibia_proximal", "spacer",
}  # fmt: skip
MEASURED = {"femoral_guide", "femur_distal", "tibia_proximal"}
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


@pytest.mark.release
@pytest.mark.parametrize("start", STARTS)
def test_a_stage_to_start_in_is_known_with_the_cuts_that_were_made(start, tmp_path) -> None:
    stage, seed = start
    frames = run_headless(tmp_path, seed, REGISTER, "--stage", stage, "--frames", "5")
    assert [frame["status"] for frame in frames[1:]] == ["OK"] * 4
    assert np.median([frame["tre_mm"] for frame in frames[1:]]) <= WORST_MM


# A script, how many stages it goes through, and what it makes.
INTO_IMPLANT = (OPERATION.partition("# 3 implant")[0] + QUIT, 3, {"femoral_guide"})
TO_ITS_END = (OPERATION, 5, STEPS)


@pytest.mark.parametrize("part", few_of([INTO_IMPLANT, TO_ITS_END]), ids=["implant", "end"])
def test_an_operation_goes_through_its_stages(part, tmp_path) -> None:
    """Every gate is refused once and met once (the script expects it); all that is made is told."""
    text, n_stages, made = part
    config, script, result = (tmp_path / name for name in ("c.toml", "script.toml", "r.json"))
    config.write_text("[camera.simulated]\nmisses = 0.2\n", encoding="utf-8")
    script.write_text(text, encoding="utf-8")
    arguments = ["--config", str(config), "run", "--headless", "--json", str(result)]
    assert run([*arguments, "--operator", str(script), "--frames", "300"]) == 0
    told = json.loads(result.read_text(encoding="utf-8"))
    stages = list(dict.fromkeys(frame["stage"] for frame in told["frames"]))
    assert stages == ["opening", "drilling", "implant", "patella", "spacer"][:n_stages]
    right = [frame["tre_mm"] for frame in told["frames"] if frame["status"] == "OK"]
    assert np.median(right) < 0.1
    assert max(right) < 0.5
    steps = {step["step"]: step for step in told["operation"]}
    assert set(steps) == STEPS
    assert {name for name, step in steps.items() if step["made"]} == made
    measured = [step for step in steps.values() if step["measured"] is not None]
    assert {step["step"] for step in measured} >= MEASURED & made
    for step in measured:
        found, error = step["measured"], step["error"]
        assert error["mm"] <= found["bound_mm"]
        if step["kind"] == "cut":
            assert error["deg"] <= found["bound_deg"]
            assert step["thickness"]["planned_mm"] > 5.0
