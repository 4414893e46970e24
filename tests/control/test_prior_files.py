import json

import numpy as np
import pytest

from navapp.control.prior_files import prior_from_json, prior_to_json, read_prior
from navapp.errors import PriorError
from navapp.geometry.directions import ViewCone
from navapp.geometry.transform import RigidTransform
from navapp.values import Prior

FROM_FRONT = ViewCone(np.array([0.0, -2.0, 0.0]), 25.0)


def test_cones_of_several_bones_come_back() -> None:
    known = Prior(cones={"femur": FROM_FRONT, "tibia": ViewCone(np.array([1.0, 0.0, 0.0]))})
    content = json.loads(json.dumps(prior_to_json(known)))
    assert set(content) == {"approach_cone", "approach_cone_tibia"}
    again = prior_from_json(content)
    np.testing.assert_array_equal(again.cones["femur"].axis, [0.0, -1.0, 0.0])
    assert again.cones["femur"].half_angle_deg == 25.0
    assert again.cones["tibia"].half_angle_deg == 180.0


@pytest.mark.parametrize("axis", [[0, 0, 0], [1, 2], "up", None])
def test_a_cone_without_a_direction_is_refused(axis: object, tmp_path) -> None:
    path = tmp_path / "prior.json"
    path.write_text(json.dumps({"approach_cone_tibia": {"axis": axis, "half_angle_deg": 10}}))
    with pytest.raises(PriorError, match="is damaged"):
        read_prior(path)


@pytest.mark.parametrize("half_angle_deg", [-5, 0, 999, "nan"])
def test_a_half_angle_that_is_none_is_refused(half_angle_deg: object, tmp_path) -> None:
    path = tmp_path / "prior.json"
    cone = {"axis": [0, 0, 1], "half_angle_deg": half_angle_deg}
    path.write_text(json.dumps({"approach_cone": cone}))
    with pytest.raises(PriorError, match="half angle"):
        read_prior(path)


def test_a_usual_cone_stands_in_where_nothing_better_is_known() -> None:
    usual = {name: ViewCone(np.array([0.0, 0.0, 1.0]), 40.0) for name in ("femur", "tibia")}
    assert Prior().with_cones(usual).cones == usual
    assert Prior(cones={"femur": FROM_FRONT}).with_cones(usual).cones["femur"] is FROM_FRONT
    posed = Prior({"femur": RigidTransform("left", "femur", np.eye(4))}).with_cones(usual)
    assert list(posed.cones) == ["tibia"]
    assert Prior().with_cones(usual).has_start("tibia")
    assert not Prior().with_cones(usual).has_start("patella")
