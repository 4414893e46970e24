"""A recorded femur after two saw cuts; skipped, and counted, without the data."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from navapp.cli.main import run
from navapp.evaluation import compute_mean_tre_mm
from navapp.geometry.transform import RigidTransform
from navapp.preop import read_plan
from navapp.values import BoneModel
from tests.few_sides import from_few_sides
from tests.recorded import read_true_poses

pytestmark = [pytest.mark.data, pytest.mark.slow]
CUTS = ("femur_distal", "femur_anterior")


@pytest.fixture(scope="module")
def plan(data: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of the whole bone, with both planes."""
    folder = tmp_path_factory.mktemp("cut") / "plan"
    root = data / "cut_a"
    arguments = [
        "--surface", f"femur={root / 'femur.ply'}", "--side", "right",
        "--contents", str(root / "contents.toml"), "--out", str(folder),
    ]  # fmt: skip
    # The bone is looked for near a pose: nobody asks for its aspects.
    with from_few_sides():
        assert run(["--quiet", "plan", *arguments]) == 0
    return folder


def replay(
    data: Path, plan: Path, out: Path, sequence: str, *options: str, cuts: tuple[str, ...] = CUTS
) -> tuple[int, dict[str, Any]]:
    """Exit code and result."""
    root, result = data / "cut_a", out / "poses.json"
    named = [word for name in cuts for word in ("--cut", name)]
    code = run([
        "--quiet", "replay", str(root / sequence), "--rig", str(root / "rig.yml"),
        "--plan", str(plan), "--prior", str(root / sequence / "prior.json"),
        *named, *options, "--json", str(result),
    ])  # fmt: skip
    return code, json.loads(result.read_text(encoding="utf-8"))


def errors_mm(data: Path, plan: Path, sequence: str, frames: list[dict[str, Any]]) -> list[float]:
    """Of the frames that are OK, over the surface that faces the camera."""
    truth = read_true_poses(data / "cut_a" / sequence)
    bone: BoneModel = read_plan(plan).bones["femur"]
    return [
        compute_mean_tre_mm(
            RigidTransform("left", "femur", frame["camera_from_model"]),
            truth[frame["index"]],
            bone,
            np.empty((0, 3)),
        )
        for frame in frames
        if frame["status"] == "OK"
    ]


def made(data: Path) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Point and normal of the planes as made."""
    told = json.loads((data / "cut_a" / "cuts.json").read_text(encoding="utf-8"))["cuts"]
    return {
        cut["name"]: (np.array(cut["made"]["point"]), np.array(cut["made"]["normal"]))
        for cut in told
    }


def assert_measured(data: Path, measured: dict[str, Any]) -> None:
    """Both faces as good as a surgeon needs them, and their bounds true."""
    for name, (point, normal) in made(data).items():
        face = measured[name]
        found = np.array(face["normal"])
        angle_deg = np.degrees(np.arccos(min(1.0, float(found @ normal))))
        off_mm = float((np.array(face["point_mm"]) - point) @ found / (normal @ found))
        assert angle_deg <= min(0.2, face["bound_deg"]), name
        assert abs(off_mm) <= min(0.12, face["bound_mm"]), name
        assert 0.25 <= face["seen_share"] <= 1.0


@pytest.mark.release
def test_a_cut_bone_is_followed_and_its_faces_are_measured(
    data: Path, plan: Path, tmp_path: Path
) -> None:
    code, result = replay(data, plan, tmp_path, "patient")
    assert code == 0
    frames = result["frames"]
    off_mm = errors_mm(data, plan, "patient", frames)
    assert len(off_mm) >= 0.85 * len(frames)
    assert np.median(off_mm) <= 0.08
    assert max(off_mm) <= 0.25
    bounds_mm = [one["predicted_tre_mm"] for one in frames if one["status"] == "OK"]
    assert (np.array(off_mm) <= bounds_mm).all()
    assert all("femur_distal" in one["measured"] for one in frames if one["status"] == "OK")
    assert_measured(data, result["summary"]["measured"])


@pytest.mark.release
def test_every_view_of_a_cut_bone_registers(data: Path, plan: Path, tmp_path: Path) -> None:
    code, result = replay(data, plan, tmp_path, "registration", "--order", "each")
    assert code == 0
    off_mm = errors_mm(data, plan, "registration", result["frames"])
    assert len(off_mm) == len(result["frames"])
    assert np.median(off_mm) <= 0.10
    assert max(off_mm) <= 0.30


@pytest.mark.release
def test_a_hand_over_a_cut_bone_shows_no_wrong_pose(data: Path, plan: Path, tmp_path: Path) -> None:
    code, result = replay(data, plan, tmp_path, "instrument")
    assert code == 0
    off_mm = errors_mm(data, plan, "instrument", result["frames"])
    assert len(off_mm) >= 0.5 * len(result["frames"])
    assert np.median(off_mm) <= 0.12
    assert max(off_mm) <= 0.35


@pytest.mark.release
def test_a_cut_that_nobody_told_of_is_no_pose(data: Path, plan: Path, tmp_path: Path) -> None:
    for sequence in ("registration", "patient", "instrument"):
        _, result = replay(data, plan, tmp_path, sequence, cuts=())
        off_mm = errors_mm(data, plan, sequence, result["frames"])
        assert all(one <= 0.5 for one in off_mm)
        assert result["summary"]["measured"] == {}


@pytest.mark.release
def test_an_unknown_plane_is_refused(
    data: Path, plan: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    root = data / "cut_a"
    code = run([
        "replay", str(root / "patient"), "--rig", str(root / "rig.yml"), "--plan", str(plan),
        "--prior", str(root / "patient" / "prior.json"), "--cut", "femur_top",
    ])  # fmt: skip
    assert code == 2
    said = capsys.readouterr().err
    assert "no step 'femur_top'" in said
    assert "femur_distal, femur_anterior" in said
