import numpy as np
import pytest

from sim_devices.tools import hand_meshes, make_chuck_mesh, make_drill_mesh


@pytest.mark.parametrize("mesh", [make_drill_mesh(), make_chuck_mesh(), *hand_meshes()])
def test_instruments_are_closed_and_their_triangles_are_small(mesh):
    assert mesh.volume_mm3() > 100.0
    corners = mesh.vertices_mm[mesh.faces]
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    # Longer edges would cut across the lens distortion.
    assert edges.max() < 21.0
