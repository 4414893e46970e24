"""Default targets: on the joint's surfaces, spread, the same every time."""

import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.distance import pdist

from navapp.preop.default_targets import make_default_targets, with_defaults
from navapp.values import BoneModel, StageContent
from tests.geometry.shapes import sphere
from tests.preop.knees import bones_of, knees


@pytest.mark.release
def test_targets_are_spread_over_the_surfaces_that_meet_in_the_joint() -> None:
    for knee in knees()[:6]:
        targets = make_default_targets(bones_of(knee))
        assert set(targets) == {
            "femur/weight_bearing", "femur/trochlea", "tibia/plateau", "patella/back"
        }  # fmt: skip
        femur, tibia, patella = (
            cKDTree(knee.bones[name].vertices_mm) for name in ("femur", "tibia", "patella")
        )
        for name, points in targets.items():
            bone = {"femur": femur, "tibia": tibia, "patella": patella}[name.split("/")[0]]
            assert bone.query(points)[0].max() == 0.0
            assert pdist(points).min() > 2.0
            assert len(points) in (12, 24)
        # The two bones face each other there: a joint gap and a little more, sideways.
        assert np.median(tibia.query(targets["femur/weight_bearing"])[0]) < 12.0
        assert np.median(femur.query(targets["tibia/plateau"])[0]) < 12.0
        assert np.median(femur.query(targets["patella/back"])[0]) < 12.0
        assert np.ptp(targets["femur/weight_bearing"][:, 0]) > 30.0
        again = make_default_targets(bones_of(knee))
        assert all(again[name].tobytes() == points.tobytes() for name, points in targets.items())


def test_both_condyles_have_as_many() -> None:
    knee = knees()[0]
    points = make_default_targets(bones_of(knee))["femur/weight_bearing"]
    assert (points[:, 0] > 0.0).sum() == (points[:, 0] < 0.0).sum() == 12


def test_what_is_no_knee_has_no_targets() -> None:
    assert "femur/weight_bearing" not in make_default_targets(
        {"femur": BoneModel("femur", sphere(9.0))}
    )


def test_stages_are_judged_by_the_targets_of_their_bone() -> None:
    knee = knees()[0]
    given = {"femur/mine": np.ones((1, 3))}
    planned = {"opening": StageContent("femur", ("femur/mine",)), "spacer": StageContent("patella")}
    targets, stages = with_defaults(bones_of(knee), given, planned)
    assert set(targets) == {"femur/mine", "tibia/plateau", "patella/back"}
    assert stages["opening"] == planned["opening"]
    assert "drilling" not in stages
    assert stages["patella"] == StageContent("patella", ("patella/back",))
    # A stage may follow another bone than usual.
    assert stages["spacer"] == StageContent("patella", ("patella/back",))
