"""A plate's paper from many views: the tip lies better with it than without."""

import numpy as np
import pytest

from navapp.geometry.transform import FloatArray, RigidTransform, rotation_from_vector
from navapp.tools.paper import Paper, as_designed, count_parameters
from navapp.tools.paper_fit import correct_pose, fit_paper
from navapp.tools.plate import Plate
from navapp.tools.plate_fit import PlateFit
from tests.geometry.shapes import toed_in_rig
from tests.tools.plate_lines import SeenPlate

RIG = toed_in_rig()
PLATE = Plate(columns=1, rows=1, faces=2, fold_deg=50.0)
# So far from the plate as a tool's tip.
TIP_MM = np.array([0.0, 80.0, 115.0])
N_VIEWS = 24


def poses(n: int, seed: int) -> list[RigidTransform]:
    """Leaned to all sides, both faces in view."""
    rng = np.random.default_rng(seed)
    turns = rng.uniform(-0.45, 0.45, (n, 3)) + np.array([0.0, 0.4, 0.0])
    places = rng.uniform(-20.0, 20.0, (n, 3)) + np.array([-10.0, 0.0, 330.0])
    return [
        RigidTransform.from_parts("left", "plate", rotation_from_vector(turn), place)
        for turn, place in zip(turns, places, strict=True)
    ]


def seen_at(pose: RigidTransform, printed: FloatArray, rng: np.random.Generator) -> SeenPlate:
    seen = SeenPlate(PLATE, RIG, pose, printed)
    seen.noise_px += rng.normal(0.0, 0.03, (2, seen.edges.edge.max() + 1))[:, seen.edges.edge]
    return seen


@pytest.fixture(scope="module")
def printed() -> FloatArray:
    before = as_designed(PLATE)
    return np.random.default_rng(17).multivariate_normal(before.mean, before.covariance)


@pytest.fixture(scope="module")
def fits(printed: FloatArray) -> list[PlateFit]:
    rng = np.random.default_rng(18)
    before = as_designed(PLATE)
    return [seen_at(pose, printed, rng).fit(pose, before) for pose in poses(N_VIEWS, 19)]


@pytest.fixture(scope="module")
def after(fits: list[PlateFit]) -> Paper:
    return fit_paper(fits, as_designed(PLATE))


def test_calibrated_paper_brings_the_tip_nearer(after: Paper, printed: FloatArray) -> None:
    rng = np.random.default_rng(20)
    off: dict[str, list[FloatArray]] = {"designed": [], "calibrated": []}
    for pose in poses(8, 21):
        seen = seen_at(pose, printed, rng)
        for name, paper in (("designed", as_designed(PLATE)), ("calibrated", after)):
            found = seen.fit(pose, paper).left_from_plate
            # In the plate's frame what stays the same is taken up by the calibration of the tip.
            off[name].append(pose.inverse().apply(found.apply(TIP_MM)) - TIP_MM)
    for measure in (np.std, lambda one, axis: np.abs(one).max(axis=axis)):
        left = {name: float(measure(np.array(one), axis=0).max()) for name, one in off.items()}
        assert left["calibrated"] < 0.7 * left["designed"]


def test_views_tell_of_the_paper_what_their_covariance_says(
    after: Paper, printed: FloatArray
) -> None:
    off = after.mean - printed
    squared = off @ np.linalg.solve(after.covariance, off)
    n = count_parameters(PLATE)
    assert squared < 2.5 * n
    # The fold is what a hand errs most in, and what is seen best.
    sigmas = np.sqrt(np.diag(after.covariance) / np.diag(as_designed(PLATE).covariance))
    assert sigmas[-6:].max() < 0.5
    assert np.abs(off[-3:]).max() < 0.3 * np.abs(printed[-3:]).max()


def test_views_of_a_plate_as_designed_find_nothing_wrong_with_it() -> None:
    fits = [SeenPlate(PLATE, RIG, pose).fit(pose, as_designed(PLATE)) for pose in poses(4, 22)]
    np.testing.assert_allclose(fit_paper(fits, as_designed(PLATE)).mean, 0.0, atol=1e-4)


def test_one_view_tells_what_its_fit_has_told(fits: list[PlateFit]) -> None:
    alone = fit_paper(fits[:1], as_designed(PLATE))
    np.testing.assert_allclose(alone.mean, fits[0].paper, atol=2e-3)
    assert np.linalg.eigvalsh(alone.covariance)[0] > 0.0


def test_a_corrected_pose_is_that_of_a_fit_with_the_paper(
    after: Paper, printed: FloatArray
) -> None:
    rng = np.random.default_rng(23)
    held = Paper(after.mean, 1e-6 * as_designed(PLATE).covariance)
    for pose in poses(3, 24):
        seen = seen_at(pose, printed, rng)
        fit = seen.fit(pose, as_designed(PLATE))
        again = seen.fit(pose, held).left_from_plate
        corrected = correct_pose(fit, after)
        moved = float(np.linalg.norm(fit.left_from_plate.apply(TIP_MM) - again.apply(TIP_MM)))
        left = float(np.linalg.norm(corrected.apply(TIP_MM) - again.apply(TIP_MM)))
        assert left < 0.35 * moved
