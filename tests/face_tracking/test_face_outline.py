"""The border of a face in the pictures."""

import numpy as np

from navapp.face_tracking.face_outline import FaceOutline
from navapp.geometry.transform import RigidTransform, rotation_from_vector
from navapp.registration import RegistrationModel
from navapp.resection import CutBone
from navapp.tracking.outline_kernels import Eye
from navapp.values import MeasuredFace, ResectionPlane
from tests.registration.shapes import GEOMETRY
from tests.resection.cuts import PLANNED, bone

FACE = MeasuredFace(PLANNED, np.array([0.03, 0.0, -0.5]), 1e-4 * np.eye(3), 1.0)


def face_outline() -> FaceOutline:
    cut = CutBone(bone()).make("top", PLANNED).with_caliper_face("top", FACE)
    return FaceOutline(RegistrationModel(cut.model), GEOMETRY, FACE)


def test_it_is_the_border_of_the_face_seen_from_either_eye() -> None:
    outline = face_outline()
    pose = RigidTransform.from_parts(
        "left_rect", "femur", rotation_from_vector((np.pi - 0.2, 0.1, 0.0)), (5.0, -3.0, 450.0)
    )
    for x_mm in (0.0, GEOMETRY.baseline_mm):
        eye = Eye(x_mm, GEOMETRY.focal_px, GEOMETRY.centre_x_px, GEOMETRY.centre_y_px)
        rim = outline.find_seen_rim(pose, eye, np.empty((0, 0), dtype=np.float32), (0, 0))
        in_bone_mm = pose.inverse().apply(rim.point)
        assert np.abs(FACE.as_plane.heights_mm(in_bone_mm)).max() < 0.05
        np.testing.assert_allclose(np.linalg.norm(in_bone_mm, axis=1), 30.0, atol=0.1)
        seen_mm = rim.point - (x_mm, 0.0, 0.0)
        expected = GEOMETRY.focal_px * seen_mm[:, :2] / seen_mm[:, 2:]
        expected += (GEOMETRY.centre_x_px, GEOMETRY.centre_y_px)
        np.testing.assert_allclose(rim.pixel, expected)
        outward = rim.pixel - rim.pixel.mean(axis=0)
        assert ((outward * rim.normal).sum(axis=1) > 0.0).all()
        # How unsure a point is tells the skin beside it, not the face.
        beside_mm = outline._model.seen_mesh.vertices_mm[rim.vertex]
        assert (FACE.as_plane.heights_mm(beside_mm) < -0.03).all()
        assert np.linalg.norm(beside_mm - in_bone_mm, axis=1).max() < 4.0
        # All around, about one point in 3 px.
        angle = np.sort(np.arctan2(outward[:, 1], outward[:, 0]))
        assert np.diff(np.append(angle, angle[0] + 2.0 * np.pi)).max() < 0.2


def test_a_border_that_another_cut_interrupts_does_not_count() -> None:
    aside = ResectionPlane("femur", np.array([12.0, 0.0, 0.0]), np.array([1.0, 0.0, 0.0]))
    cut = CutBone(bone()).make("top", PLANNED).with_caliper_face("top", FACE).make("aside", aside)
    outline = FaceOutline(RegistrationModel(cut.model), GEOMETRY, FACE)
    pose = RigidTransform.from_parts(
        "left_rect", "femur", rotation_from_vector((np.pi, 0.0, 0.0)), (0.0, 0.0, 450.0)
    )
    eye = Eye(0.0, GEOMETRY.focal_px, GEOMETRY.centre_x_px, GEOMETRY.centre_y_px)
    nothing = np.empty((0, 0), dtype=np.float32)
    assert len(face_outline().find_seen_rim(pose, eye, nothing, (0, 0)).pixel) > 50
    assert len(outline.find_seen_rim(pose, eye, nothing, (0, 0)).pixel) == 0


def test_where_a_narrow_strip_of_the_flank_is_seen_the_border_does_not_count() -> None:
    outline = face_outline()
    pose = RigidTransform.from_parts(
        "left_rect", "femur", rotation_from_vector((np.pi, 0.0, 0.0)), (0.0, 0.0, 450.0)
    )
    eye = Eye(0.0, GEOMETRY.focal_px, GEOMETRY.centre_x_px, GEOMETRY.centre_y_px)
    shape = GEOMETRY.height, GEOMETRY.width
    nothing = np.full(shape, np.nan, dtype=np.float32)
    border = outline.find_seen_rim(pose, eye, nothing, (0, 0))
    assert len(border.pixel) > 50
    middle = border.pixel.mean(axis=0)
    radius_px = np.linalg.norm(border.pixel - middle, axis=1).mean()
    rows, columns = np.indices(shape)
    away_px = np.hypot(columns - middle[0], rows - middle[1]) - radius_px
    for strip_px, counts in ((-2.0, True), (3.0, False), (12.0, True)):
        depth_mm = np.where(away_px < strip_px, np.float32(440.0), np.float32(np.nan))
        # The buffer may begin elsewhere in the picture.
        rim = outline.find_seen_rim(pose, eye, depth_mm[5:, 7:], (7, 5))
        assert len(rim.pixel) == (len(border.pixel) if counts else 0)
