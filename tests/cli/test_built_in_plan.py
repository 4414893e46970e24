"""The example of a contents file lies where it says on the built-in knee."""

import tomllib
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

from navapp.cli.main import run
from navapp.preop import read_plan

pytestmark = pytest.mark.usefixtures("few_sides")

EXAMPLE = Path(__file__).parents[2] / "docs" / "contents.toml"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("built_in")


@pytest.fixture
def plan(folder):
    place = folder / "plan"
    if not place.exists():
        made = ["plan", "--built-in", "--contents", str(EXAMPLE), "--out", str(place)]
        assert run(["--quiet", *made]) == 0
    return read_plan(place)


def off_surface_mm(plan, bone, points_mm):
    distance, _ = cKDTree(plan.bones[bone].mesh.vertices_mm).query(np.atleast_2d(points_mm))
    return distance


@pytest.mark.release
def test_the_bones_are_those_of_the_simulated_room(plan):
    assert set(plan.bones) == {"femur", "tibia", "patella"}
    assert {bone.side for bone in plan.bones.values()} == {"right"}


def test_what_lies_on_a_bone_does(plan):
    content = plan.content
    drill = content.drills["femoral_guide"]
    epicondyle = content.landmarks["femur/medial_epicondyle"]
    target = plan.targets["femur/medial_condyle"]
    for place in (drill.entry_mm, epicondyle.point_mm, target):
        assert off_surface_mm(plan, "femur", place).max() < 1.0
    (defect,) = tomllib.loads(EXAMPLE.read_text(encoding="utf-8"))["defect"]
    assert off_surface_mm(plan, "femur", defect["outline_mm"]).max() < 3.0


def test_a_hole_goes_into_the_bone(plan):
    drill = plan.content.drills["femoral_guide"]
    end = drill.entry_mm + drill.depth_mm * drill.direction
    assert off_surface_mm(plan, "femur", end).min() > 5.0


def test_a_plane_cuts_its_bone_in_two(plan):
    for plane in plan.content.planes.values():
        height = (plan.bones[plane.bone].mesh.vertices_mm - plane.point_mm) @ plane.normal
        assert height.min() < -20.0 < 3.0 < height.max() < 20.0, plane


def test_components_sit_on_their_cuts(plan):
    planes, parts = plan.content.planes, plan.content.parts
    for part, plane in (("femoral_implant", "femur_distal"), ("liner", "tibia_proximal")):
        seat = planes[plane]
        middle = parts[part].bone_from_part.translation_mm
        assert (middle - seat.point_mm) @ seat.normal == pytest.approx(4.5, abs=0.1)


def test_the_artery_keeps_away_from_the_bone(plan):
    assert off_surface_mm(plan, "femur", plan.curves["popliteal_artery"]).min() > 15.0


def test_another_side_is_refused(tmp_path, capsys):
    out = str(tmp_path / "plan")
    assert run(["plan", "--built-in", "--side", "left", "--out", out]) == 2
    assert "the built-in knee is a right one" in capsys.readouterr().err
    assert not (tmp_path / "plan").exists()


def test_two_sources_are_refused(tmp_path, capsys):
    more = ["--surface", "femur=femur.ply", "--out", str(tmp_path / "plan")]
    assert run(["plan", "--built-in", *more]) == 2
    assert "more than one thing to plan from" in capsys.readouterr().err
