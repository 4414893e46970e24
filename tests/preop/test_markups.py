"""3D Slicer's markups: spaces, points that were never placed, and what names mean."""

import json

import numpy as np
import pytest

from navapp.errors import PlanError
from navapp.preop.markups import read_markups
from navapp.values import BoneModel
from tests.geometry.shapes import sphere

BONES = {
    "femur": BoneModel("femur", sphere(30.0, 30)),
    "tibia": BoneModel("tibia", sphere(25.0, 30, (0.0, 0.0, -60.0))),
}


def points(*positions, labels=(), **more) -> list[dict]:
    return [
        {"label": labels[k] if labels else f"F-{k + 1}", "position": list(place),
         "positionStatus": "defined", **more}
        for k, place in enumerate(positions)
    ]  # fmt: skip


def markup(kind: str, control_points, **more) -> dict:
    return {
        "type": kind,
        "coordinateSystem": "LPS",
        "coordinateUnits": "mm",
        "controlPoints": control_points,
        **more,
    }


@pytest.fixture
def read(tmp_path):
    def run(name: str, *markups):
        file = tmp_path / f"{name}.mrk.json"
        file.write_text(json.dumps({"@schema": "x", "markups": markups}), encoding="utf-8")
        return read_markups(file, BONES)

    return run


LINE = points((0.0, 5.0, -30.0), (0.0, 5.0, -5.0))


def test_a_line_named_drill_is_an_axis_and_the_file_gives_its_name(read) -> None:
    planned = read("drill femur guide 8.5mm", markup("Line", LINE))
    axis = planned.content.drills["guide"]
    np.testing.assert_allclose(axis.entry_mm, [0.0, 5.0, -30.0])
    np.testing.assert_allclose(axis.direction, [0.0, 0.0, 1.0])
    assert (axis.bone, axis.depth_mm, axis.diameter_mm) == ("femur", 25.0, 8.5)
    assert not planned.warnings


@pytest.mark.parametrize("space", ["RAS", "0", 0])
def test_ras_is_turned_and_old_numbers_are_known(read, space) -> None:
    planned = read("drill tibia 8 mm", markup("Line", LINE, coordinateSystem=space))
    axis = planned.content.drills["tibia"]
    np.testing.assert_allclose(axis.entry_mm, [0.0, -5.0, -30.0])
    np.testing.assert_allclose(axis.direction, [0.0, 0.0, 1.0])


@pytest.mark.parametrize("space", ["LPS", "1", 1, None])
def test_lps_is_taken_as_it_is_and_is_the_default(read, space) -> None:
    one = markup("Line", LINE, coordinateSystem=space)
    if space is None:
        del one["coordinateSystem"]
    planned = read("drill 8mm", one)
    np.testing.assert_allclose(planned.content.drills["femur"].entry_mm, [0.0, 5.0, -30.0])


def test_points_that_were_never_placed_are_left_out_and_told(read) -> None:
    placed = points((1.0, 2, 3), labels=("femur/medial_epicondyle",))
    waiting = points((0, 0, 0), labels=("femur/lateral_epicondyle",), positionStatus="undefined")
    seen = points((0, 0, 0), labels=("femur/notch",), positionStatus="preview")
    planned = read("F", markup("Fiducial", [*placed, *waiting, *seen]))
    assert set(planned.content.landmarks) == {"femur/medial_epicondyle"}
    assert planned.content.landmarks["femur/medial_epicondyle"].sd_mm is None
    assert ["lateral_epicondyle" in w and "never placed" in w for w in planned.warnings] == [
        True,
        False,
    ]


def test_a_simple_file_without_states_has_its_points(read) -> None:
    """As the documentation of 3D Slicer writes them by hand."""
    entry = {"label": "femur/hip_centre", "position": [0.0, 0.0, 400.0]}
    planned = read("F", {"type": "Fiducial", "controlPoints": [entry]})
    assert planned.content.landmarks["femur/hip_centre"].point_mm[2] == 400.0


def test_the_smaller_part_of_the_bone_is_what_a_plane_removes(read) -> None:
    low = [0.0, 0.0, -20.0]
    for normal in ([0.0, 0.0, 1.0], [0.0, 0.0, -1.0]):
        one = markup("Plane", points(low), center=low, normal=normal, size=[70.0, 50.0, 0.0])
        plane = read("resection femur distal", one).content.planes["distal"]
        np.testing.assert_allclose(plane.normal, [0.0, 0.0, -1.0])
        assert plane.extent_mm == (70.0, 50.0)


def test_three_points_make_a_plane(read) -> None:
    corners = points((10.0, 0, -20), (0, 10.0, -20), (-10.0, 0, -20))
    plane = read("resection femur", markup("Plane", corners)).content.planes["femur"]
    np.testing.assert_allclose(plane.normal, [0.0, 0.0, -1.0])
    assert plane.point_mm[2] == -20.0


def test_a_plane_whose_points_and_normal_disagree_is_refused(read) -> None:
    corners = points((10.0, 0, -20), (0, 10.0, -20), (-10.0, 0, -20))
    for wrong in ({"normal": [0.0, 0.1, 1.0]}, {"center": [0.0, 0.0, -21.0]}):
        with pytest.raises(PlanError, match="beside its own plane"):
            read("resection femur", markup("Plane", corners, **wrong))


def test_curves_are_risks_with_the_distance_in_their_name(read) -> None:
    way = points((0.0, 40.0, 30.0), (0.0, 42.0, 0.0), (0.0, 40.0, -30.0))
    planned = read("nerve tibia common peroneal 6mm", markup("Curve", way))
    risk = planned.content.risks["nerve_common_peroneal"]
    assert (risk.bone, risk.safety_mm) == ("tibia", 6.0)
    assert planned.curves["nerve_common_peroneal"].shape == (3, 3)
    bare = read("artery", markup("Curve", way))
    assert bare.content.risks["artery"].safety_mm == 0.0
    assert "no safety distance" in bare.warnings[0]


def test_a_closed_curve_or_points_paint_a_defect(read) -> None:
    outline = points((8.0, -8, 27), (8.0, 8, 27), (-8.0, 8, 27), (-8.0, -8, 27))
    drawn = read("defect femur", markup("ClosedCurve", outline)).content.defects["femur"]
    spot = read("defect femur medial", markup("Fiducial", points((0.0, 0, 30)))).content.defects
    assert set(spot["medial"].vertices) < set(drawn.vertices)
    with pytest.raises(PlanError, match="paints nothing"):
        read("defect femur", markup("Fiducial", points((0.0, 0, 300))))


def test_points_named_target_are_targets(read) -> None:
    planned = read("target femur condyles", markup("Fiducial", points((1.0, 2, 3), (4, 5, 6))))
    np.testing.assert_array_equal(planned.targets["femur/condyles"], [[1, 2, 3], [4, 5, 6]])


def test_the_name_of_a_markup_wins_over_that_of_its_file(read) -> None:
    planned = read("F", markup("Line", LINE, name="drill femur guide 8mm"))
    assert set(planned.content.drills) == {"guide"}


def test_a_name_that_says_nothing_is_told(read) -> None:
    planned = read("L", markup("Line", LINE), markup("Fiducial", points((1.0, 2, 3))))
    assert planned.content.is_empty
    assert len(planned.warnings) == 2
    assert "'L' says nothing" in planned.warnings[0]


@pytest.mark.parametrize(
    ("name", "one", "words"),
    [
        ("drill femur", markup("Line", LINE), "call it 'drill femur 8mm'"),
        ("drill femur 8mm", markup("Line", LINE[:1]), "not two points"),
        ("drill femur 8mm", markup("Line", LINE, coordinateUnits="cm"), "in cm"),
        ("drill femur 8mm", markup("Line", LINE, coordinateSystem="IJK"), "space IJK"),
        ("drill patella 8mm", markup("Line", LINE), "has no patella"),
        ("drill femur 8mm", markup("Line", points((0, 0), (1, 1))), "three finite numbers"),
        ("resection femur", markup("Plane", []), "is no plane"),
        ("nerve femur", markup("Curve", LINE[:1]), "fewer than two points"),
        ("defect femur", markup("ClosedCurve", LINE), "fewer than three points"),
        ("target femur", markup("Fiducial", []), "has no points"),
    ],
)
def test_a_markup_that_cannot_be_used_is_refused_with_the_remedy(read, name, one, words) -> None:
    with pytest.raises(PlanError) as caught:
        read(name, one)
    assert words in str(caught.value)
    assert caught.value.remedy


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"markups": [3]}', '{"markups": [{}]}'])
def test_what_is_no_markups_file_is_refused(tmp_path, text) -> None:
    file = tmp_path / "a.mrk.json"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(PlanError, match="is no markups file"):
        read_markups(file, BONES)
    with pytest.raises(PlanError, match="cannot be read"):
        read_markups(tmp_path / "none.mrk.json", BONES)


def test_the_same_name_twice_is_refused(read) -> None:
    with pytest.raises(PlanError, match="'femur' is given twice among the drills"):
        read("drill femur 8mm", markup("Line", LINE), markup("Line", LINE))
