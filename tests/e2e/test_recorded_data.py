"""The main job on recorded pictures with truth; skipped, and counted, without the data."""

import json
from collections.abc import Callable
from contextlib import nullcontext
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from navapp.cli.main import run
from navapp.evaluation import compute_mean_tre_mm
from navapp.geometry.ply import read_ply
from navapp.geometry.transform import RigidTransform
from navapp.values import BoneModel
from tests.few_sides import from_few_sides
from tests.recorded import read_true_poses

# Block matching alone does not reach it: this fails when the fine matching stops working.
WORST_OK_MM = 0.2


@pytest.fixture(scope="module")
def plan_of(data: Path, tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """The plan of a phantom, made once."""

    @cache
    def made(phantom: str) -> Path:
        folder = tmp_path_factory.mktemp(phantom) / "plan"
        surface = f"femur={data / phantom / 'femur.ply'}"
        # The first is only followed from poses: nobody asks for its aspects.
        with from_few_sides() if phantom == "phantom_a" else nullcontext():
            assert run(["--quiet", "plan", "--surface", surface, "--out", str(folder)]) == 0
        return folder

    return made


@pytest.mark.data
@pytest.mark.slow
@pytest.mark.parametrize(
    ("phantom", "start"),
    [
        ("phantom_a", ("camera_from_model",)),
        # Another person from the same start as the first.
        pytest.param("phantom_c", ("camera_from_model",), marks=pytest.mark.release),
        # More of a start than the next one.
        pytest.param("phantom_c", ("approach_cone", "box"), marks=pytest.mark.release),
        pytest.param("phantom_c", ("approach_cone",), marks=pytest.mark.release),
    ],
)
def test_most_frames_of_a_recorded_operation_get_a_pose(
    data: Path, plan_of: Callable[[str], Path], tmp_path: Path, phantom: str, start: tuple[str, ...]
) -> None:
    root = data / phantom
    known = json.loads((root / "patient" / "prior.json").read_text(encoding="utf-8"))
    prior = tmp_path / "prior.json"
    prior.write_text(json.dumps({key: known[key] for key in start}), encoding="utf-8")
    poses, overlay = tmp_path / "poses.json", tmp_path / "overlay"
    arguments = [
        "--quiet", "replay", str(root / "patient"), "--rig", str(root / "rig.yml"),
        "--plan", str(plan_of(phantom)), "--prior", str(prior),
        "--overlay", str(overlay), "--json", str(poses),
    ]  # fmt: skip
    assert run(arguments) == 0
    frames = json.loads(poses.read_text(encoding="utf-8"))["frames"]
    truth = read_true_poses(root / "patient")
    bone = BoneModel("femur", read_ply(root / "femur.ply")[0])
    errors_mm = [
        compute_mean_tre_mm(
            RigidTransform("left", "femur", frame["camera_from_model"]),
            truth[frame["index"]],
            bone,
            np.empty((0, 3)),
        )
        for frame in frames
        if frame["status"] == "OK"
    ]
    assert len(frames) == len(truth)
    assert len(errors_mm) >= 0.9 * len(frames)
    assert max(errors_mm) < WORST_OK_MM
    assert len(list(overlay.glob("overlay_*.jpg"))) == len(frames)


@pytest.mark.release
@pytest.mark.data
@pytest.mark.slow
@pytest.mark.parametrize("method", ["paper", "icp"])
def test_the_papers_chains_are_followed_and_never_accepted_as_ok(
    data: Path, plan_of: Callable[[str], Path], tmp_path: Path, method: str
) -> None:
    root, poses = data / "phantom_a", tmp_path / "poses.json"
    run([
        "--quiet", "replay", str(root / "patient"), "--rig", str(root / "rig.yml"),
        "--plan", str(plan_of("phantom_a")), "--prior", str(root / "patient" / "prior.json"),
        "--method", method, "--follow-refused", "--frames", "5", "--json", str(poses),
    ])  # fmt: skip
    frames = json.loads(poses.read_text(encoding="utf-8"))["frames"]
    assert len(frames) == 5
    for frame in frames:
        assert frame["camera_from_model"] is not None
        assert frame["status"] != "OK"
        assert (frame["timing_ms"]["fill"] > 0.0) is (method == "paper")
