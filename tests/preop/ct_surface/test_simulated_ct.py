"""The simulator's CT of a knee, from voxels to named surfaces: its meshes are the truth.

A second person beside the recorded phantom of tests/accuracy/test_ct.py.
"""

import numpy as np
import pytest

from navapp.geometry.simplify import is_closed
from navapp.preop.ct_surface import make_surfaces
from navapp.preop.segmentation import segment
from navapp.preop.volume import CtVolume
from sim_devices.anatomy import KneeSpec, make_knee
from tests.kept import make_ct

pytestmark = [pytest.mark.slow, pytest.mark.release]


@pytest.fixture(scope="module")
def knee():
    return make_knee(KneeSpec(4))


@pytest.fixture(scope="module")
def found(knee):
    made = make_ct(knee.spec, (0.8, 0.8, 1.0), seed=4)
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = made.direction * made.spacing_mm, made.origin_mm
    segmentation = segment(CtVolume(made.hounsfield, matrix, made.spacing_mm))
    return segmentation, make_surfaces(segmentation)


def to_mesh_mm(points, mesh):
    """Signed, along the normals of the nearest vertices."""
    from scipy.spatial import cKDTree

    _, nearest = cKDTree(mesh.vertices_mm).query(points)
    return np.einsum("ij,ij->i", points - mesh.vertices_mm[nearest], mesh.normals[nearest])


def test_the_bones_are_named(found):
    segmentation, surfaces = found
    assert {"femur", "tibia", "patella"} <= set(surfaces.bones)
    assert not [said for said in segmentation.warnings if "fibula" not in said]


@pytest.mark.parametrize("name", ["femur", "tibia", "patella"])
def test_surfaces_are_those_of_the_meshes(knee, found, name):
    surface, truth = found[1].bones[name], knee.bones[name]
    assert is_closed(surface.mesh)
    assert not surface.is_cut.any()
    off_mm = to_mesh_mm(surface.mesh.vertices_mm, truth)
    assert np.median(np.abs(off_mm)) <= 0.10
    assert abs(np.median(off_mm)) <= 0.08
    assert np.quantile(np.abs(off_mm), 0.95) <= 0.40
    # And the other way round: nothing of the bone is missing.
    back_mm = to_mesh_mm(truth.vertices_mm, surface.mesh)
    assert np.median(np.abs(back_mm)) <= 0.10
    assert np.quantile(np.abs(back_mm), 0.95) <= 0.40
    assert surface.mesh.volume_mm3() == pytest.approx(truth.volume_mm3(), rel=0.01)
