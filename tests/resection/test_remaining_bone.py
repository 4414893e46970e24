"""What is left of a bone after cuts."""

from dataclasses import replace

import numpy as np
import pytest

from navapp.geometry.box import Box
from navapp.geometry.mesh import TriangleMesh, join_meshes
from navapp.geometry.transform import RigidTransform, rotation_from_vector
from navapp.registration import RegistrationModel
from navapp.resection.cut_bone import SURE_MM, UNSURE_MM, CutBone
from navapp.resection.remaining_bone import Cut, close_with_face, remove_cuts, remove_holes
from navapp.values import BoneModel, DrillAxis, MeasuredFace, ResectionPlane
from tests.registration.shapes import GEOMETRY
from tests.resection.cuts import MADE, PLANNED, bone


def face(offset_mm: float = -0.7, sd: float = 0.0) -> MeasuredFace:
    covariance = sd**2 * np.eye(3)
    return MeasuredFace(PLANNED, np.array([0.0, 0.0, offset_mm]), 2.0 * covariance, 0.8)


def test_without_cuts_a_bone_is_itself() -> None:
    whole = bone()
    assert remove_cuts(whole, []) is whole
    assert CutBone(whole).model.lid is None


@pytest.mark.parametrize("unsure_mm", [0.3, 1.5])
def test_what_lies_beyond_a_cut_and_beside_it_is_gone(unsure_mm: float) -> None:
    left = remove_cuts(bone(), [Cut(PLANNED, unsure_mm)])
    is_gone = left.mesh.vertices_mm[:, 2] > 12.0 - unsure_mm
    np.testing.assert_array_equal(left.is_removed, is_gone)
    seen = left.make_seen_surface()
    assert seen.vertices_mm[np.unique(seen.faces)][:, 2].max() < 12.0 - unsure_mm


def test_a_cut_takes_the_whole_piece_over_its_rectangle_and_no_other() -> None:
    ball = bone().mesh
    beside = TriangleMesh(ball.vertices_mm + np.array([100.0, 0.0, 0.0]), ball.faces)
    two = BoneModel("femur", join_meshes(ball, beside))
    small = ResectionPlane("femur", PLANNED.point_mm, PLANNED.normal, (20.0, 20.0))
    left = remove_cuts(two, [Cut(small, 0.0)])
    one = remove_cuts(bone(), [Cut(PLANNED, 0.0)])
    n = len(ball.vertices_mm)
    np.testing.assert_array_equal(left.is_removed[:n], one.is_removed)
    assert not left.is_removed[n:].any()


def test_the_lid_closes_the_bone_and_is_not_seen() -> None:
    model = RegistrationModel(remove_cuts(bone(), [Cut(PLANNED, 1.5)]))
    lid = model.bone.lid
    assert lid is not None
    flat = lid.face_areas_mm2()[np.ptp(lid.vertices_mm[lid.faces, 2], axis=1) < 1e-6].sum()
    assert flat == pytest.approx(np.pi * (30.0**2 - 10.5**2), rel=0.01)
    assert (model.rendered_face_sigma_mm > 0.0).all()
    # Seen from above: the lid is there, but told from what is seen.
    away = RigidTransform.from_parts(
        "left_rect", "femur", rotation_from_vector((np.pi, 0.0, 0.0)), (0.0, 0.0, 450.0)
    )
    box = Box(0, 0, GEOMETRY.width, GEOMETRY.height)
    seen, whole = model.render(away, GEOMETRY, box), model.render(away, GEOMETRY, box, has_lid=True)
    assert whole.mask.sum() > 1.5 * seen.mask.sum()
    np.testing.assert_array_equal(seen.mask, np.isfinite(seen.depth_mm))
    # Without a lid the inside would be seen through the hole.
    np.testing.assert_array_equal(seen.depth_mm[seen.mask], whole.depth_mm[seen.mask])
    middle = round(GEOMETRY.centre_y_px), round(GEOMETRY.centre_x_px)
    assert whole.depth_mm[middle] == pytest.approx(450.0 - 10.5, abs=0.1)
    assert not seen.mask[middle]


def test_the_inner_side_of_a_bone_is_not_seen_through_a_hole() -> None:
    hole = DrillAxis("femur", np.array([0.0, 0.0, 30.0]), np.array([0.0, 0.0, -1.0]), 20.0, 12.0)
    model = RegistrationModel(remove_holes(bone(), [hole], 1.0))
    above = RigidTransform.from_parts(
        "left_rect", "femur", rotation_from_vector((np.pi, 0.0, 0.0)), (0.0, 0.0, 450.0)
    )
    box = Box(0, 0, GEOMETRY.width, GEOMETRY.height)
    seen = model.render(above, GEOMETRY, box)
    middle = round(GEOMETRY.centre_y_px), round(GEOMETRY.centre_x_px)
    assert not seen.mask[middle]
    # All that is seen is the half of the ball that looks up.
    assert np.nanmax(seen.depth_mm) < 450.0
    assert seen.mask.sum() > 1000


def test_a_measured_face_leaves_less_unsure() -> None:
    cut = CutBone(bone()).make("top", PLANNED)
    assert cut.unmeasured == ("top",)
    known = cut.with_faces({"top": face()})
    assert known.unmeasured == ()
    for one, limit_mm in ((cut, 12.0 - UNSURE_MM), (known, 11.3 - SURE_MM)):
        is_gone = one.model.mesh.vertices_mm[:, 2] > limit_mm
        np.testing.assert_array_equal(one.model.is_removed, is_gone)
    # One that is known badly leaves as much as before.
    loose = cut.with_faces({"top": face(sd=0.5)})
    np.testing.assert_array_equal(
        loose.model.is_removed,
        remove_cuts(bone(), [Cut(face().as_plane, UNSURE_MM)]).is_removed,
    )


def test_a_cut_that_is_withdrawn_gives_the_bone_back() -> None:
    whole = CutBone(bone())
    cut = whole.make("top", PLANNED).make("side", MADE)
    back = cut.restore("top").restore("side")
    assert not back.model.is_removed.any()
    assert back.model.lid is None
    versions = [one.model.version for one in (whole, cut, back)]
    assert versions == [0, 2, 0]


def test_a_cut_made_again_is_not_measured() -> None:
    once = CutBone(bone()).make("top", PLANNED).with_faces({"top": face()})
    assert once.make("top", PLANNED).unmeasured == ("top",)


def test_a_read_face_closes_the_bone_and_is_matched() -> None:
    cut = CutBone(bone()).make("top", PLANNED)
    known = cut.with_caliper_face("top", face())
    model = known.model
    assert model.face is not None
    assert model.face.offset_mm == -0.7
    assert model.lid is None
    assert not model.is_removed.any()
    assert model.mesh.vertices_mm[:, 2].max() == pytest.approx(11.3)
    above = RigidTransform.from_parts(
        "left_rect", "femur", rotation_from_vector((np.pi, 0.0, 0.0)), (0.0, 0.0, 450.0)
    )
    box = Box(0, 0, GEOMETRY.width, GEOMETRY.height)
    seen = RegistrationModel(model).render(above, GEOMETRY, box)
    middle = round(GEOMETRY.centre_y_px), round(GEOMETRY.centre_x_px)
    assert seen.depth_mm[middle] == pytest.approx(450.0 - 11.3, abs=0.01)
    assert known.unmeasured == ()
    assert known.version == model.version == 2


def test_a_read_face_lasts_until_its_cut_is_withdrawn_or_made_again() -> None:
    known = CutBone(bone()).make("top", PLANNED).with_caliper_face("top", face())
    assert known.without_faces().caliper_faces == known.caliper_faces
    assert known.make("side", MADE).caliper_faces == known.caliper_faces
    for other in (known.restore("top"), known.make("top", PLANNED)):
        assert not other.caliper_faces
        assert other.model.face is None
    assert known.restore("top").version == 0


def test_a_read_bone_keeps_what_its_cartilage_leaves_open() -> None:
    sd_mm = np.linspace(0.1, 0.4, len(bone().mesh.vertices_mm))
    thick = replace(bone(), cartilage_mm=np.full(len(sd_mm), 2.0), cartilage_sd_mm=sd_mm)
    closed = close_with_face(thick, face())
    lowest = closed.mesh.vertices_mm[:, 2].argmin()
    assert closed.mesh.vertices_mm[lowest, 2] == pytest.approx(-32.0, abs=0.1)
    assert not closed.cartilage_mm.any()
    # The face itself is sawn.
    is_on_face = np.abs(closed.mesh.vertices_mm[:, 2] - 11.3) < 1e-6
    assert not closed.cartilage_sd_mm[is_on_face].any()
    on_skin_mm = closed.cartilage_sd_mm[~is_on_face]
    assert 0.1 <= on_skin_mm.min() < on_skin_mm.max() <= 0.4


def test_other_cuts_and_holes_of_a_read_bone_are_gone_as_well() -> None:
    side = ResectionPlane("femur", np.array([12.0, 0.0, 0.0]), np.array([1.0, 0.0, 0.0]))
    known = CutBone(bone()).make("top", PLANNED).with_caliper_face("top", face())
    both = known.make("side", side).model
    assert both.face is known.model.face
    assert not known.model.is_removed.any()
    np.testing.assert_array_equal(both.is_removed, both.mesh.vertices_mm[:, 0] > 12.0 - UNSURE_MM)


def test_the_surface_that_is_looked_at_ends_at_the_faces() -> None:
    whole = CutBone(bone())
    assert whole.surface is None
    cut = whole.make("top", PLANNED)
    for one, level_mm in ((cut, 12.0), (cut.with_faces({"top": face()}), 11.3)):
        surface = one.surface
        assert surface is not None
        used = surface.vertices_mm[np.unique(surface.faces)]
        assert used[:, 2].max() == pytest.approx(level_mm)
        # Closed: its face is there.
        assert surface.volume_mm3() == pytest.approx(
            np.pi * (4.0 / 3.0 * 30.0**3 - (30.0 - level_mm) ** 2 * (60.0 + level_mm) / 3.0),
            rel=0.01,
        )


def test_the_faces_of_two_cuts_that_cross_close_the_bone() -> None:
    side = ResectionPlane("femur", np.array([12.0, 0.0, 0.0]), np.array([1.0, 0.0, 0.0]))
    surface = CutBone(bone()).make("top", PLANNED).make("side", side).surface
    assert surface is not None
    used = surface.vertices_mm[np.unique(surface.faces)]
    assert used[:, [0, 2]].max() == pytest.approx(12.0)
    rng = np.random.default_rng(0)
    points = rng.uniform(-30.0, 30.0, (400_000, 3))
    is_left = (np.linalg.norm(points, axis=1) < 30.0) & (points[:, [0, 2]] < 12.0).all(axis=1)
    assert surface.volume_mm3() == pytest.approx(is_left.mean() * 60.0**3, rel=0.02)
