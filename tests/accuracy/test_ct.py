"""Surfaces out of a CT whose truth is known: told apart without a seed, where the cortex ends."""

import numpy as np
import pytest

from navapp.geometry.ply import read_ply
from navapp.geometry.simplify import is_closed
from navapp.geometry.transform import FloatArray
from navapp.preop import PlanView, make_plan_view
from navapp.preop.plan_drafts import Draft, make_draft_from_ct
from navapp.preop.slices import DIRECTIONS, Direction
from navapp.preop.volume import read_ct
from navapp.values import Plan
from tests.bench.ct_pose_error import pose_errors_mm, surface_error_mm
from tests.bench.ct_surfaces import BONES, errors_mm

pytestmark = pytest.mark.release


@pytest.fixture(scope="module")
def draft(data) -> Draft:
    """The bones of the recorded phantom's CT, with defaults."""
    return make_draft_from_ct(read_ct(data / "phantom_a" / "ct.nii.gz"))


@pytest.mark.parametrize("name", BONES)
def test_a_bone_lies_where_it_is(draft, data, name) -> None:
    mesh = draft.bones[name].mesh
    true, _ = read_ply(data / "phantom_a" / f"{name}.ply")
    median_mm, most_mm, signed_mm, beyond_mm = errors_mm(mesh, true, is_lower=name == "tibia")
    assert median_mm <= 0.10
    assert most_mm <= 0.40
    assert abs(signed_mm) <= 0.08
    # No part of another bone, and no bridge to one.
    assert beyond_mm <= 1.0
    assert is_closed(mesh)


@pytest.mark.parametrize("name", BONES)
def test_a_bone_tells_how_far_its_surface_puts_a_pose_off(draft, data, name) -> None:
    bone = draft.bones[name]
    true, _ = read_ply(data / "phantom_a" / f"{name}.ply")
    off_mm = list(pose_errors_mm(bone, surface_error_mm(bone.mesh, true), seed=1))
    assert len(off_mm) > 50
    told_mm = 2.0 * bone.surface_sd_mm
    assert np.quantile(off_mm, 0.9) <= told_mm
    # And does not hide behind a large number.
    assert told_mm <= 6.0 * np.median(off_mm)


def test_cut_shafts_are_marked_and_the_patella_is_whole(draft) -> None:
    for name, is_cut in (("femur", True), ("tibia", True), ("patella", False)):
        assert draft.bones[name].is_removed.any() == is_cut
    assert draft.fibula is not None
    assert not draft.origin.warnings


@pytest.mark.parametrize("direction", DIRECTIONS, ids=lambda one: one.name)
def test_contours_follow_the_outer_rim_of_the_cortex_in_the_slices(draft, direction) -> None:
    view = make_plan_view(Plan(draft.bones), draft.origin, draft.volume)
    for name, bone in draft.bones.items():
        points, normals = bone.mesh.vertices_mm, bone.mesh.normals
        # Where the slice cuts the surface at about a right angle, away from the cut ends.
        is_across = (np.abs(normals[:, direction.axis]) < 0.3) & ~bone.is_removed
        inside, outside = (
            _grey_at(view, direction, points[is_across] + step_mm * normals[is_across])
            for step_mm in (-1.0, 2.5)
        )
        assert np.median(inside) > 2.0 * np.median(outside), name


def _grey_at(view: PlanView, direction: Direction, points_mm: FloatArray) -> FloatArray:
    """As it is seen in the slices nearest to some points."""
    indices = view.grid.find_slices(direction, points_mm)
    pixels = np.rint(view.grid.find_pixels(direction, points_mm)).astype(int)
    rows, columns = view.grid.shape_of(direction)
    kept = (pixels >= 0).all(axis=1) & (pixels < (columns, rows)).all(axis=1)
    kept &= (indices >= 0) & (indices < view.grid.count_slices(direction))
    return np.array([
        view.volume.slice_of(direction, index)[row, column]
        for index, (column, row) in zip(indices[kept], pixels[kept], strict=True)
    ], dtype=np.float64)  # fmt: skip
