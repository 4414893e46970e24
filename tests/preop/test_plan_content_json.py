"""Surgical content in a plan folder: reads back exactly, and what is edited is noticed."""

import json

import numpy as np
import pytest

from navapp.errors import PlanError
from navapp.preop import read_plan, write_plan
from navapp.values import BoneModel, Plan
from tests.geometry.shapes import sphere
from tests.test_contents_values import whole_plan


@pytest.fixture
def folder(tmp_path):
    write_plan(tmp_path / "plan", whole_plan())
    return tmp_path / "plan"


def test_all_of_it_reads_back_exactly(folder) -> None:
    plan, again = whole_plan(), read_plan(folder)
    assert again.digest == plan.digest
    assert again.content.stages == plan.content.stages
    assert again.content.parts["a"].shape == plan.content.parts["a"].shape
    first, other = plan.content.parts["a"].bone_from_part, again.content.parts["a"].bone_from_part
    assert (first.matrix.tobytes(), first.name) == (other.matrix.tobytes(), other.name)
    mesh = again.content.risks["artery"].mesh
    np.testing.assert_array_equal(mesh.vertices_mm, plan.content.risks["artery"].mesh.vertices_mm)
    assert again.content.risks["nerve"].mesh is None


def test_a_plan_from_before_there_was_any_content_still_reads(tmp_path) -> None:
    write_plan(tmp_path / "plan", Plan({"femur": BoneModel("femur", sphere(30.0, 10), "left")}))
    file = tmp_path / "plan" / "plan.json"
    content = json.loads(file.read_text())
    del content["file_hash"]
    assert content.pop("content")["planes"] == {}
    file.write_text(json.dumps(content))
    assert read_plan(tmp_path / "plan").content.is_empty


@pytest.mark.parametrize(
    ("place", "value"),
    [
        (("planes", "cut", "point_mm"), [1.0, 2.0, 3.5]),
        (("drills", "hole", "depth_mm"), 26.0),
        (("parts", "a", "shape", "size_mm"), [3.0, 4.0, 6.0]),
        (("parts", "a", "shape", "kind"), "ball"),
        (("parts", "a", "bone_from_part", "matrix"), [[2.0]]),
        (("risks", "nerve", "safety_mm"), 0.5),
        (("landmarks", "femur/hip_centre", "point_mm"), [0.0, 0.0]),
        (("defects", "worn", "vertices"), [1, 2]),
        (("stages", "drilling", "bone"), "tibia"),
        (("stages",), {}),
        (("planes",), 7),
    ],
)
def test_an_edited_plan_is_noticed(folder, place, value) -> None:
    file = folder / "plan.json"
    content = json.loads(file.read_text())
    entry = content["content"]
    for key in place[:-1]:
        entry = entry[key]
    assert entry[place[-1]] != value
    entry[place[-1]] = value
    file.write_text(json.dumps(content))
    with pytest.raises(PlanError, match="is damaged"):
        read_plan(folder)


def test_a_surface_of_the_content_that_changed_or_went_is_noticed(folder) -> None:
    surfaces = sorted(folder.glob("content_*.ply"))
    assert len(surfaces) == 2
    surfaces[0].write_bytes(surfaces[0].read_bytes()[:-1])
    with pytest.raises(PlanError, match=surfaces[0].name):
        read_plan(folder)
    surfaces[0].unlink()
    with pytest.raises(PlanError, match="missing"):
        read_plan(folder)
