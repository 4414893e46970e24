"""Contents files: what a person may write, and what is said of what cannot be."""

from pathlib import Path

import numpy as np
import pytest

from navapp.errors import PlanError
from navapp.geometry.ply import write_ply
from navapp.preop.contents_file import read_contents
from navapp.values import Box, Cylinder
from tests.geometry.shapes import sphere
from tests.preop.knees import bones_of, knees

EXAMPLE = Path(__file__).parents[2] / "docs" / "contents.toml"


@pytest.fixture(scope="module")
def bones():
    return bones_of(knees()[0])


@pytest.fixture
def read(tmp_path, bones):
    def run(text: str):
        file = tmp_path / "contents.toml"
        file.write_text(text, encoding="utf-8")
        return read_contents(file, bones)

    return run


def test_the_example_in_the_documentation_reads(bones) -> None:
    planned = read_contents(EXAMPLE, bones)
    content = planned.content
    assert set(content.planes) == {"femur_distal", "tibia_proximal"}
    assert content.drills["femoral_guide"].depth_mm == 25.0
    np.testing.assert_allclose(np.linalg.norm(content.drills["femoral_guide"].direction), 1.0)
    assert content.parts["femoral_implant"].shape == Box((66.0, 52.0, 9.0))
    button = content.parts["patellar_implant"]
    assert button.shape == Cylinder(30.0, 9.0)
    # Turned by -90 deg about x, its axis points to the back.
    np.testing.assert_allclose(button.bone_from_part.rotate([0.0, 0.0, 1.0]), [0, 1, 0], atol=1e-9)
    assert (button.bone, content.parts["liner"].kind) == ("patella", "spacer")
    assert content.risks["popliteal_artery"].safety_mm == 5.0
    assert planned.curves["popliteal_artery"].shape == (4, 3)
    assert content.landmarks["femur/hip_centre"].sd_mm == 2.0
    assert planned.absent == ("tibia/ankle_centre",)
    assert len(content.defects["medial"].vertices) > 50
    assert content.stages["drilling"].drills == ("femoral_guide",)
    assert planned.targets["femur/medial_condyle"].shape == (1, 3)


def test_an_empty_file_plans_nothing(read) -> None:
    planned = read("")
    assert planned.content.is_empty
    assert not planned.targets


def test_surfaces_are_read_beside_the_file_and_turned_into_lps(read, tmp_path) -> None:
    write_ply(tmp_path / "liner.ply", sphere(10.0, 8))
    write_ply(tmp_path / "artery.ply", sphere(4.0, 8, (5.0, 6.0, 7.0)), space="RAS")
    planned = read(
        '[[spacer]]\nname = "liner"\nbone = "tibia"\nfile = "liner.ply"\nposition_mm = [1, 2, 3]\n'
        '[[risk]]\nname = "artery"\nbone = "femur"\nsafety_mm = 3\nfile = "artery.ply"\n'
    )
    part, risk = planned.content.parts["liner"], planned.content.risks["artery"]
    np.testing.assert_allclose(part.shape.centroid_mm, 0.0, atol=1e-9)
    np.testing.assert_allclose(part.bone_from_part.translation_mm, [1, 2, 3])
    np.testing.assert_allclose(risk.mesh.centroid_mm, [-5.0, -6.0, 7.0], atol=1e-6)


PLANE = '[[plane]]\nname = "a"\nbone = "femur"\npoint_mm = [0, 0, 0]\nnormal = [0, 0, 1]\n'
DRILL = '[[drill]]\nname = "a"\nbone = "femur"\nentry_mm = [0, 0, 0]\ndirection = [0, 0, 1]\n'


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[[plane]", ("not valid TOML",)),
        ("[[plan]]\nname = 'a'", ("'plan'", "did you mean 'plane'")),
        (PLANE.replace("point_mm", "point"), ("plane.0.point'", "did you mean 'point_mm'")),
        (PLANE.replace("[0, 0, 1]", "[0, 0, 0]"), ("plane.0.normal", "needs a length")),
        (PLANE.replace("[0, 0, 0]", "[0, 0]"), ("plane.0.point_mm", "field required")),
        (PLANE.replace("femur", "fibula"), ("plane.0.bone", "'femur', 'tibia' or 'patella'")),
        (PLANE + PLANE, ("plane 'a' is given twice",)),
        (PLANE + "extent_mm = [80, -1]", ("plane.0.extent_mm.1", "greater than 0")),
        (DRILL + "diameter_mm = 8", ("drill.0.depth_mm", "field required")),
        (DRILL + "diameter_mm = 8\ndepth_mm = nan", ("drill.0.depth_mm", "finite")),
        (DRILL + "diameter_mm = 8\ndepth_mm = '30 mm'", ("drill.0.depth_mm", "valid number")),
        ("[[implant]]\nname = 'a'\nbone = 'femur'\nposition_mm = [0, 0, 0]", ("shape or file",)),
        (
            "[[implant]]\nname = 'a'\nbone = 'femur'\nposition_mm = [0, 0, 0]\n"
            "shape = { kind = 'sphere', size_mm = [1, 1, 1] }",
            ("implant.0.shape", "a sphere is given by diameter_mm"),
        ),
        ("[hip]\nsd_mm = 2", ("hip", "point_mm or absent")),
        ("[[target]]\nname = 'notch'\npoints_mm = [[0, 0, 0]]", ("target.0.name", "bone/name")),
        ("[stage.opning]\nbone = 'femur'", ("'stage.opning'", "did you mean 'opening'")),
        ("[stage.opening]\nbone = 'femur'\nplane = ['a']", ("did you mean 'planes'",)),
        (
            "[[defect]]\nname = 'a'\nbone = 'femur'\npoints_mm = [[500, 0, 0]]",
            ("defect 'a' paints nothing of the femur", "LPS"),
        ),
    ],
)
def test_a_mistake_is_one_sentence_with_the_key_and_the_remedy(read, text, words) -> None:
    with pytest.raises(PlanError) as caught:
        read(text)
    said = str(caught.value)
    assert "contents.toml" in said
    assert "\n" not in said or "TOML" in said
    assert caught.value.remedy
    for word in words:
        assert word in said, said


def test_a_bone_that_the_plan_does_not_have_is_refused(tmp_path, bones) -> None:
    file = tmp_path / "contents.toml"
    file.write_text(PLANE, encoding="utf-8")
    with pytest.raises(PlanError, match=r"plane\.0\.bone: the plan has no femur"):
        read_contents(file, {"tibia": bones["tibia"]})


def test_a_file_that_is_missing_is_named(tmp_path, bones) -> None:
    with pytest.raises(PlanError, match=r"none\.toml cannot be read"):
        read_contents(tmp_path / "none.toml", bones)
