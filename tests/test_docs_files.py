"""The examples of docs/files.md are read by the product's own readers."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from calibration.targets.boards import read_board
from drivers.clock import ManualClock
from drivers.replay_camera import ReplayCamera, ReplaySettings
from drivers.session_files import read_frame_table
from navapp.cli.alignment_files import read_alignments
from navapp.cli.pose_files import read_pose
from navapp.cli.run import _script
from navapp.cli.tool_poses import read_tool_poses
from navapp.config import load
from navapp.control.operators import read_events
from navapp.control.prior_files import read_prior
from navapp.geometry.display_model_files import read_display_model
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.rig_files import read_rig
from navapp.preop import build_aspects, write_plan
from navapp.preop.contents_file import read_contents
from navapp.tools.accuracy_tasks import read_divots
from navapp.tools.plate_files import read_plate
from navapp.tools.tool_files import read_tool
from navapp.values import BoneModel, Plan
from sim_devices.anatomy import make_knee
from tests.few_sides import FEW_SIDES

DOCS = Path(__file__).parents[1] / "docs"
EXAMPLE = re.compile(r"^## (.+?)$|^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def examples() -> dict[str, list[tuple[str, str]]]:
    """Heading -> kind and text of its examples."""
    found: dict[str, list[tuple[str, str]]] = {}
    heading = ""
    for match in EXAMPLE.finditer((DOCS / "files.md").read_text(encoding="utf-8")):
        heading = match[1] or heading
        if match[2]:
            found.setdefault(heading, []).append((match[2], match[3]))
    return found


def write(folder: Path, heading: str, number: int = 0, name: str = "") -> Path:
    """An example as a file."""
    kind, text = examples()[heading][number]
    path = folder / (name or f"example.{kind}")
    path.write_text(text, encoding="utf-8")
    return path


def femur() -> BoneModel:
    mesh = make_knee().bones["femur"]
    return BoneModel("femur", TriangleMesh(mesh.vertices_mm, mesh.faces), "right")


READERS: dict[str, tuple[Callable[[Path], Any], Callable[[Any], bool]]] = {
    "Board": (read_board, lambda board: board.spacing_mm == 15.0),
    "Plate": (read_plate, lambda plate: plate.first_id == 8),
    "Rig": (read_rig, lambda rig: abs(rig.baseline_mm - 80.0) < 1e-9),
    "Prior": (read_prior, lambda prior: prior.has_start("femur") and len(prior.picks) == 1),
    "Transform": (
        lambda path: read_pose(path, "scene", "model", 1.0),
        lambda pose: pose.translation_mm.tolist() == [12.0, -3.5, 40.0],
    ),
    "Poses of a tool": (read_tool_poses, lambda poses: len(poses) == 2),
    "Tool": (read_tool, lambda tool: tool.tip_mm.tolist() == [2.0, 78.0, 112.0]),
    "Divots": (read_divots, lambda points: points.shape == (4, 3)),
    "Alignments": (
        lambda path: read_alignments(str(path)),
        lambda made: made[1].pixels.tolist() == [[961.0, 530.5]],
    ),
    "Configuration": (load, lambda found: found.camera.opencv.exposure_ms == 5.0),
    "Operator's script": (lambda path: _script(str(path)), lambda steps: len(steps) == 3),
    "Contents": (
        lambda path: read_contents(path, {"femur": femur()}),
        lambda planned: "femoral_guide" in planned.content.drills,
    ),
}


@pytest.mark.parametrize("heading", READERS)
def test_an_example_is_read(heading: str, tmp_path: Path) -> None:
    read, is_right = READERS[heading]
    assert is_right(read(write(tmp_path, heading)))


def test_poses_of_a_tool_may_be_json(tmp_path: Path) -> None:
    assert read_tool_poses(write(tmp_path, "Poses of a tool", 1)).shape == (1, 4, 4)


def test_the_display_is_read() -> None:
    model = read_display_model(DOCS / "examples" / "display.yml")
    assert (model.screen.width_px, model.viewing_eye) == (1280, "left")


def test_pairs_have_such_names(tmp_path: Path) -> None:
    for name in examples()["Pairs"][0][1].split():
        cv2.imwrite(str(tmp_path / name), np.zeros((4, 4), np.uint8))
    camera = ReplayCamera(str(tmp_path), ManualClock(), ReplaySettings())
    camera.open()
    try:
        assert camera.read(1.0).left.shape[:2] == (4, 4)
    finally:
        camera.close()


def test_a_plan_holds_these_files(tmp_path: Path) -> None:
    bone = femur()
    plan = Plan({"femur": bone}, aspects={"femur": build_aspects(bone, settings=FEW_SIDES)})
    write_plan(tmp_path / "plan", plan)
    names = {path.name for path in (tmp_path / "plan").iterdir()}
    assert names == set(examples()["Plan"][0][1].split())


def test_a_session_holds_such_tables(tmp_path: Path) -> None:
    write(tmp_path, "Session", 0, "frames.csv")
    assert [row.sequence for row in read_frame_table(tmp_path)] == [0, 1]
    events = read_events(write(tmp_path, "Session", 1))
    assert len(events.commands) == 1


def test_every_example_is_looked_at() -> None:
    assert set(examples()) == {*READERS, "Pairs", "Plan", "Session"}
