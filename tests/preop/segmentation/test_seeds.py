import numpy as np
import pytest

from navapp.preop.segmentation.bone_naming import parts_of
from navapp.preop.segmentation.seeds import with_seeds
from navapp.preop.volume import CtVolume
from tests.preop.ct_phantoms import OBLIQUE, lattice, leaning_axes, points_of

SIZE, SPACING_MM = (60, 50, 40), (1.0, 1.0, 1.5)
MIDDLES_MM = np.array([[-18.0, 0.0, 0.0], [18.0, 0.0, 0.0], [0.0, 14.0, 18.0]])


@pytest.fixture(params=["straight", "oblique", "leaning"])
def cores(request):
    """Three balls of 5 mm, and the volume that they are in."""
    axes = {"straight": np.eye(3), "oblique": OBLIQUE, "leaning": leaning_axes()}[request.param]
    matrix = lattice(SIZE, SPACING_MM, axes)
    ct = CtVolume(np.zeros(SIZE[::-1], np.int16), matrix, np.linalg.norm(matrix[:3, :3], axis=0))
    away = np.linalg.norm(points_of(SIZE, matrix)[..., None, :] - MIDDLES_MM, axis=-1)
    near = away < 5.0
    return np.where(near.any(axis=-1), 1 + near.argmax(axis=-1), 0).astype(np.int32), ct


def named_bones(cores, seeds):
    labels, ct = cores
    return with_seeds(parts_of(labels, ct.lps_from_index), labels, ct, seeds).bones


def test_a_seed_in_or_near_a_core_names_it(cores):
    seeds = {"femur": MIDDLES_MM[1], "tibia": MIDDLES_MM[0] + [0.0, -15.0, 0.0]}
    assert named_bones(cores, seeds) == {"femur": 2, "tibia": 1}


def test_a_seed_out_of_reach_names_nothing(cores):
    for away_mm in (18.0, 60.0, 1000.0):
        seeds = {"tibia": MIDDLES_MM[0] + [0.0, -away_mm, 0.0]}
        assert named_bones(cores, seeds) == {}


def test_of_two_seeds_in_one_core_the_first_names_it(cores):
    seeds = {"tibia": MIDDLES_MM[0], "femur": MIDDLES_MM[0] + 1.0}
    assert named_bones(cores, seeds) == {"tibia": 1}
