"""Facts of a plan in words."""

import numpy as np

from navapp.preop import PlanOrigin, make_even_cartilage, make_plan_view
from navapp.preop.plan_facts import make_bone_rows, make_origin_rows
from navapp.values import BoneModel, Plan
from tests.geometry.shapes import sphere

FEMUR = BoneModel("femur", sphere(20.0, 30), "left", surface_sd_mm=0.07)


def test_where_a_plan_from_a_ct_comes_from_is_told_with_its_digest() -> None:
    origin = PlanOrigin(
        "CT", "knee", (0.5, 0.5, 0.8), (200, 210, 150), 200.0, 1220.4, (0.5, 0.6), {"femur": 0.98}
    )
    plan = Plan({"femur": FEMUR})
    rows = dict(make_origin_rows(make_plan_view(plan, origin)))
    assert rows["digest"] == plan.digest
    assert rows["made from"] == "CT"
    assert rows["series"] == "knee"
    assert rows["voxels"] == "200 x 210 x 150 of 0.5 x 0.5 x 0.8 mm"
    assert rows["density of cortex"].startswith("1220 HU")
    bare = dict(make_origin_rows(make_plan_view(plan)))
    assert bare == {"digest": plan.digest, "made from": "surfaces"}


def test_points_that_no_slice_shows_are_named() -> None:
    targets = {"femur/hip_centre": np.array([0.0, 0.0, 400.0]), "femur/entry": np.zeros(3)}
    rows = dict(make_origin_rows(make_plan_view(Plan({"femur": FEMUR}, targets))))
    assert rows["beyond the slices"] == "femur/hip_centre"


def test_a_bone_s_size_side_and_cartilage_are_told() -> None:
    rows = dict(make_bone_rows(FEMUR, PlanOrigin("CT", measured={"femur": 0.98})))
    assert rows["side"] == "left"
    assert rows["size"] == "40 x 40 x 40 mm"
    assert abs(float(rows["volume"].split()[0]) - 4.0 / 3.0 * np.pi * 8.0) < 0.5
    assert rows["edge measured"] == "98 %"
    assert rows["moves a pose (sd)"] == "0.07 mm"
    assert rows["cartilage"] == "none known"
    covered = dict(make_bone_rows(make_even_cartilage(FEMUR, 2.0, 0.5), PlanOrigin()))
    assert covered["cartilage"] == "mean 2.0, max 2.0, sd 0.5 mm, on 100 %"
    assert covered["edge measured"] == "-"
    assert list(covered) == list(rows)
    other = dict(make_bone_rows(BoneModel("tibia", sphere(9.0, 9)), PlanOrigin()))
    assert (other["side"], other["moves a pose (sd)"]) == ("unknown", "unknown")
