"""The axis of a tool from simulated turns about itself."""

import numpy as np
import pytest

from calibration.tool_axis import solve_axis
from navapp.errors import ResultError
from navapp.geometry.transform import FloatArray, rotation_from_vector
from tests.many import few_of

AXIS = np.array([0.01, 0.40, 0.9165]) / np.linalg.norm([0.01, 0.40, 0.9165])
# The tip lies beside the axis, towards its end.
TIP_MM = np.array([-3.0, 70.0, 128.0])
LEANS = ((0.1, 0.2, 2.0), (-0.3, 0.1, 1.6))


def turn_about(
    rng: np.random.Generator,
    lean: tuple[float, float, float],
    *,
    n: int = 60,
    swept_deg: float = 110.0,
    noise_deg: float = 0.3,
) -> FloatArray:
    """(n, 4, 4) of a tool that is turned to and fro about one line of the room."""
    held = rotation_from_vector(lean)
    poses = np.tile(np.eye(4), (n, 1, 1))
    for pose, phase in zip(poses, np.linspace(0.0, 2.0 * np.pi, n), strict=True):
        spin = rotation_from_vector(0.5 * np.radians(swept_deg) * np.sin(phase) * AXIS)
        noise = rotation_from_vector(rng.normal(0.0, np.radians(noise_deg), 3))
        pose[:3, :3] = noise @ held @ spin
        pose[:3, 3] = rng.normal(0.0, 100.0, 3)
    return poses


def turns(rng: np.random.Generator, **how: float) -> list[FloatArray]:
    return [turn_about(rng, lean, **how) for lean in LEANS]  # type: ignore[arg-type]


def off_deg(axis: FloatArray) -> float:
    return float(np.degrees(np.arctan2(np.linalg.norm(np.cross(axis, AXIS)), axis @ AXIS)))


@pytest.mark.parametrize("seed", few_of(range(20), 4))
def test_an_axis_is_found_from_turns_about_two_lines(seed: int) -> None:
    found = solve_axis(turns(np.random.default_rng(seed)), TIP_MM)
    assert off_deg(found.axis) < 0.25
    assert np.linalg.norm(found.axis) == pytest.approx(1.0)
    assert found.rms_deg == pytest.approx(0.3 * np.sqrt(2.0), rel=0.25)


def test_without_noise_the_axis_is_exact() -> None:
    found = solve_axis(turns(np.random.default_rng(1), noise_deg=0.0), TIP_MM)
    assert off_deg(found.axis) < 1e-4
    assert found.sigma_rad < 1e-6


def test_one_turn_is_enough() -> None:
    found = solve_axis([turn_about(np.random.default_rng(2), LEANS[0])], TIP_MM)
    assert off_deg(found.axis) < 0.3


def test_the_standard_deviation_covers_what_is_off() -> None:
    sigmas = []
    for seed in range(30):
        found = solve_axis(turns(np.random.default_rng(seed), n=40), TIP_MM)
        sigmas.append(np.radians(off_deg(found.axis)) / found.sigma_rad)
    # Two components; neighbours that err together would make it a factor three more.
    assert 0.1 < np.sqrt(np.mean(np.square(sigmas)) / 2.0) < 1.0


def test_it_is_told_how_far_each_turn_went() -> None:
    rng = np.random.default_rng(3)
    given = [
        turn_about(rng, lean, swept_deg=swept, noise_deg=0.05)
        for lean, swept in zip(LEANS, (60.0, 150.0), strict=True)
    ]
    assert solve_axis(given, TIP_MM).swept_deg == pytest.approx((60.0, 150.0), abs=1.0)


def test_more_than_a_whole_turn_is_told_as_such() -> None:
    rng = np.random.default_rng(3)
    given = [turn_about(rng, lean, swept_deg=400.0, noise_deg=0.05) for lean in LEANS]
    assert solve_axis(given, TIP_MM).swept_deg == pytest.approx((400.0, 400.0), abs=2.0)


@pytest.mark.parametrize("which", [0, 1])
def test_a_tool_that_was_hardly_turned_is_refused(which: int) -> None:
    rng = np.random.default_rng(4)
    given = turns(rng)
    given[which] = turn_about(rng, LEANS[which], swept_deg=30.0)
    with pytest.raises(ResultError, match=r"turned the tool by 3[0-9] deg only"):
        solve_axis(given, TIP_MM)


def test_few_poses_are_refused() -> None:
    rng = np.random.default_rng(5)
    with pytest.raises(ResultError, match="too few poses"):
        solve_axis([turn_about(rng, LEANS[0]), turn_about(rng, LEANS[1], n=9)], TIP_MM)
    with pytest.raises(ResultError, match="too few poses"):
        solve_axis([], TIP_MM)


def test_the_axis_points_towards_the_tip() -> None:
    given = turns(np.random.default_rng(6))
    there, back = solve_axis(given, TIP_MM).axis, solve_axis(given, -TIP_MM).axis
    assert there @ TIP_MM > 0.0
    np.testing.assert_allclose(back, -there, atol=1e-9)


def test_wrong_poses_are_left_out() -> None:
    rng = np.random.default_rng(7)
    given = turns(rng, noise_deg=0.1)
    clean = solve_axis(given, TIP_MM)
    for one in given:
        for number in rng.choice(20, 6, replace=False):
            # All to one side, and in one part of the turn: the mean follows them.
            one[number, :3, :3] = rotation_from_vector((0.2, 0.0, 0.0)) @ one[number, :3, :3]
    found = solve_axis(given, TIP_MM)
    assert off_deg(found.axis) < 0.15
    assert found.rms_deg < 1.5 * clean.rms_deg
