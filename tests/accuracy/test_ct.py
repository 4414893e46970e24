"""Surfaces out of a CT whose truth is known: told apart without a seed, where the cortex ends."""

import numpy as np
import pytest

from navapp.geometry.ply import read_ply
from navapp.geometry.simplify import is_closed
from navapp.preop.plan_drafts import Draft, make_draft_from_ct
from navapp.preop.volume import read_ct
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
