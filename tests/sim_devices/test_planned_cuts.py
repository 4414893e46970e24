import numpy as np
import pytest

from sim_devices.anatomy import KneeSpec, make_knee
from sim_devices.planned_cuts import RESECTION_MM, make_planned_cuts

KNEES = [
    KneeSpec(1),
    KneeSpec(2, "left", "male", "old"),
    *(
        KneeSpec(seed, sex=sex, age_group="young")
        for seed in range(3, 8)
        for sex in ("female", "male")
    ),
]


@pytest.mark.release
@pytest.mark.parametrize("spec", KNEES)
def test_every_cut_takes_off_what_it_should(spec) -> None:
    knee = make_knee(spec)
    cuts = make_planned_cuts(knee)
    assert len(cuts) == 7
    removed = {}
    for name, cut in cuts.items():
        vertices = knee.bones[cut.bone].vertices_mm
        along = np.abs((vertices - cut.point_mm) @ cut.axes.T)
        is_over = (along <= 0.5 * np.array(cut.extent_mm)).all(axis=1)
        removed[name] = float(cut.heights_mm(vertices)[is_over].max())
        assert np.linalg.norm(cut.normal) == pytest.approx(1.0)
    assert removed["femur_distal"] == pytest.approx(RESECTION_MM, abs=0.1)
    assert removed["femur_posterior"] == pytest.approx(RESECTION_MM, abs=0.1)
    assert removed["patella"] == pytest.approx(RESECTION_MM, abs=1.0)
    assert 5.0 < removed["femur_anterior"] < 11.0
    # From the lateral plateau to the tip of the spines.
    assert RESECTION_MM < removed["tibia_proximal"] < 20.0


@pytest.mark.release
def test_the_anterior_cut_never_notches_the_shaft() -> None:
    for seed in (1, 2, 3):
        knee = make_knee(KneeSpec(seed, sex="male"))
        vertices = knee.bones["femur"].vertices_mm
        shaft = vertices[:, 2] > knee.landmarks["femur/anterior_cortex"][2] - 5.0
        assert make_planned_cuts(knee)["femur_anterior"].heights_mm(vertices[shaft]).max() < 0.0


def test_a_left_knee_is_cut_as_the_mirror_image_of_the_right_one() -> None:
    right, left = (make_planned_cuts(make_knee(KneeSpec(1, side))) for side in ("right", "left"))
    for name, cut in right.items():
        np.testing.assert_allclose(left[name].point_mm, cut.point_mm * (-1.0, 1.0, 1.0))
        np.testing.assert_allclose(left[name].normal, cut.normal * (-1.0, 1.0, 1.0), atol=1e-12)
