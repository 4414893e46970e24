"""A surface's estimate joined with a further block."""

from dataclasses import replace

import numpy as np
import pytest

from navapp.registration.residual_blocks import ResidualBlock, join
from navapp.values import PoseEstimate, Reason, SizedPose
from tests.many import few_of
from tests.registration.shapes import TRUE

CENTRE_MM = np.array([5.0, -3.0, 470.0])
SEEN_MM = CENTRE_MM + 20.0 * np.eye(3)
SIGMAS = np.array([0.05, 0.05, 0.1, 0.002, 0.002, 0.001])
# So wide that the kernel lets everything through: then the surface's residuals say what they show.
WIDE = 100.0
SIGMA, COMMON_SD = 0.3, 0.2


def estimate_of(covariance: np.ndarray, rms_ratio: float = 1.0) -> PoseEstimate:
    return PoseEstimate(TRUE, covariance, 2000, 1.0, 0.1 * rms_ratio, 0.1, 5, True)


SURFACE = estimate_of(np.diag(SIGMAS**2))


def block_of(
    twist: np.ndarray, n: int = 400, seed: int = 1, noise: float = SIGMA, common: float = 0.0
) -> ResidualBlock:
    """What is seen of a motion by that twist, every residual on its own."""
    rng = np.random.default_rng(seed)
    jacobian = rng.normal(0.0, 1.0, (n, 6)) * (3.0, 3.0, 1.0, 100.0, 100.0, 100.0)
    residual = jacobian @ twist + rng.normal(0.0, noise, n) + common
    return ResidualBlock(
        jacobian, residual, np.full(n, SIGMA**2), np.ones(n), COMMON_SD, np.zeros((n, 3))
    )


def moved_by(estimate: PoseEstimate) -> np.ndarray:
    """Twist from `TRUE` to an estimate, for small motions."""
    change = estimate.camera_from_bone @ TRUE.inverse()
    turn = 0.5 * (change.rotation - change.rotation.T)
    rotation = np.array([turn[2, 1], turn[0, 2], turn[1, 0]])
    shift = change.apply(CENTRE_MM[None])[0] - CENTRE_MM
    return np.concatenate([shift, rotation])


def drawn(seed: int) -> np.ndarray:
    """Where the truth lies, as the surface's covariance lets expect."""
    return np.random.default_rng([seed, 5]).normal(0.0, SIGMAS)


def test_noise_as_claimed_gives_least_squares_and_its_covariance() -> None:
    block = block_of(drawn(1), n=4000)
    joined = join(SURFACE, WIDE, block, CENTRE_MM, SEEN_MM)
    rows = np.column_stack([block.jacobian, np.ones(4000)])
    prior = np.diag(np.append(1.0 / SIGMAS**2, 1.0 / COMMON_SD**2))
    normal = rows.T @ rows / SIGMA**2 + prior
    expected = np.linalg.solve(normal, rows.T @ block.residual / SIGMA**2)
    covariance = np.linalg.inv(normal)[:6, :6]
    apart = (moved_by(joined) - expected[:6]) / np.sqrt(np.diag(covariance))
    assert np.abs(apart).max() < 0.5
    # The kernel costs a few per cent, as it should.
    ratio = np.diag(joined.covariance) / np.diag(covariance)
    assert ratio.min() > 0.95
    assert ratio.max() < 1.25


def test_the_truth_lies_where_the_covariance_says() -> None:
    squares = []
    for seed in range(200):
        twist = drawn(seed)
        common = COMMON_SD * np.random.default_rng([seed, 6]).normal()
        block = block_of(twist, n=60, seed=seed, common=common)
        joined = join(SURFACE, WIDE, block, CENTRE_MM, SEEN_MM)
        off = moved_by(joined) - twist
        squares.append(off @ np.linalg.solve(joined.covariance, off))
    assert np.mean(squares) == pytest.approx(6.0, rel=0.2)


def test_an_offset_that_all_have_in_common_moves_the_pose_little() -> None:
    still = block_of(np.zeros(6))
    plain = moved_by(join(SURFACE, WIDE, still, CENTRE_MM, SEEN_MM))
    offset = moved_by(join(SURFACE, WIDE, block_of(np.zeros(6), common=0.3), CENTRE_MM, SEEN_MM))
    assert (np.abs(offset - plain) < 0.4 * SIGMAS).all()


def test_residuals_of_something_else_are_left_out() -> None:
    twist = drawn(3)
    block = block_of(twist)
    residual = block.residual.copy()
    residual[::8] += 6.0
    spoilt = replace(block, residual=residual)
    near = spoilt.find_near(spoilt.jacobian, np.zeros(6), SURFACE.covariance)
    is_near = np.isin(residual, near.block.residual)
    assert is_near[::8].mean() < 0.05
    assert near.n_near == is_near.sum() == len(near.block.residual)
    clean = moved_by(join(SURFACE, WIDE, block, CENTRE_MM, SEEN_MM))
    robust = moved_by(join(SURFACE, WIDE, spoilt, CENTRE_MM, SEEN_MM))
    assert (np.abs(robust - clean) < 0.5 * SIGMAS).all()


@pytest.mark.parametrize("n", [100, 400, 2000])
@pytest.mark.parametrize("n_sigmas", [8.0, 12.0, 15.0, 20.0, 30.0])
def test_a_block_that_contradicts_the_surface_moves_nothing_and_is_told(
    n: int, n_sigmas: float
) -> None:
    """However many of its residuals happen to be small."""
    joined = join(SURFACE, WIDE, block_of(n_sigmas * SIGMAS, n=n), CENTRE_MM, SEEN_MM)
    assert joined.camera_from_bone is SURFACE.camera_from_bone
    np.testing.assert_array_equal(joined.covariance, SURFACE.covariance)
    assert joined.reasons == (Reason.CUES_DISAGREE,)


@pytest.mark.parametrize("seed", few_of(range(20), 3))
def test_blocks_that_agree_are_not_doubted(seed: int) -> None:
    joined = join(SURFACE, WIDE, block_of(drawn(seed), n=60, seed=seed), CENTRE_MM, SEEN_MM)
    assert joined.reasons == ()


def test_a_surface_without_residuals_is_survived() -> None:
    joined = join(
        estimate_of(SURFACE.covariance, rms_ratio=0.0), 1.2, block_of(drawn(3)), CENTRE_MM, SEEN_MM
    )
    assert np.isfinite(joined.covariance).all()


@pytest.mark.parametrize("noise_variance_ratio", [1.0, 0.4])
def test_a_block_that_says_too_little_changes_nothing(noise_variance_ratio: float) -> None:
    few = block_of(drawn(1), n=5)
    sharing = replace(block_of(drawn(1), n=400), n_sharing=np.full(400, 100.0))
    for block in (few, sharing):
        joined = join(SURFACE, WIDE, block, CENTRE_MM, SEEN_MM, noise_variance_ratio)
        assert joined.camera_from_bone is SURFACE.camera_from_bone
        np.testing.assert_allclose(joined.covariance, noise_variance_ratio * SURFACE.covariance)


def test_the_surfaces_noise_is_the_surfaces_alone() -> None:
    """Half of the information each: that of the block stays what it claims."""
    block = block_of(np.zeros(6))
    rows = np.column_stack([block.jacobian, np.ones(len(block.residual))]) / SIGMA
    normal = rows.T @ rows + np.diag([0.0] * 6 + [COMMON_SD**-2])
    alike = estimate_of(np.linalg.inv(normal)[:6, :6])
    whole, quiet = (
        join(alike, WIDE, block, CENTRE_MM, SEEN_MM, noise_variance_ratio)
        for noise_variance_ratio in (1.0, 0.4)
    )
    assert quiet.camera_from_bone.matrix == pytest.approx(whole.camera_from_bone.matrix)
    ratio = np.trace(quiet.covariance[:3, :3]) / np.trace(whole.covariance[:3, :3])
    assert ratio == pytest.approx(0.7, abs=0.05)


def test_more_noise_than_claimed_is_believed() -> None:
    claimed = join(SURFACE, WIDE, block_of(drawn(2)), CENTRE_MM, SEEN_MM)
    noisy = join(SURFACE, WIDE, block_of(drawn(2), noise=2.0 * SIGMA), CENTRE_MM, SEEN_MM)
    assert np.trace(noisy.covariance) > 1.5 * np.trace(claimed.covariance)


def test_less_noise_than_claimed_moves_the_pose_but_makes_no_claim() -> None:
    """The exact one of two blocks that claim the same is followed; the bound stays careful."""
    twist = drawn(4)
    exact = join(SURFACE, WIDE, block_of(twist, noise=0.2 * SIGMA), CENTRE_MM, SEEN_MM)
    modest = replace(SURFACE, rms_mm=0.2 * SURFACE.expected_rms_mm)
    both = join(modest, WIDE, block_of(twist, noise=0.2 * SIGMA), CENTRE_MM, SEEN_MM)
    assert np.linalg.norm((moved_by(exact) - twist) / SIGMAS) < np.linalg.norm(
        (moved_by(both) - twist) / SIGMAS
    )
    claimed = join(SURFACE, WIDE, block_of(twist), CENTRE_MM, SEEN_MM)
    assert np.trace(exact.covariance) > 0.9 * np.trace(claimed.covariance)


def test_residuals_say_nothing_of_what_the_plan_adds_to_a_covariance() -> None:
    """Where a thickness was fitted, small residuals do not make the surface count for more."""
    modest = replace(SURFACE, rms_mm=0.2 * SURFACE.expected_rms_mm)
    claimed, quiet, fitted = (
        join(one, WIDE, block_of(drawn(4)), CENTRE_MM, SEEN_MM)
        for one in (SURFACE, modest, replace(modest, thickness_ratio=0.5))
    )
    np.testing.assert_allclose(moved_by(fitted), moved_by(claimed), rtol=0.2)
    assert np.linalg.norm(moved_by(quiet)) < 0.8 * np.linalg.norm(moved_by(fitted))


def test_too_much_of_something_else_is_told() -> None:
    """A model of another size: where its outline is near, it agrees."""
    block = block_of(drawn(3))
    residual = block.residual.copy()
    residual[np.arange(len(residual)) % 5 < 3] += 6.0
    joined = join(SURFACE, WIDE, replace(block, residual=residual), CENTRE_MM, SEEN_MM)
    assert joined.reasons == (Reason.CUES_DISAGREE,)
    assert joined.camera_from_bone is SURFACE.camera_from_bone


def sized_of(growth_sigma_mm: float) -> SizedPose:
    """The surface's word on the size: nearly none, or a sure one."""
    covariance = np.diag(np.append(SIGMAS, growth_sigma_mm) ** 2)
    return SizedPose(np.zeros(7), covariance, np.array([0.0, 2.0, 5.0]), lever_mm=15.0)


def test_a_block_tells_the_size_that_it_shows_and_leaves_the_pose() -> None:
    rng = np.random.default_rng(7)
    sized, growth_mm, n = sized_of(5.0), 0.4, 400
    still = block_of(np.zeros(6), n=n)
    block = replace(still, arm_mm=rng.normal(0.0, 12.0, (n, 3)))
    block = replace(block, residual=block.residual + growth_mm * block.sized_jacobian(sized)[:, 6])
    joined = join(replace(SURFACE, sized=sized), WIDE, block, CENTRE_MM, SEEN_MM)
    found = joined.sized
    assert found.growth_mm == pytest.approx(growth_mm, abs=3.0 * found.growth_sigma_mm)
    assert found.growth_sigma_mm < 0.05
    # In that size the bone would lie where it lies; its points are shifted by the growth.
    off = moved_by(joined) + found.step[:6]
    assert (np.abs(off) < SIGMAS).all()
    offset_mm = np.array([1.0, 0.0, -2.0])
    shift_mm = found.growth_mm / 15.0 * (sized.arm_mm + offset_mm)
    twist = found.twist_at(offset_mm)
    np.testing.assert_allclose(twist[:3], found.step[:3] + shift_mm)
    np.testing.assert_array_equal(twist[3:], found.step[3:6])


@pytest.mark.parametrize("growth_mm", [-0.65, 0.65])
def test_a_rim_speaks_where_the_surface_tells_a_wrong_size(growth_mm: float) -> None:
    """A ring of edges in the model's own size; the surface is more than two deviations off."""
    angle = np.linspace(0.0, 2.0 * np.pi, 120, endpoint=False)
    outward = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(120)])
    arm_mm, slope_px = 15.0 * outward, 5.0 * outward
    noise = np.random.default_rng(8).normal(0.0, SIGMA, 120)
    ring = ResidualBlock(
        np.column_stack([slope_px, np.cross(arm_mm, slope_px)]),
        noise,
        np.full(120, SIGMA**2),
        np.full(120, 6.0),
        COMMON_SD,
        arm_mm,
    )
    step = np.append(np.zeros(6), growth_mm)
    modest = estimate_of(SURFACE.covariance, rms_ratio=0.5)
    surface = replace(modest, sized=replace(sized_of(0.25), step=step, arm_mm=np.zeros(3)))
    found = join(surface, WIDE, ring, CENTRE_MM, SEEN_MM).sized
    # What all edges may have in common looks like a size.
    assert abs(found.growth_mm) < 2.0 * COMMON_SD / 5.0
    assert found.growth_sigma_mm < 1.5 * COMMON_SD / 5.0


@pytest.mark.parametrize("surface_sd_mm", [0.05, 0.4])
@pytest.mark.parametrize("pulled_px", [-1.8, 1.8])
def test_a_rim_of_which_a_side_lies_elsewhere_pulls_neither_pose_nor_size(
    surface_sd_mm: float, pulled_px: float
) -> None:
    """As where tissue covers three tenths of it."""
    angle = np.linspace(0.0, 2.0 * np.pi, 200, endpoint=False)
    outward = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(200)])
    arm_mm, slope_px = 15.0 * outward, 5.0 * outward
    residual = np.random.default_rng(9).normal(0.0, 0.2, 200)
    residual[:60] += pulled_px
    ring = ResidualBlock(
        np.column_stack([slope_px, np.cross(arm_mm, slope_px)]),
        residual,
        np.full(200, 0.2**2),
        np.full(200, 5.0),
        COMMON_SD,
        arm_mm,
    )
    sigmas = np.append([surface_sd_mm] * 3, [0.002] * 3)
    sized = SizedPose(np.zeros(7), np.diag(np.append(sigmas, 0.1) ** 2), np.zeros(3), 15.0)
    surface = replace(estimate_of(np.diag(sigmas**2)), sized=sized)
    found = join(surface, WIDE, ring, CENTRE_MM, SEEN_MM)
    assert np.abs(moved_by(found)[:2]).max() < 0.08
    assert abs(found.sized.growth_mm) < 0.08


def test_a_block_of_something_else_does_not_tell_the_size() -> None:
    block = block_of(np.zeros(6))
    residual = block.residual.copy()
    residual[np.arange(len(residual)) % 5 < 3] += 6.0
    sized = sized_of(0.1)
    joined = join(
        replace(SURFACE, sized=sized), WIDE, replace(block, residual=residual), CENTRE_MM, SEEN_MM
    )
    assert joined.reasons == (Reason.CUES_DISAGREE,)
    np.testing.assert_array_equal(joined.sized.covariance, sized.covariance)


def test_without_a_block_the_size_is_the_surfaces() -> None:
    few = block_of(drawn(1), n=5)
    step = np.array([0.1, 0.0, -0.2, 0.001, 0.0, 0.0, 0.3])
    sized = replace(sized_of(0.1), step=step)
    joined = join(replace(SURFACE, sized=sized), WIDE, few, CENTRE_MM, SEEN_MM, 0.4)
    np.testing.assert_array_equal(joined.sized.step, step)
    assert joined.sized.growth_sigma_mm == pytest.approx(0.1 * 0.4**0.5)
