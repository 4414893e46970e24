"""The thickness of what a cut took off a ball."""

from dataclasses import replace

import numpy as np
import pytest

from navapp.resection.thickness import measure_thickness
from navapp.values import BoneModel, MeasuredFace, ResectionPlane
from tests.geometry.shapes import sphere

BONE = BoneModel("femur", sphere(20.0))
PLANE = ResectionPlane("femur", np.array([0.0, 0.0, 12.0]), np.array([0.0, 0.0, 1.0]))
SMALL = np.diag([1e-6, 1e-6, 1e-4])


def face(tilt_rad: float = 0.0, offset_mm: float = 0.0) -> MeasuredFace:
    return MeasuredFace(PLANE, np.array([tilt_rad, 0.0, offset_mm]), SMALL, 0.9)


@pytest.mark.parametrize("offset_mm", [0.0, 0.8, -1.5])
def test_less_bone_is_gone_where_the_face_lies_higher(offset_mm: float) -> None:
    found = measure_thickness(BONE, face(offset_mm=offset_mm))
    assert found.planned_mm == pytest.approx(8.0, abs=0.02)
    assert found.mm == pytest.approx(8.0 - offset_mm, abs=0.02)
    # The top of the ball stands over the middle of the face: tilts hardly count.
    assert found.bound_mm == pytest.approx(1.96 * 0.01, rel=0.1)


def test_a_tilt_counts_by_its_arm() -> None:
    """The plan's middle lies 9 mm beside the thickest place."""
    beside = replace(PLANE, point_mm=PLANE.point_mm + np.array([9.0, 0.0, 0.0]))
    one = MeasuredFace(beside, np.zeros(3), np.diag([1e-4, 0.0, 0.0]), 0.9)
    tilted = replace(one, tilts_offset=np.array([0.01, 0.0, 0.0]))
    found, other = measure_thickness(BONE, one), measure_thickness(BONE, tilted)
    assert found.bound_mm == pytest.approx(1.96 * 9.0 * 0.01, rel=0.01)
    assert abs(other.mm - found.mm) == pytest.approx(0.09, rel=0.1)


def test_a_plan_beside_the_bone_takes_nothing_off() -> None:
    away = replace(PLANE, point_mm=np.array([0.0, 0.0, 30.0]))
    one = MeasuredFace(away, np.zeros(3), SMALL, 0.9)
    assert measure_thickness(BONE, one) is None


def test_what_the_surface_may_be_off_by_is_in_the_bound() -> None:
    unsure = replace(BONE, surface_sd_mm=0.3)
    exact, found = measure_thickness(BONE, face()), measure_thickness(unsure, face())
    assert found.bound_mm == pytest.approx(np.hypot(exact.bound_mm, 1.96 * 0.3))
