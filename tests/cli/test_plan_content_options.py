"""`navapp plan --contents --markups`, and the plan of the built-in knee."""

import json
from pathlib import Path

import numpy as np
import pytest

from navapp.cli.main import run
from navapp.config import SimulationSection
from navapp.control.stages import STAGES
from navapp.devices.simulated_plan import make_built_in_plan
from navapp.devices.simulated_room import Pace, make_simulated_camera, scenario_of, simulation_of
from navapp.geometry.ply import write_ply
from navapp.preop import read_plan, write_plan
from navapp.values import ANKLE_CENTRE, HIP_CENTRE, Plan
from sim_devices.anatomy import make_knee
from sim_devices.world import World

pytestmark = pytest.mark.usefixtures("few_sides")

EXAMPLE = Path(__file__).parents[2] / "docs" / "contents.toml"
LINE = {
    "type": "Line",
    "controlPoints": [{"position": [0, -8, -15]}, {"position": [0, -8, 15]}],
}


@pytest.fixture(scope="module")
def surfaces(tmp_path_factory) -> list[str]:
    folder = tmp_path_factory.mktemp("surfaces")
    arguments = []
    for name, mesh in make_knee().bones.items():
        write_ply(folder / f"{name}.ply", mesh)
        arguments += ["--surface", f"{name}={folder / name}.ply"]
    return arguments


@pytest.mark.release
def test_contents_and_markups_go_into_the_plan_and_are_shown(surfaces, tmp_path, capsys) -> None:
    line = tmp_path / "drill femur second 4mm.mrk.json"
    line.write_text(json.dumps({"markups": [LINE]}), encoding="utf-8")
    code = run([
        "plan", *surfaces, "--side", "right", "--contents", str(EXAMPLE), "--markups", str(line),
        "--out", str(tmp_path / "plan"), "--json", str(tmp_path / "made.json"),
    ])  # fmt: skip
    assert code == 0
    plan = read_plan(tmp_path / "plan")
    assert set(plan.content.drills) == {"femoral_guide", "second"}
    made = json.loads((tmp_path / "made.json").read_text())
    assert made["hash"] == plan.digest
    assert made["content"]["drills"]["second"]["depth_mm"] == 30.0
    assert made["content"]["absent"] == ["tibia/ankle_centre"]
    assert not made["warnings"]
    capsys.readouterr()
    assert run(["plan", "show", str(tmp_path / "plan")]) == 0
    shown = capsys.readouterr().out
    for line in (
        "plane femur_distal: of the femur",
        "drill second: 4 x 30 mm, into the femur",
        "implant femoral_implant: on the femur",
        "spacer liner: on the tibia",
        "risk popliteal_artery: moves with the femur, keep 5 mm away",
        "target femur/medial_condyle: 1 point",
        "target tibia/plateau: 24 points",
        "stage drilling: femur, 1 targets",
        "landmark femur/hip_centre: 0.0, 4.0, 410.0 +- 2.0 mm (contents)",
        "landmark tibia/ankle_centre: absent",
    ):
        assert line in shown


def test_a_mistake_in_a_contents_file_leaves_nothing_half_written(
    surfaces, tmp_path, capsys
) -> None:
    file = tmp_path / "contents.toml"
    file.write_text("[[drill]]\nname = 'a'\n", encoding="utf-8")
    code = run(["plan", *surfaces, "--contents", str(file), "--out", str(tmp_path / "plan")])
    assert code == 3
    said = capsys.readouterr().err
    assert "drill.0.bone: field required: add it" in said
    assert not (tmp_path / "plan").exists()


def test_show_takes_no_contents(tmp_path) -> None:
    assert run(["plan", "show", str(tmp_path), "--contents", str(EXAMPLE)]) == 2


@pytest.fixture(scope="module", params=["right", "left"])
def built_in(request) -> Plan:
    settings = SimulationSection(side=request.param)
    world = World(scenario_of(settings))
    camera = make_simulated_camera(world, settings, Pace.of(settings, is_headless=True), 15.0)
    return make_built_in_plan(simulation_of(world, camera))


def test_the_built_in_plan_has_something_of_everything_and_reads_back(built_in, tmp_path) -> None:
    content = built_in.content
    assert {plane.bone for plane in content.planes.values()} == {"femur", "tibia", "patella"}
    assert {part.kind for part in content.parts.values()} == {"implant", "spacer"}
    assert set(content.risks) == set(built_in.curves)
    assert len(content.risks) == 4
    assert {HIP_CENTRE, ANKLE_CENTRE} < set(content.landmarks)
    assert len(content.defects["worn_medial"].vertices) > 30
    assert [stage.name for stage in STAGES] == list(content.stages)
    for stage in STAGES:
        assert built_in.stage(stage) == stage
    write_plan(tmp_path / "plan", built_in)
    assert read_plan(tmp_path / "plan").digest == built_in.digest


def test_the_built_in_plan_is_where_the_bones_are(built_in) -> None:
    content = built_in.content
    sign = 1.0 if built_in.bones["femur"].side == "right" else -1.0
    drill = content.drills["femoral_guide"]
    femur = built_in.bones["femur"].mesh
    assert np.linalg.norm(femur.vertices_mm - drill.entry_mm, axis=1).min() < 2.0
    nearest = np.argmin(np.linalg.norm(femur.vertices_mm - drill.entry_mm, axis=1))
    assert drill.direction @ femur.normals[nearest] < -0.5
    for name, plane in content.planes.items():
        points = built_in.bones[plane.bone].mesh.vertices_mm
        beyond = (points - plane.point_mm) @ plane.normal
        # Some of the bone is removed, most stays.
        assert 0.01 < (beyond > 0.0).mean() < 0.5, name
    for name, part in content.parts.items():
        origin = part.bone_from_part.translation_mm
        away = [abs((origin - p.point_mm) @ p.normal) for p in content.planes.values()]
        assert min(away) < 1e-6, name
        # It stands on its cut, about as thick as what that takes off.
        assert 6.0 < part.shape.vertices_mm[:, 2].max() < 14.0, name
    worn = femur.vertices_mm[content.defects["worn_medial"].vertices]
    assert (sign * worn[:, 0] > 0.0).all()
    hip, ankle = (content.landmarks[name].point_mm for name in (HIP_CENTRE, ANKLE_CENTRE))
    assert 350.0 < hip[2] < 550.0
    assert -500.0 < ankle[2] < -300.0
