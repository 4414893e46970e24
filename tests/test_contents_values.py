"""Surgical content as values: what it refuses, and that a plan's hash covers all of it."""

from dataclasses import fields, replace

import numpy as np
import pytest

from navapp.geometry.transform import RigidTransform, rotation_from_vector
from navapp.values import (
    BoneModel,
    Box,
    Cylinder,
    Defect,
    DrillAxis,
    Landmark,
    Part,
    Plan,
    ResectionPlane,
    RiskStructure,
    Sphere,
    StageContent,
    StageSpec,
    SurgicalContent,
)
from tests.geometry.shapes import cube, sphere

POSE = RigidTransform.from_parts("femur", "a", rotation_from_vector((0.1, 0.2, 0.3)), (1, 2, 3))
Z = np.array([0.0, 0.0, 1.0])


def whole_content(**changes) -> SurgicalContent:
    content = {
        "planes": {"cut": ResectionPlane("femur", np.array([1.0, 2, 3]), np.array([0, 0.3, -2.0]))},
        "drills": {"hole": DrillAxis("femur", np.array([4.0, 5, 6]), np.array([1, 1, 1]), 25, 8)},
        "parts": {
            "a": Part("implant", Box((3.0, 4.0, 5.0)), POSE),
            "b": Part("implant", Cylinder(30.0, 9.0), POSE),
            "c": Part("spacer", Sphere(7.0), POSE),
            "d": Part("spacer", sphere(5.0, 6), POSE),
        },
        "risks": {
            "nerve": RiskStructure("femur", 5.0),
            "artery": RiskStructure("femur", 3.0, sphere(4.0, 6)),
        },
        "landmarks": {"femur/hip_centre": Landmark(np.array([0, 0, 400.0]), None, "contents")},
        "defects": {"worn": Defect("femur", np.array([5, 2, 2]))},
        "stages": {
            "drilling": StageContent("femur", ("femur/a",), ("cut",), ("hole",), ("a",), ("nerve",))
        },
    }
    return SurgicalContent(**{**content, **changes})


def whole_plan(**changes) -> Plan:
    """A plan that has something of everything."""
    return Plan(
        {"femur": BoneModel("femur", sphere(30.0, 10), "right")},
        {"femur/a": np.array([[1.0, 2, 3]])},
        {"nerve": np.array([[0.5, 0.5, 0.5], [1, 1, 1]])},
        content=whole_content(**changes),
    )


def _other(content: SurgicalContent, table: str, name: str, /, **changes) -> dict:
    entries = dict(getattr(content, table))
    entries[name] = replace(entries[name], **changes)
    return {table: entries}


CHANGES = [
    *({one.name: {}} for one in fields(SurgicalContent) if one.name not in (
        "planes", "drills", "parts", "risks")),
    _other(whole_content(), "planes", "cut", point_mm=np.array([1.0, 2, 3.0000001])),
    _other(whole_content(), "planes", "cut", normal=Z),
    _other(whole_content(), "planes", "cut", bone="tibia"),
    _other(whole_content(), "planes", "cut", extent_mm=(60.0, 80.0)),
    _other(whole_content(), "drills", "hole", direction=Z),
    _other(whole_content(), "drills", "hole", depth_mm=25.5),
    _other(whole_content(), "drills", "hole", diameter_mm=8.5),
    _other(whole_content(), "parts", "a", kind="spacer"),
    _other(whole_content(), "parts", "a", shape=Box((4.0, 3.0, 5.0))),
    _other(whole_content(), "parts", "b", shape=Cylinder(9.0, 30.0)),
    _other(whole_content(), "parts", "c", shape=Sphere(7.5)),
    _other(whole_content(), "parts", "d", shape=sphere(5.0, 7)),
    _other(whole_content(), "parts", "a", bone_from_part=RigidTransform.identity("femur", "a")),
    _other(whole_content(), "risks", "nerve", safety_mm=4.0),
    _other(whole_content(), "risks", "artery", mesh=sphere(4.5, 6)),
    _other(whole_content(), "landmarks", "femur/hip_centre", sd_mm=0.0),
    _other(whole_content(), "landmarks", "femur/hip_centre", source="markups"),
    _other(whole_content(), "defects", "worn", vertices=np.array([2, 6])),
    _other(whole_content(), "stages", "drilling", targets=()),
    _other(whole_content(), "stages", "drilling", bone="tibia"),
]  # fmt: skip


def test_the_digest_covers_all_of_the_content() -> None:
    digests = [whole_plan().digest, *(whole_plan(**change).digest for change in CHANGES)]
    assert len(set(digests)) == len(digests)
    assert whole_plan().digest == digests[0]


def test_a_plan_without_content_keeps_the_hash_that_it_had_before_there_was_any() -> None:
    """Written down before plans had surgical content."""
    femur = BoneModel("femur", cube(40.0), "left")
    plan = Plan({"femur": femur}, {"femur/a": np.array([[1.0, 2, 3]])})
    assert plan.digest == "43fa3f3d8673"


def test_directions_become_units_and_a_unit_keeps_its_bits() -> None:
    axis = DrillAxis("femur", np.zeros(3), np.array([3.0, 0.0, 4.0]), 20.0, 8.0)
    np.testing.assert_allclose(axis.direction, [0.6, 0.0, 0.8])
    again = DrillAxis("femur", np.zeros(3), axis.direction, 20.0, 8.0)
    assert again.direction.tobytes() == axis.direction.tobytes()


def test_the_corners_of_a_plane_lie_in_it_at_its_extent() -> None:
    for normal in (np.array([0.2, -0.1, -1.0]), np.array([1.0, 0.0, 0.01])):
        plane = ResectionPlane("femur", np.array([5.0, 6.0, 7.0]), normal, (80.0, 60.0))
        corners = plane.corners_mm()
        np.testing.assert_allclose((corners - plane.point_mm) @ plane.normal, 0.0, atol=1e-9)
        sides = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
        np.testing.assert_allclose(sides, [80.0, 60.0, 80.0, 60.0])
        turned = np.cross(corners[1] - corners[0], corners[2] - corners[1])
        assert turned @ plane.normal > 0.0


@pytest.mark.parametrize(
    "make",
    [
        lambda: ResectionPlane("femur", np.zeros(3), np.zeros(3)),
        lambda: ResectionPlane("femur", np.zeros(2), Z),
        lambda: ResectionPlane("femur", np.zeros(3), Z, (0.0, 5.0)),
        lambda: DrillAxis("femur", np.array([0, 0, np.nan]), Z, 5.0, 5.0),
        lambda: DrillAxis("femur", np.zeros(3), Z, -5.0, 5.0),
        lambda: DrillAxis("femur", np.zeros(3), Z, 5.0, np.inf),
        lambda: Box((1.0, 0.0, 1.0)),
        lambda: Cylinder(0.0, 1.0),
        lambda: Sphere(np.nan),
        lambda: RiskStructure("femur", -1.0),
        lambda: Landmark(np.zeros(3), -0.1, "contents"),
        lambda: Defect("femur", np.array([-1])),
        lambda: whole_plan(
            risks={"nerve": RiskStructure("femur", 5.0), "x": RiskStructure("f", 1)}
        ),
        lambda: whole_plan(defects={"worn": Defect("femur", np.array([100_000]))}),
        lambda: whole_plan(defects={"worn": Defect("tibia", np.array([0]))}),
        lambda: whole_plan(stages={"drilling": StageContent("femur", drills=("none",))}),
        lambda: whole_plan(stages={"drilling": StageContent("femur", ("femur/none",))}),
    ],
)
def test_what_cannot_be_is_refused(make) -> None:
    with pytest.raises(ValueError, match=r"[a-z]"):
        make()


def test_a_plan_gives_its_stages_bones_and_targets() -> None:
    spec = StageSpec(2, "drilling", "tibia", 1.0, 1.0, ("femur/notch",), ("bone",), ())
    planned = whole_plan().stage(spec)
    assert (planned.bone, planned.targets) == ("femur", ("femur/a",))
    assert replace(planned, bone="tibia", targets=("femur/notch",)) == spec
    usual = whole_plan(stages={"drilling": StageContent("femur")}).stage(spec)
    assert (usual.bone, usual.targets) == ("femur", ("femur/notch",))
    other = replace(spec, name="spacer")
    assert whole_plan().stage(other) is other
