import numpy as np
import pytest

from sim_devices.misses import miss_cut, miss_line, miss_plane
from sim_devices.planned_cuts import Cut

CUT = Cut("femur", np.array([1.0, 2.0, 3.0]), np.array([0.0, 0.6, 0.8]), (80.0, 60.0))


def test_a_saw_misses_by_a_millimetre_and_one_and_a_half_degrees() -> None:
    made = [miss_cut(CUT, np.random.default_rng([seed, 1])) for seed in range(2000)]
    offset = np.array([CUT.heights_mm(cut.point_mm[None])[0] for cut in made])
    tilt = np.degrees([np.arccos(np.clip(cut.normal @ CUT.normal, -1.0, 1.0)) for cut in made])
    assert abs(offset.mean()) < 0.1
    assert offset.std() == pytest.approx(1.0, abs=0.06)
    assert np.sqrt((tilt**2).mean()) == pytest.approx(1.5, abs=0.08)
    beside = [np.linalg.norm(np.cross(cut.point_mm - CUT.point_mm, CUT.normal)) for cut in made]
    assert max(beside) < 1e-9
    tilts = np.array([cut.normal - CUT.normal for cut in made])
    # About every axis in the plane.
    assert np.abs(tilts.mean(axis=0)).max() < 0.003


def test_a_drill_misses_across_its_line() -> None:
    entry, axis = np.zeros(3), np.array([0.0, 0.0, 1.0])
    lines = [miss_line(entry, axis, np.random.default_rng(seed)) for seed in range(1000)]
    shifts = np.array([point for point, _ in lines])
    assert np.abs(shifts[:, 2]).max() < 1e-12
    assert np.sqrt((shifts**2).sum(axis=1).mean()) == pytest.approx(1.0, abs=0.07)


def test_the_same_seed_misses_alike() -> None:
    a, b = (miss_cut(CUT, np.random.default_rng(7)) for _ in range(2))
    np.testing.assert_array_equal(a.normal, b.normal)


def test_a_cut_that_is_made_again_takes_more() -> None:
    """One in ten is: none of those is higher than its first attempt."""
    n_again = 0
    for seed in range(400):
        made = miss_cut(CUT, np.random.default_rng(seed))
        rng = np.random.default_rng(seed)
        rng.uniform()
        point_mm, normal = miss_plane(CUT.point_mm, CUT.normal, rng)
        is_again = bool(np.abs(made.normal - normal).max() > 0.0)
        n_again += is_again
        higher_mm = float((made.point_mm - point_mm) @ CUT.normal)
        assert higher_mm <= 1e-9 if is_again else higher_mm == 0.0
    assert 25 <= n_again <= 55


def test_a_steady_hand_misses_less() -> None:
    usual, steady = (miss_cut(CUT, np.random.default_rng(7), times) for times in (1.0, 0.2))
    np.testing.assert_allclose(
        steady.point_mm - CUT.point_mm, 0.2 * (usual.point_mm - CUT.point_mm)
    )
