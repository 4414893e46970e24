"""A plan made whole: side, landmarks, default targets, and what is warned of."""

import numpy as np
import pytest

from navapp.errors import PlanError
from navapp.geometry.mesh import TriangleMesh
from navapp.preop.plan_completion import complete, with_side
from navapp.preop.planned_content import PlannedContent
from navapp.values import (
    BoneModel,
    DrillAxis,
    Landmark,
    Plan,
    StageContent,
    SurgicalContent,
)
from tests.geometry.shapes import sphere
from tests.preop.knees import bones_of, fibula_of, knees

KNEE = knees()[0]
Z = np.array([0.0, 0.0, 1.0])


@pytest.fixture
def plan() -> Plan:
    return Plan(bones_of(KNEE))


def test_a_plan_of_surfaces_gets_landmarks_targets_and_stages(plan) -> None:
    whole, warnings = complete(plan, PlannedContent())
    assert whole.digest != plan.digest
    assert whole.content.landmarks["femur/medial_condyle"].source == "surface"
    assert set(whole.content.stages) == {"opening", "drilling", "implant", "patella", "spacer"}
    assert len(whole.targets_of(whole.content.stages["opening"].targets)) == 36
    assert [w.split(" is not given")[0] for w in warnings] == ["the hip centre", "the ankle centre"]


def test_what_is_given_replaces_what_is_estimated(plan) -> None:
    given = Landmark(np.array([1.0, 2.0, 3.0]), None, "contents")
    centres = {"femur/hip_centre": given, "femur/medial_condyle": given}
    planned = PlannedContent(SurgicalContent(landmarks=centres), absent=("tibia/ankle_centre",))
    whole, warnings = complete(plan, planned)
    assert whole.content.landmarks["femur/medial_condyle"] is given
    assert whole.content.landmarks["femur/lateral_condyle"].source == "surface"
    assert not warnings


def test_what_lies_far_from_its_bone_is_told_and_so_is_ras() -> None:
    """The knee lies to the right of the scanner's middle, as one of two does."""
    beside = np.array([-90.0, 20.0, 0.0])
    femur = KNEE.bones["femur"]
    moved = TriangleMesh(femur.vertices_mm + beside, femur.faces)
    plan = Plan({"femur": BoneModel("femur", moved, "right")})
    entry = KNEE.landmarks["femur/notch"] + beside
    in_ras = DrillAxis("femur", entry * (-1.0, -1.0, 1.0), Z, 20.0, 8.0)
    beyond = DrillAxis("femur", entry + 200.0, Z, 20.0, 8.0)
    here = DrillAxis("femur", entry, Z, 20.0, 8.0)
    drills = {"ras": in_ras, "far": beyond, "here": here}
    _, warnings = complete(plan, PlannedContent(SurgicalContent(drills=drills)))
    about = {name: [w for w in warnings if f"drill '{name}'" in w] for name in drills}
    assert "looks like RAS" in about["ras"][0]
    assert "mm from the femur" in about["far"][0]
    assert "RAS" not in about["far"][0]
    assert about["here"] == []


def test_a_stage_that_names_what_nobody_gave_is_refused(plan) -> None:
    stages = {"drilling": StageContent("femur", drills=("guide",))}
    with pytest.raises(PlanError, match=r"stage drilling.*'guide'.*give it"):
        complete(plan, PlannedContent(SurgicalContent(stages=stages)))


def test_a_stage_may_name_what_another_file_gives(plan) -> None:
    stages = PlannedContent(
        SurgicalContent(stages={"drilling": StageContent("femur", drills=("a",))})
    )
    entry = KNEE.landmarks["femur/notch"]
    drill = PlannedContent(SurgicalContent(drills={"a": DrillAxis("femur", entry, Z, 20.0, 8.0)}))
    whole, _ = complete(plan, stages.union(drill))
    assert whole.content.stages["drilling"].drills == ("a",)
    with pytest.raises(PlanError, match="given twice"):
        drill.union(drill)


@pytest.fixture
def sideless() -> dict[str, BoneModel]:
    return {name: BoneModel(name, mesh) for name, mesh in KNEE.bones.items()}


def test_a_side_that_is_not_given_is_estimated_and_said(sideless) -> None:
    bones, said = with_side(sideless, None)
    assert {bone.side for bone in bones.values()} == {"right"}
    assert "taken to be right, which is likely" in said[0]
    assert "--side" in said[0]
    _, said = with_side(sideless, None, fibula_of(KNEE))
    assert "which is certain" in said[0]


def test_a_side_that_cannot_be_told_stays_unknown() -> None:
    bones, said = with_side({"femur": BoneModel("femur", KNEE.bones["patella"])}, None)
    assert bones["femur"].side is None
    assert "the side is unknown" in said[0]


def test_a_given_side_that_contradicts_a_certain_estimate_is_refused(sideless) -> None:
    with pytest.raises(PlanError, match="certainly of a right knee: fibula") as refused:
        with_side(sideless, "left", fibula_of(KNEE))
    assert "--side-anyway" in refused.value.remedy
    bones, said = with_side(sideless, "left", fibula_of(KNEE), is_sure=True)
    assert bones["femur"].side == "left"
    assert "certainly of a right knee" in said[0]
    assert with_side(sideless, "right", fibula_of(KNEE))[1] == []


def test_a_given_side_that_contradicts_the_shapes_is_warned_of(sideless) -> None:
    bones, said = with_side(sideless, "left")
    assert bones["femur"].side == "left"
    assert said[0].startswith(
        "--side says left, but the bones are by their shapes of a right knee:"
    )
    assert with_side(sideless, "right")[1] == []


BALL = sphere(60.0, 30)
ODD = {
    "ball": BALL,
    "box": TriangleMesh(np.clip(BALL.vertices_mm, -25.0, 25.0), BALL.faces),
    "plate": TriangleMesh(BALL.vertices_mm * (1.0, 1.0, 0.0), BALL.faces),
    "rod": TriangleMesh(BALL.vertices_mm * (0.1, 0.1, 2.0), BALL.faces),
    "one condyle": TriangleMesh(
        np.maximum(KNEE.bones["femur"].vertices_mm, [0.0, -99.0, -99.0]), KNEE.bones["femur"].faces
    ),
}


@pytest.mark.parametrize("name", ODD)
@pytest.mark.parametrize("names", [("femur",), ("tibia",), ("patella",), ("femur", "tibia")])
def test_a_plan_of_what_is_no_knee_is_made_all_the_same(name, names) -> None:
    """Whoever gives such a surface sees it in the pictures; nothing may stumble over it."""
    bones, said = with_side({bone: BoneModel(bone, ODD[name]) for bone in names}, None)
    assert all("certain" not in sentence for sentence in said)
    whole, _ = complete(Plan(bones), PlannedContent())
    assert set(whole.bones) == set(names)
