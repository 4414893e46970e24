"""Faces of cuts, measured in pictures."""

from dataclasses import replace

import numpy as np
import pytest

from navapp.geometry.rectification import luma
from navapp.geometry.transform import RigidTransform
from navapp.resection import FaceMeter
from navapp.values import MeasuredFace, ResectionPlane, join_faces
from tests.many import few_of
from tests.resection.cuts import MADE, PLANNED, POSE_SD, Cover, bone, estimate, pictures, pose, rig


@pytest.fixture(scope="module")
def meter() -> FaceMeter:
    return FaceMeter(rig(), bone())


def errors(face: MeasuredFace, made: ResectionPlane = MADE) -> tuple[float, float]:
    """Angle to the made plane in deg, and distance at the planned point in mm."""
    angle = np.degrees(np.arccos(min(1.0, float(face.normal @ made.normal))))
    along = float((made.point_mm - face.point_mm) @ made.normal / (face.normal @ made.normal))
    return float(angle), along


def test_a_face_is_found_where_it_was_made(meter: FaceMeter) -> None:
    placed = estimate(pose())
    face = meter.measure(*pictures(pose()), placed, PLANNED, ())
    assert face is not None
    angle_deg, off_mm = errors(face)
    assert angle_deg < 0.15
    assert abs(off_mm) < 0.06
    assert face.angle_deg == pytest.approx(1.3, abs=0.15)
    assert face.offset_mm == pytest.approx(-0.7, abs=0.07)
    assert face.is_told
    assert face.seen_share > 0.7
    assert angle_deg <= face.bound_deg
    assert abs(off_mm) <= face.bound_mm


def measured(meter: FaceMeter, left, right) -> tuple[MeasuredFace, float]:
    """The face, and how far its offset is off in mm."""
    face = meter.measure(left, right, estimate(pose()), PLANNED, ())
    assert face is not None
    return face, abs(errors(face)[1])


@pytest.mark.release
def test_glints_that_each_eye_sees_elsewhere_do_not_move_the_face(meter: FaceMeter) -> None:
    face, off_mm = measured(meter, *pictures(pose(), glint=0.1))
    assert face.is_told
    assert off_mm <= min(face.bound_mm, 0.06)
    left, right = pictures(pose(), glint=0.25)
    face, off_mm = measured(meter, left, right)
    assert off_mm <= min(face.bound_mm, 0.1)
    # Without colour they move it; that is in the bound.
    face, off_mm = measured(meter, luma(left), luma(right))
    assert 0.2 < off_mm <= face.bound_mm


def test_clipped_pixels_move_no_face_that_is_told(meter: FaceMeter) -> None:
    for glint in (1.0, 2.0, 4.0):
        left, right = pictures(pose(), glint=glint)
        face = meter.measure(left, right, estimate(pose()), PLANNED, ())
        assert face is None or not face.is_told or abs(errors(face)[1]) <= face.bound_mm


@pytest.mark.release
def test_a_lamp_that_is_not_white_in_the_pictures_is_in_the_bound(meter: FaceMeter) -> None:
    for lamp in ((0.85, 0.95, 1.0), (0.7, 0.9, 1.0), (1.0, 0.95, 0.8)):
        face, off_mm = measured(meter, *pictures(pose(), glint=0.25, lamp=lamp))
        assert off_mm <= face.bound_mm


def test_a_pose_that_is_off_is_in_the_bound(meter: FaceMeter) -> None:
    left, right = pictures(pose())
    rng = np.random.default_rng(3)
    scales = np.repeat(POSE_SD, 3)
    covered = []
    for _ in range(12):
        centre_mm = pose().apply(bone().mesh.centroid_mm[None])[0]
        moved = pose().move(scales * rng.standard_normal(6), centre_mm)
        face = meter.measure(left, right, estimate(moved), PLANNED, ())
        assert face is not None
        angle_deg, off_mm = errors(face)
        covered += [angle_deg <= face.bound_deg, abs(off_mm) <= face.bound_mm]
        # The pose's own deviation is most of it.
        assert face.bound_deg >= np.degrees(2.0 * POSE_SD[1])
    assert np.mean(covered) >= 0.9


def test_what_covers_a_part_of_the_face_does_not_move_it(meter: FaceMeter) -> None:
    face = meter.measure(*pictures(pose(), cover=Cover(-8.0)), estimate(pose()), PLANNED, ())
    assert face is not None
    angle_deg, off_mm = errors(face)
    assert angle_deg <= face.bound_deg
    assert abs(off_mm) <= min(face.bound_mm, 0.08)
    assert 0.3 < face.seen_share < 0.75


def test_a_face_that_is_hidden_or_looks_away_is_not_measured(meter: FaceMeter) -> None:
    hidden = pictures(pose(), cover=Cover(100.0))
    found = meter.measure(*hidden, estimate(pose()), PLANNED, ())
    assert found is None or not found.is_told
    away = pose(tilt_deg=170.0)
    assert meter.measure(*pictures(pose()), estimate(away), PLANNED, ()) is None


def test_measurements_of_one_view_join_and_are_known_no_better_than_one(meter: FaceMeter) -> None:
    faces = []
    for seed in range(4):
        face = meter.measure(*pictures(pose(), seed=seed), estimate(pose()), PLANNED, ())
        assert face is not None
        faces.append(face)
    joined = join_faces(faces)
    assert joined.bound_deg <= 1.01 * max(face.bound_deg for face in faces)
    assert joined.bound_deg >= 0.9 * min(face.bound_deg for face in faces)
    assert errors(joined)[0] < 0.12
    with pytest.raises(ValueError, match="no measurement"):
        join_faces([])


@pytest.mark.parametrize("tilt_deg", few_of([82.0, 89.0, 60.0, 75.0, 86.0, 88.3, 90.0, 95.0], 2))
def test_a_face_seen_at_a_grazing_angle_tells_nothing_and_breaks_nothing(
    meter: FaceMeter, tilt_deg: float
) -> None:
    face = meter.measure(*pictures(pose()), estimate(pose(tilt_deg)), PLANNED, ())
    assert face is None or tilt_deg < 85.0


def test_what_lies_beside_the_picture_is_not_seen(meter: FaceMeter) -> None:
    whole = RigidTransform("left", "femur", pose().matrix)
    moved = RigidTransform.from_parts(
        "left", "femur", whole.rotation, whole.translation_mm + np.array([0.0, -42.0, 0.0])
    )
    face = meter.measure(*pictures(moved), estimate(moved), PLANNED, ())
    assert face is not None
    assert 0.2 < face.seen_share < 0.75


def test_errors_that_the_plan_and_the_rig_share_are_in_the_bound(meter: FaceMeter) -> None:
    taken = *pictures(pose()), estimate(pose()), PLANNED, ()
    plain = meter.measure(*taken)
    n = len(bone().mesh.vertices_mm)
    segmented = replace(bone(), surface_sd_mm=0.1)
    covered = replace(bone(), cartilage_sd_mm=np.full(n, 0.1))
    for one in (segmented, covered):
        face = FaceMeter(rig(), one).measure(*taken)
        assert face is not None
        assert plain is not None
        assert face.bound_mm == pytest.approx(np.hypot(plain.bound_mm, 1.96 * 0.1), rel=0.02)
        assert face.bound_deg > 1.5 * plain.bound_deg
    left, right, told, *others = taken
    fitted = replace(told, thickness_ratio=0.5)  # its covariance has the cartilage in it
    face = FaceMeter(rig(), covered).measure(left, right, fitted, *others)
    assert face.bound_mm == pytest.approx(plain.bound_mm)
