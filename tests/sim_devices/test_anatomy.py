import itertools

import numpy as np
import pytest

from navapp.errors import UsageError
from sim_devices.anatomy import KneeSpec
from tests.kept import make_new_knee as make_knee
from tests.many import few_of

ALL = [
    KneeSpec(seed, "right", sex, age)
    for sex, age in itertools.product(("female", "male"), ("young", "middle", "old"))
    for seed in (1, 2)
]
# The first stands for all; both sexes and every age come soon after it.
FIRST = [
    KneeSpec(1, "right", "female", "young"),
    KneeSpec(2, "right", "male", "middle"),
    KneeSpec(1, "right", "female", "old"),
]
SPECS = few_of([*FIRST, *(spec for spec in ALL if spec not in FIRST)])


@pytest.fixture(scope="module", params=SPECS, ids=lambda s: f"{s.sex}-{s.age_group}-{s.seed}")
def knee(request):
    return make_knee(request.param)


def nearest(a, b):
    from scipy.spatial import cKDTree

    return cKDTree(a.vertices_mm).query(b.vertices_mm)[0]


def edges_of(mesh):
    pairs = np.stack([mesh.faces, np.roll(mesh.faces, -1, axis=1)], axis=-1).reshape(-1, 2)
    return np.unique(np.sort(pairs, axis=1), axis=0, return_counts=True)


def test_every_bone_is_one_closed_outward_surface_of_fine_triangles(knee):
    for mesh in knee.bones.values():
        edges, uses = edges_of(mesh)
        assert (uses == 2).all()
        assert len(mesh.vertices_mm) - len(edges) + len(mesh.faces) == 2
        assert mesh.volume_mm3() > 0.0
        lengths = np.linalg.norm(np.diff(mesh.vertices_mm[edges], axis=1)[:, 0], axis=1)
        assert 1.0 < lengths.mean() < 1.3


def test_the_femur_has_a_plausible_size(knee):
    marks = knee.landmarks
    vertices = knee.bones["femur"].vertices_mm
    width = marks["femur/medial_epicondyle"] - marks["femur/lateral_epicondyle"]
    assert 74.0 < np.linalg.norm(width) < 92.0
    assert 55.0 < np.ptp(vertices[vertices[:, 2] < 5.0, 1]) < 71.0
    assert 110.0 < np.ptp(vertices[:, 2]) < 140.0
    shaft = vertices[np.abs(vertices[:, 2] - 80.0) < 3.0]
    assert 24.0 < np.ptp(shaft[:, 0]) < 36.0


def test_tibia_and_patella_have_plausible_sizes(knee):
    tibia, patella = knee.bones["tibia"].size_mm, knee.bones["patella"].size_mm
    assert 68.0 < tibia[0] < 88.0
    assert 46.0 < tibia[1] < 64.0
    assert 100.0 < tibia[2] < 135.0
    assert (patella > [37.0, 20.0, 35.0]).all()
    assert (patella < [53.0, 26.0, 50.0]).all()


def test_the_plateau_slopes_down_to_the_back(knee):
    vertices, normals = knee.bones["tibia"].vertices_mm, knee.bones["tibia"].normals
    level = knee.landmarks["tibia/lateral_plateau"][2]
    top = (normals[:, 2] > 0.8) & (np.abs(vertices[:, 0]) > 14.0) & (vertices[:, 2] > level - 7.0)
    design = np.column_stack([np.ones(top.sum()), vertices[top][:, :2]])
    slope = np.linalg.lstsq(design, vertices[top][:, 2], rcond=None)[0][2]
    assert 4.0 < -np.rad2deg(np.arctan(slope)) < 10.0


def test_the_bones_keep_their_gaps(knee):
    femur = knee.bones["femur"]
    tibia = knee.bones["tibia"]
    to_tibia = nearest(femur, tibia)
    assert 3.5 < to_tibia.min() < 4.5
    for side in (1.0, -1.0):
        assert 3.5 < to_tibia[side * tibia.vertices_mm[:, 0] > 10.0].min() < 6.0
    assert 3.5 < nearest(femur, knee.bones["patella"]).min() < 4.5


def test_vertices_and_landmarks_lie_on_the_implicit_surfaces(knee):
    for name, mesh in knee.bones.items():
        assert np.abs(knee.solids[name](mesh.vertices_mm)).max() < 0.005
    for name, point in knee.landmarks.items():
        value = knee.solids[name.split("/")[0]](point[None])[0]
        assert value < -5.0 if name == "patella/centre" else abs(value) < 0.005


def test_landmarks_are_where_their_names_say(knee):
    marks = knee.landmarks
    assert marks["femur/medial_epicondyle"][0] > 35.0 > -35.0 > marks["femur/lateral_epicondyle"][0]
    for bone in ("femur", "tibia"):
        part = "condyle" if bone == "femur" else "plateau"
        assert 8.0 < marks[f"{bone}/medial_{part}"][0] < 35.0
        assert -35.0 < marks[f"{bone}/lateral_{part}"][0] < -8.0
    distal = min(marks["femur/medial_condyle"][2], marks["femur/lateral_condyle"][2])
    assert marks["femur/notch"][2] > distal + 5.0
    front = knee.bones["femur"].vertices_mm[:, 1].min()
    assert 2.0 < marks["femur/trochlea"][1] - front < 12.0
    assert np.abs(marks["femur/anterior_cortex"][0]) < 10.0
    below_plateau = marks["tibia/medial_plateau"][2] - marks["tibia/tubercle"][2]
    assert 20.0 < below_plateau < 50.0


def test_vessels_and_nerves_run_outside_the_bones_behind_the_knee(knee):
    for curve in knee.curves.values():
        assert curve.shape[1] == 3
        for solid in knee.solids.values():
            assert solid(curve).min() > 2.0
        assert (curve[:, 1] > 0.0).all()


def test_a_view_from_below_in_front_fixes_all_six_degrees_of_freedom(knee):
    femur = knee.bones["femur"]
    towards_camera = np.array([0.0, -0.5, -0.87])
    seen = femur.normals @ towards_camera > 0.3
    points, normals = femur.vertices_mm[seen], femur.normals[seen]
    moments = np.cross(points - points.mean(axis=0), normals) / 30.0
    rows = np.hstack([moments, normals])
    eigenvalues = np.linalg.eigvalsh(rows.T @ rows)
    assert eigenvalues[0] / eigenvalues[-1] > 0.01


def test_a_left_knee_is_the_mirrored_right_one():
    right, left = make_knee(KneeSpec(3, "right")), make_knee(KneeSpec(3, "left"))
    mirror = np.array([-1.0, 1.0, 1.0])
    for name, mesh in left.bones.items():
        np.testing.assert_array_equal(mesh.vertices_mm, right.bones[name].vertices_mm * mirror)
        assert mesh.volume_mm3() == pytest.approx(right.bones[name].volume_mm3())
        outside = mesh.vertices_mm + 0.2 * mesh.normals
        assert (left.solids[name](outside) > 0.0).mean() > 0.999
    assert left.landmarks["femur/medial_epicondyle"][0] < 0.0


@pytest.mark.release
def test_equal_specs_give_equal_knees_and_seeds_differ():
    first, other = make_knee(KneeSpec(3)), make_knee(KneeSpec(5))
    again = make_knee.__wrapped__(KneeSpec(3))
    femur = first.bones["femur"]
    np.testing.assert_array_equal(femur.vertices_mm, again.bones["femur"].vertices_mm)
    np.testing.assert_array_equal(femur.faces, again.bones["femur"].faces)
    assert np.percentile(np.abs(other.solids["femur"](femur.vertices_mm)), 75) > 0.5


@pytest.mark.parametrize("wrong", [{"seed": -1}, {"side": "middle"}, {"age_group": "ancient"}])
def test_a_knee_that_there_is_not_is_refused(wrong):
    with pytest.raises(UsageError):
        KneeSpec(**wrong)


@pytest.mark.release
def test_men_are_larger_and_the_old_rougher():
    woman = make_knee(KneeSpec(2, age_group="old"))
    man = make_knee(KneeSpec(2, sex="male", age_group="old"))
    assert man.bones["femur"].volume_mm3() > 1.1 * woman.bones["femur"].volume_mm3()
    young = make_knee(KneeSpec(2, age_group="young"))
    osteophytes = young.solids["femur"](woman.bones["femur"].vertices_mm)
    assert osteophytes.max() > 1.0
    assert np.abs(np.median(osteophytes)) < 0.3


def test_the_condyles_differ(knee):
    marks = knee.landmarks
    behind = marks["femur/medial_posterior_condyle"] - marks["femur/lateral_posterior_condyle"]
    assert behind[1] > 0.3
