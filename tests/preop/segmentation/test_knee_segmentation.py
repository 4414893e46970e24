import numpy as np
import pytest

from navapp.errors import PlanError
from navapp.preop.segmentation import segment
from tests.many import few_of
from tests.preop.ct_phantoms import (
    AIR_HU,
    SOFT_HU,
    box,
    ct_of,
    hollow_box,
    lattice,
    points_of,
)

SPACING_MM = (0.9, 0.9, 1.0)
SIZE = (76, 92, 88)
# A right knee of boxes, 1.6 mm from femur to tibia; blur as fine as the lattice shows.
KNEE_MM = {
    "femur": ((-20.0, -16.0, 0.8), (20.0, 16.0, 38.0)),
    "tibia": ((-19.0, -16.0, -38.0), (19.0, 14.0, -0.8)),
    "patella": ((-12.0, -36.0, 4.0), (12.0, -17.6, 28.0)),
    "fibula": ((-16.0, 15.6, -39.0), (4.0, 33.0, -8.0)),
}
MIDDLES_MM = {name: np.mean(edges, axis=0) for name, edges in KNEE_MM.items()}


def ct_of_bones(bones, size=SIZE, middle_mm=(0.0, 0.0, 0.0), shift_mm=(0.0, 0.0, 0.0)):
    """Bones in a leg in air."""
    matrix = lattice(size, SPACING_MM, middle_mm=middle_mm)
    points = points_of(size, matrix) - np.array(shift_mm)
    far = 1000.0
    lower, upper = (np.array(c) for c in ((-90.0, -39.0, -far), (200.0, 37.0, far)))
    hu = AIR_HU + (SOFT_HU - AIR_HU) * box(points, lower, upper)
    hu = hu + sum(hollow_box(points, *edges, 1.5) for edges in bones)
    return ct_of(hu, matrix, 20.0)


@pytest.fixture(scope="module")
def knee():
    return ct_of_bones(KNEE_MM.values())


@pytest.fixture(scope="module")
def found(knee):
    steps = []
    return segment(knee, tell=steps.append), steps


def test_a_knee_is_told_apart_and_named(knee, found):
    segmentation, steps = found
    assert set(segmentation.names) == set(KNEE_MM)
    assert segmentation.warnings == ()
    assert len(steps) == 4
    ct, bones = segmentation.ct, segmentation.bones
    assert bones.shape == ct.hu.shape
    points = points_of(ct.size, ct.lps_from_index)
    for name, number in segmentation.names.items():
        lower, upper = (np.array(edge) for edge in KNEE_MM[name])
        inside = ((points > lower + 0.6) & (points < upper - 0.6)).all(axis=-1)
        around = ((points > lower - 1.2) & (points < upper + 1.2)).all(axis=-1)
        assert (bones[inside] == number).mean() > 0.998
        assert not (bones[~around] == number).any()


def test_the_box_lies_where_it_was_cut_out(knee, found):
    ct = found[0].ct
    first = np.rint(knee.indices_of(ct.points_lps_mm([[0, 0, 0]]))[0]).astype(int)
    i, j, k = first
    n_i, n_j, n_k = ct.size
    np.testing.assert_array_equal(ct.hu, knee.hu[k : k + n_k, j : j + n_j, i : i + n_i])
    assert n_i * n_j * n_k < np.prod(knee.size)


@pytest.mark.release
def test_seeds_name_what_they_lie_in(knee):
    seeds = {"femur": MIDDLES_MM["femur"], "tibia": MIDDLES_MM["fibula"]}
    named = segment(knee, seeds=seeds)
    i, j, k = np.rint(named.ct.indices_of([MIDDLES_MM["fibula"]])[0]).astype(int)
    assert named.bones[k, j, i] == named.names["tibia"]
    assert "fibula: not found in the CT" in named.warnings


def test_a_seed_in_no_bone_is_refused(knee):
    seeds = {"patella": np.array([-30.0, -30.0, -38.0])}
    with pytest.raises(PlanError, match=r"--seed patella: there is no bone of its own"):
        segment(knee, seeds=seeds)


def test_two_seeds_in_one_bone_are_refused(knee):
    seeds = {"femur": MIDDLES_MM["femur"], "tibia": MIDDLES_MM["femur"] + 1.0}
    with pytest.raises(PlanError, match=r"--seed tibia: there is no bone of its own"):
        segment(knee, seeds=seeds)


def test_no_bone_is_refused(knee):
    with pytest.raises(PlanError, match=r"no bone in the CT.*denser than 2500 HU") as refusal:
        segment(knee, 2500.0)
    assert "--threshold" in refusal.value.remedy
    with pytest.raises(PlanError, match="no bone in the CT"):
        segment(ct_of(np.full((20, 20, 20), AIR_HU), lattice((20, 20, 20), (2.0, 2.0, 2.0))))


@pytest.mark.release
def test_bones_that_are_no_knee_are_refused_unless_seeds_name_them():
    size = (76, 92, 56)
    ct = ct_of_bones([KNEE_MM["femur"], KNEE_MM["patella"]], size, (0.0, 0.0, 18.0))
    with pytest.raises(PlanError, match="no knee in the CT: no two of its 2 bones") as refusal:
        segment(ct)
    assert "--seed" in refusal.value.remedy
    named = segment(ct, seeds={"femur": MIDDLES_MM["femur"]})
    assert set(named.names) == {"femur"}
    assert "tibia: not found in the CT" in named.warnings


@pytest.mark.release
def test_two_knees_are_refused_until_one_is_chosen():
    one = [KNEE_MM["femur"], KNEE_MM["tibia"]]
    other = [np.array(edges) + np.array([80.0, 0.0, 1.0]) for edges in one]
    size, middle_mm = (160, 66, 88), (40.0, 0.0, 0.0)
    ct = ct_of_bones([*one, *other], size, middle_mm)
    with pytest.raises(PlanError, match="two knees in the CT") as refusal:
        segment(ct)
    assert "--region" in refusal.value.remedy
    chosen = MIDDLES_MM["femur"] + [80.0, 0.0, 1.0]
    right = ct.crop((0, 0, 0), (80, 66, 88))
    assert {"femur", "tibia"} <= set(segment(right).names)
    seeds = {"femur": chosen, "tibia": MIDDLES_MM["tibia"] + [80.0, 0.0, 0.0]}
    named = segment(ct, seeds=seeds)
    of_femur = np.argwhere(named.bones == named.names["femur"])[:, ::-1]
    middle = named.ct.points_lps_mm(of_femur).mean(axis=0)
    np.testing.assert_allclose(middle, chosen, atol=1.0)


@pytest.mark.release
@pytest.mark.parametrize("seeded", ["tibia", "femur"])
def test_a_seed_in_one_bone_chooses_its_knee(seeded):
    """The other knee is larger; no bone of it may become part of the plan."""
    one = {name: KNEE_MM[name] for name in ("femur", "tibia")}
    by = np.array([80.0, 0.0, 1.0])
    other = {name: np.array(edges) + by for name, edges in one.items()}
    other["tibia"][1] += [2.0, 0.0, 0.0]
    ct = ct_of_bones([*one.values(), *other.values()], (160, 66, 88), (40.0, 0.0, 0.0))
    for middle_x_mm in (0.0, by[0]):
        named = segment(ct, seeds={seeded: MIDDLES_MM[seeded] + [middle_x_mm, 0.0, 0.0]})
        for name in ("femur", "tibia"):
            voxels = np.argwhere(named.bones == named.names[name])[:, ::-1]
            middle = named.ct.points_lps_mm(voxels).mean(axis=0)
            assert abs(middle[0] - middle_x_mm) < 5.0


@pytest.mark.parametrize("shift_mm", few_of([(24.0, 0.0, 0.0), (0.0, -24.0, 0.0)]))
def test_a_bone_cut_off_at_the_side_is_told(shift_mm):
    ct = ct_of_bones([KNEE_MM["femur"], KNEE_MM["tibia"]], (70, 80, 90), shift_mm=shift_mm)
    warnings = segment(ct).warnings
    for name in ("femur", "tibia"):
        assert any(said.startswith(f"{name}: cut off at the side") for said in warnings)


@pytest.mark.release
def test_a_side_is_a_side_however_the_voxels_are_ordered():
    """Sagittal slices: k runs from left to right, i from head to foot."""
    size, order = (70, 80, 90), [2, 1, 0]
    for shift_mm, is_cut in ((0.0, False), (24.0, True)):
        bones = [KNEE_MM["femur"], KNEE_MM["tibia"]]
        ct = ct_of_bones(bones, size, shift_mm=(shift_mm, 0.0, 3.0))
        matrix = ct.lps_from_index[:, [*order, 3]]
        turned = ct_of(np.ascontiguousarray(ct.hu.transpose(order)), matrix)
        assert any("cut off" in said for said in segment(turned).warnings) == is_cut


@pytest.mark.release
def test_a_shaft_cut_by_the_first_or_last_slice_is_no_warning():
    ct = ct_of_bones([KNEE_MM["femur"], KNEE_MM["tibia"]], (64, 64, 66))
    segmentation = segment(ct)
    assert segmentation.bones[0].any()
    assert segmentation.bones[-1].any()
    assert not [said for said in segmentation.warnings if "cut off" in said]
