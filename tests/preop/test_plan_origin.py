"""Where a plan's surfaces come from: into plan.json and back, and onto its page."""

import json

import pytest

from navapp.preop.plan_origin import PlanOrigin, origin_from_json, origin_to_json
from navapp.preop.plan_summary import make_summary_page
from navapp.preop.plan_view import make_plan_view
from navapp.values import BoneModel, Plan
from tests.geometry.shapes import sphere

CT = PlanOrigin(
    "CT", "Knee <right> 0.6", (0.5, 0.5, 0.8), (400, 300, 200), 200.0, 1210.0, (0.52, 0.61),
    {"femur": 0.973}, ("fibula: not found in the CT",),
)  # fmt: skip


@pytest.mark.parametrize(
    "origin", [CT, PlanOrigin(), PlanOrigin("labels", "", (1.0,) * 3, (9,) * 3)]
)
def test_it_comes_back_from_a_file(origin) -> None:
    assert origin_from_json(json.loads(json.dumps(origin_to_json(origin)))) == origin


def test_an_unknown_kind_is_refused() -> None:
    with pytest.raises(ValueError, match="unknown kind dream"):
        origin_from_json({**origin_to_json(CT), "kind": "dream"})


def test_programs_are_told_of_no_volume_where_there_was_none() -> None:
    assert PlanOrigin().ct is None
    assert CT.ct["threshold_hu"] == 200.0


def test_the_page_says_what_is_needed_to_decide(tmp_path) -> None:
    plan = Plan({"femur": BoneModel("femur", sphere(40.0, 20))})
    page = make_summary_page(make_plan_view(plan, CT), tmp_path)
    for words in (
        "Knee &lt;right&gt; 0.6", "400 x 300 x 200 of 0.5 x 0.5 x 0.8 mm", "above 200 HU",
        "1210 HU, found in this CT", "0.52 mm in the slices, 0.61 mm across",
        "fibula: not found in the CT", "<td>97 %</td>", "<td>unknown</td>", "cm3",
        "not for clinical use",
    ):  # fmt: skip
        assert words in page
