"""The tip of a tool from simulated poses."""

import numpy as np
import pytest

from calibration.pivot import solve_pivot
from navapp.errors import ResultError
from navapp.geometry.transform import rotation_from_vector
from tests.many import few_of

TIP_MM = np.array([-14.0, 160.0, -7.0])
PIVOT_MM = np.array([-80.0, -85.0, -1200.0])


def poses(
    rng: np.random.Generator,
    n: int = 300,
    *,
    cone_deg: float = 40.0,
    spin_deg: float = 90.0,
    noise_mm: float = 0.2,
) -> np.ndarray:
    """(n, 4, 4), ten seconds of a tracker.

    The shaft leans to all sides, the tool is turned about it, its place is noisy.
    """
    along = TIP_MM / np.linalg.norm(TIP_MM)
    first = np.cross(along, [1.0, 0.0, 0.0])
    first /= np.linalg.norm(first)
    second = np.cross(along, first)
    found = np.tile(np.eye(4), (n, 1, 1))
    for pose in found:
        angle, lean = rng.uniform(-np.pi, np.pi), np.radians(cone_deg) * np.sqrt(rng.uniform())
        axis = np.cos(angle) * first + np.sin(angle) * second
        spin = rotation_from_vector(along * np.radians(rng.uniform(-spin_deg, spin_deg)))
        pose[:3, :3] = rotation_from_vector(axis * lean) @ spin
        pose[:3, 3] = PIVOT_MM - pose[:3, :3] @ TIP_MM + rng.normal(0.0, noise_mm, 3)
    return found


@pytest.mark.parametrize("seed", few_of(range(20), 3))
def test_a_tip_is_found_to_a_tenth_of_a_millimetre(seed: int) -> None:
    found = solve_pivot(poses(np.random.default_rng(seed)))
    assert np.linalg.norm(found.robust.tip_mm - TIP_MM) < 0.1
    assert np.linalg.norm(found.robust.pivot_mm - PIVOT_MM) < 0.1
    assert found.sigma_mm == pytest.approx(0.2, rel=0.15)
    assert found.bound_mm < 0.15


@pytest.mark.parametrize("seed", few_of(range(10), 3))
def test_wrong_poses_are_named_and_do_no_harm(seed: int) -> None:
    rng = np.random.default_rng(seed)
    given = poses(rng)
    wrong = rng.choice(300, 75, replace=False)
    # All to one side: least squares follows them.
    given[wrong, :3, 3] += rng.uniform(3.0, 30.0, (75, 1)) * np.array([0.6, 0.0, 0.8])
    found = solve_pivot(given)
    assert set(wrong) <= set(found.outliers)
    assert len(found.outliers) <= 78
    assert np.linalg.norm(found.robust.tip_mm - TIP_MM) < 0.1
    assert np.linalg.norm(found.linear.tip_mm - TIP_MM) > 0.3


def test_standard_errors_are_those_of_the_noise() -> None:
    squares = []
    for seed in range(60):
        found = solve_pivot(poses(np.random.default_rng(seed), 40, cone_deg=25.0))
        off = found.robust.tip_mm - TIP_MM
        squares.append(off @ np.linalg.solve(found.covariance_mm2, off))
    assert 2.0 < np.mean(squares) < 4.2


def test_the_bound_covers_the_truth() -> None:
    covered = 0
    for seed in range(60):
        found = solve_pivot(poses(np.random.default_rng(seed), 40, cone_deg=20.0, spin_deg=10.0))
        covered += np.linalg.norm(found.robust.tip_mm - TIP_MM) <= found.bound_mm
    assert covered >= 54


def test_perfect_poses_are_all_used() -> None:
    found = solve_pivot(poses(np.random.default_rng(1), noise_mm=0.0))
    assert found.outliers == []
    np.testing.assert_allclose(found.robust.tip_mm, TIP_MM, atol=1e-6)


def test_the_cone_is_told() -> None:
    found = solve_pivot(poses(np.random.default_rng(1), 300, cone_deg=30.0))
    assert found.half_angle_deg == pytest.approx(30.0, abs=2.0)


@pytest.mark.parametrize(
    ("cone_deg", "spin_deg"), [(3.0, 3.0), (0.0, 90.0)], ids=["hardly at all", "about the shaft"]
)
def test_a_tool_that_was_hardly_turned_is_refused(cone_deg: float, spin_deg: float) -> None:
    given = poses(np.random.default_rng(1), cone_deg=cone_deg, spin_deg=spin_deg)
    with pytest.raises(ResultError, match="hardly turned"):
        solve_pivot(given)


def test_a_swing_about_one_axis_is_refused() -> None:
    given = np.tile(np.eye(4), (40, 1, 1))
    for pose, angle in zip(given, np.linspace(-0.8, 0.8, 40), strict=True):
        pose[:3, :3] = rotation_from_vector([angle, 0.0, 0.0])
        pose[:3, 3] = PIVOT_MM - pose[:3, :3] @ TIP_MM
    with pytest.raises(ResultError, match="hardly turned"):
        solve_pivot(given)


def test_few_poses_are_refused() -> None:
    with pytest.raises(ResultError, match="9 poses are too few"):
        solve_pivot(poses(np.random.default_rng(1), 9))
