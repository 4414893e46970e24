import numpy as np
import pytest

from sim_devices.anatomy import KneeSpec, make_knee
from sim_devices.planned_cuts import make_planned_cuts
from sim_devices.sawn_bone import cut_skin, make_sawn_face, mark_cortex


@pytest.fixture(scope="module")
def knee():
    return make_knee(KneeSpec(1))


@pytest.fixture(scope="module")
def cuts(knee):
    return [cut for cut in make_planned_cuts(knee).values() if cut.bone == "femur"]


def test_nothing_is_left_beyond_the_cuts(knee, cuts) -> None:
    skin = cut_skin(knee.bones["femur"], cuts)
    used = skin.vertices_mm[np.unique(skin.faces)]
    for cut in cuts:
        assert cut.heights_mm(used).max() < 1e-6
    n = len(knee.bones["femur"].vertices_mm)
    np.testing.assert_array_equal(skin.vertices_mm[:n], knee.bones["femur"].vertices_mm)


def test_faces_are_plane_face_outwards_and_end_at_each_other(knee, cuts) -> None:
    for cut in cuts:
        others = [other for other in cuts if other is not cut]
        face = make_sawn_face(knee.bones["femur"], cut, others)
        assert face is not None
        mesh = face.mesh
        used = mesh.vertices_mm[np.unique(mesh.faces)]
        assert np.abs(cut.heights_mm(used)).max() < 1e-6
        assert max(other.heights_mm(used).max() for other in others) < 1e-6
        corners = mesh.vertices_mm[mesh.faces]
        across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        assert (across @ cut.normal > -1e-9).all()
        # Small triangles: they follow the lens, and carry rim and tooth marks.
        assert np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max() < 5.0


def test_sawn_bone_is_as_much_smaller_as_the_piece_was_large(knee) -> None:
    cut = make_planned_cuts(knee)["tibia_proximal"]
    bone = knee.bones["tibia"]
    face = make_sawn_face(bone, cut, [])
    area = face.mesh.face_areas_mm2().sum()
    outer, inner = (face.cortex > 0.9).mean(), (face.cortex < 0.1).mean()
    assert 2000.0 < area < 3800.0
    assert 0.03 < outer < 0.4
    assert inner > 0.5


def test_the_cortex_is_a_shell_below_the_skin(knee) -> None:
    bone = knee.bones["femur"]
    chosen = slice(None, None, 50)
    on_skin = bone.vertices_mm[chosen]
    assert mark_cortex(bone, on_skin).min() > 0.75
    deep = on_skin - 5.0 * bone.normals[chosen]
    assert np.median(mark_cortex(bone, deep)) == 0.0


def test_the_teeth_leave_faint_ridges_in_the_normals_only(knee) -> None:
    cut = make_planned_cuts(knee)["femur_distal"]
    face = make_sawn_face(knee.bones["femur"], cut, [])
    slope_deg = np.degrees(np.arccos(np.clip(face.mesh.normals @ cut.normal, -1.0, 1.0)))
    assert 1.0 < np.sqrt((slope_deg**2).mean()) < 6.0


def test_a_cut_that_misses_the_bone_leaves_no_face(knee) -> None:
    cut = make_planned_cuts(knee)["femur_distal"]
    from dataclasses import replace

    beside = replace(cut, point_mm=cut.point_mm + 100.0 * cut.normal)
    assert make_sawn_face(knee.bones["femur"], beside, []) is None
