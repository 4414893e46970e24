"""The check on the patient: simulated touches on a body whose place and size are known."""

from collections.abc import Sequence

import numpy as np
import pytest

from navapp.geometry.transform import FloatArray, skew
from navapp.tools.patient_check import (
    FEWEST_TOUCHES,
    MOST_TOUCHES,
    CheckAnswer,
    CheckResult,
    Touched,
    find_next_place,
    judge_touches,
)

# The end of a bone, more or less: half axes of an ellipsoid, not round about any axis.
AXES_MM, MIDDLE_MM = np.array([40.0, 28.0, 22.0]), np.array([5.0, -8.0, 30.0])
SIGMA_MM, LIMIT_MM = 0.2, 1.0
NO_MOTION = np.zeros(6)


def surface(rng: np.random.Generator, n: int) -> tuple[FloatArray, FloatArray]:
    """(n, 3) places all over the body, and their outward normals."""
    flat = rng.normal(0.0, 1.0, (n, 3))
    flat /= np.linalg.norm(flat, axis=1, keepdims=True)
    normals = flat / AXES_MM
    return MIDDLE_MM + AXES_MM * flat, normals / np.linalg.norm(normals, axis=1, keepdims=True)


TARGETS_MM, _ = surface(np.random.default_rng(1), 60)
CENTRE_MM = TARGETS_MM.mean(axis=0)


def moved(points: FloatArray, motion: FloatArray, growth: float) -> FloatArray:
    """(n, 3) by how much the bone lies beside its model there."""
    arms = points - CENTRE_MM
    return np.asarray(motion[:3] + np.cross(motion[3:], arms) + growth * arms)


def touch_all(
    rng: np.random.Generator,
    n: int,
    motion: FloatArray = NO_MOTION,
    growth: float = 0.0,
    sigma_mm: float = SIGMA_MM,
) -> list[Touched]:
    points, normals = surface(rng, n)
    off = (normals * moved(points, motion, growth)).sum(axis=1) + rng.normal(0.0, sigma_mm, n)
    return [
        Touched(point, normal[None], np.array([one]), sigma_mm)
        for point, normal, one in zip(points, normals, off, strict=True)
    ]


def decided(touches: Sequence[Touched]) -> CheckResult:
    """One touch after the other until there is an answer."""
    for n in range(1, MOST_TOUCHES + 1):
        result = judge_touches(touches[:n], TARGETS_MM, LIMIT_MM)
        if result.answer is not CheckAnswer.OPEN:
            break
    return result


def answers_of(n_checks: int, **how: object) -> list[CheckResult]:
    rng = np.random.default_rng(9)
    return [decided(touch_all(rng, MOST_TOUCHES, **how)) for _ in range(n_checks)]  # type: ignore[arg-type]


def share(results: list[CheckResult], answer: CheckAnswer) -> float:
    return float(np.mean([one.answer is answer for one in results]))


def test_a_right_registration_passes() -> None:
    results = answers_of(50)
    assert share(results, CheckAnswer.PASSED) > 0.85
    assert share(results, CheckAnswer.FAILED) < 0.05
    assert all(one.most_mm <= LIMIT_MM for one in results if one.answer is CheckAnswer.PASSED)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_registration_that_is_a_millimetre_and_a_half_off_fails(axis: int) -> None:
    motion = 1.5 * np.eye(6)[axis]
    results = answers_of(30, motion=motion)
    # Looked at after every touch, and so a little more often than one bound says.
    assert share(results, CheckAnswer.PASSED) <= 0.075
    assert share(results, CheckAnswer.FAILED) > 0.4
    off = np.median([one.measured_mm for one in results if one.answer is CheckAnswer.FAILED])
    assert off == pytest.approx(1.6, abs=0.35)


def test_what_is_far_off_fails_with_the_distance_in_words() -> None:
    result = judge_touches(
        touch_all(np.random.default_rng(2), 20, 4.0 * np.eye(6)[0]), TARGETS_MM, LIMIT_MM
    )
    assert result.answer is CheckAnswer.FAILED
    assert result.reason == f"the bone lies {result.measured_mm:.1f} mm beside its model"
    assert result.measured_mm == pytest.approx(4.0, abs=0.4)
    assert result.least_mm < 4.0 < result.most_mm


@pytest.mark.parametrize("off_mm", [0.0, 8.0])
def test_too_few_touches_decide_nothing(off_mm: float) -> None:
    touches = touch_all(np.random.default_rng(3), FEWEST_TOUCHES, off_mm * np.eye(6)[0], 0.0, 0.01)
    few = judge_touches(touches[:-1], TARGETS_MM, LIMIT_MM)
    assert few.answer is CheckAnswer.OPEN
    assert few.reason == ""


def test_too_many_touches_without_an_answer_say_so() -> None:
    touches = touch_all(np.random.default_rng(4), MOST_TOUCHES, 0.9 * np.eye(6)[1], 0.0, 1.5)
    assert judge_touches(touches[:-1], TARGETS_MM, LIMIT_MM).answer is CheckAnswer.OPEN
    result = judge_touches(touches, TARGETS_MM, LIMIT_MM)
    assert result.answer is CheckAnswer.CANNOT_TELL
    assert str(MOST_TOUCHES) in result.reason


def covariance_of(touches: Sequence[Touched]) -> FloatArray:
    """(6, 6) of the motion about the targets' middle; nothing is known of it before."""
    rows = [
        np.hstack([one.directions, -one.directions @ skew(one.point_mm - CENTRE_MM)]) / one.sigma_mm
        for one in touches
    ]
    information = np.array([row.T @ row for row in rows]).sum(axis=0) + 1e-6 * np.eye(6)
    return np.asarray(np.linalg.inv(information), dtype=np.float64)


@pytest.mark.parametrize("n", [12, 25])
def test_touches_that_agree_by_luck_say_no_more_than_errors_allow(n: int) -> None:
    rng = np.random.default_rng(n)
    touches = [
        Touched(one.point_mm, one.directions, np.zeros(1), SIGMA_MM) for one in touch_all(rng, n)
    ]
    result = judge_touches(touches, TARGETS_MM, LIMIT_MM)
    assert result.measured_mm == pytest.approx(0.0, abs=1e-9)
    assert result.least_mm == 0.0
    motions = rng.multivariate_normal(np.zeros(6), covariance_of(touches), 2000)
    off = [np.sqrt((moved(TARGETS_MM, one, 0.0) ** 2).sum(axis=1).mean()) for one in motions]
    # Nineteen of twenty, within what one chi-square instead of a sum of them makes of it.
    assert result.most_mm == pytest.approx(float(np.percentile(off, 95)), rel=0.15)


def test_bounds_cover_the_truth_nineteen_times_of_twenty() -> None:
    rng = np.random.default_rng(10)
    below, above = [], []
    for _ in range(200):
        motion = rng.normal(0.0, 1.0, 6) * np.array([0.8] * 3 + [0.015] * 3)
        result = judge_touches(touch_all(rng, 15, motion), TARGETS_MM, LIMIT_MM)
        true_mm = float(np.sqrt((moved(TARGETS_MM, motion, 0.0) ** 2).sum(axis=1).mean()))
        below.append(result.least_mm <= true_mm)
        above.append(true_mm <= result.most_mm)
    assert np.mean(below) > 0.9
    assert np.mean(above) > 0.9


def test_a_touch_that_tells_along_three_directions_counts_as_three() -> None:
    rng = np.random.default_rng(11)
    points, _ = surface(rng, 8)
    shift = np.array([0.4, -0.2, 0.3])
    whole = [Touched(point, np.eye(3), shift, SIGMA_MM) for point in points]
    apart = [
        Touched(point, np.eye(3)[k : k + 1], shift[k : k + 1], SIGMA_MM)
        for point in points
        for k in range(3)
    ]
    a, b = (judge_touches(one, TARGETS_MM, LIMIT_MM) for one in (whole, apart))
    assert a.measured_mm == pytest.approx(b.measured_mm)
    assert a.most_mm == pytest.approx(b.most_mm)


def test_touches_that_no_motion_explains_fail() -> None:
    rng = np.random.default_rng(12)
    touches = [
        Touched(one.point_mm, one.directions, rng.normal(0.0, 2.0, 1), SIGMA_MM)
        for one in touch_all(rng, 20)
    ]
    result = judge_touches(touches, TARGETS_MM, LIMIT_MM)
    assert result.answer is CheckAnswer.FAILED
    assert "no motion explains the points" in result.reason


@pytest.mark.parametrize(("growth", "word"), [(0.05, "larger"), (-0.05, "smaller")])
def test_a_bone_of_another_size_fails_by_its_size(growth: float, word: str) -> None:
    results = answers_of(12, growth=growth)
    assert share(results, CheckAnswer.PASSED) == 0.0
    assert share(results, CheckAnswer.FAILED) == 1.0
    # A few touches on one side may look like a shift, or like nothing that a motion makes.
    said = [one.reason for one in results if f"% {word} than its model" in one.reason]
    assert len(said) > 0.5 * len(results)
    percents = [float(one.removeprefix("the bone seems ").split(" %")[0]) for one in said]
    assert np.mean(percents) == pytest.approx(5.0, abs=1.2)


def test_a_shift_of_the_bone_is_no_other_size() -> None:
    for one in answers_of(20, motion=3.0 * np.eye(6)[2]):
        assert "than its model" not in one.reason


def test_few_touches_say_that_the_size_is_not_known() -> None:
    touches = touch_all(np.random.default_rng(13), MOST_TOUCHES)
    few = judge_touches(touches[:7], TARGETS_MM, LIMIT_MM)
    assert few.size_note.startswith("size: cannot tell 2 %")
    sharp = touch_all(np.random.default_rng(13), MOST_TOUCHES, NO_MOTION, 0.0, 0.1)
    assert judge_touches(sharp, TARGETS_MM, LIMIT_MM).size_note == ""


def test_the_share_in_the_size_note_is_how_often_it_would_be_noticed() -> None:
    rng = np.random.default_rng(14)
    touches = touch_all(rng, 18, sigma_mm=0.5)
    note = judge_touches(touches, TARGETS_MM, LIMIT_MM).size_note
    said = float(note.removesuffix(" of 100)").split(" in ")[-1]) / 100.0
    # The size by a fit of its own; nothing is known beforehand but 3 mm, 0.06 rad and a tenth.
    rows = [
        np.concatenate([n, np.cross(p, n), [n @ p]]) / touches[0].sigma_mm
        for n, p in ((one.directions[0], one.point_mm - CENTRE_MM) for one in touches)
    ]
    known = np.eye(7) / np.array([[3.0]] * 3 + [[0.06]] * 3 + [[0.1]])
    rows_all = np.vstack([rows, known])
    sigma = float(np.sqrt(np.linalg.inv(rows_all.T @ rows_all)[6, 6]))
    noticed = 0.02 + sigma * rng.normal(0.0, 1.0, 20000) > 3.6 * sigma
    assert said == pytest.approx(float(noticed.mean()), abs=0.02)


@pytest.mark.parametrize("n", [3, 24])
def test_the_next_place_is_where_it_tells_most(n: int) -> None:
    rng = np.random.default_rng(n)
    slopes = np.array([np.hstack([np.eye(3), -skew(one - CENTRE_MM)]) for one in TARGETS_MM])
    mean_square = np.einsum("nki,nkj->ij", slopes, slopes) / len(slopes)
    prior = np.diag([3.0**-2] * 3 + [0.06**-2] * 3)
    for _ in range(20):
        touches = touch_all(rng, n)
        places, normals = surface(rng, 40)
        chosen = find_next_place(touches, TARGETS_MM, places, normals, SIGMA_MM)
        # The mean square error over the targets after each of them, one by one.
        left = []
        for place, normal in zip(places, normals, strict=True):
            more = [*touches, Touched(place, normal[None], np.zeros(1), SIGMA_MM)]
            covariance = np.linalg.inv(np.linalg.inv(covariance_of(more)) + prior)
            left.append(np.trace(mean_square @ covariance))
        assert chosen == int(np.argmin(left))


def test_after_touches_on_one_side_another_side_is_asked_for() -> None:
    rng = np.random.default_rng(16)
    all_touches = touch_all(rng, 200)
    one_side = [one for one in all_touches if one.directions[0, 0] > 0.9][:8]
    assert len(one_side) == 8
    places, normals = surface(rng, 200)
    chosen = find_next_place(one_side, TARGETS_MM, places, normals, SIGMA_MM)
    assert abs(normals[chosen, 0]) < 0.7


def test_places_asked_for_decide_sooner_than_places_at_random() -> None:
    rng = np.random.default_rng(17)
    places, normals = surface(rng, 150)
    chosen: list[Touched] = []
    for _ in range(12):
        k = find_next_place(chosen, TARGETS_MM, places, normals, SIGMA_MM)
        chosen.append(Touched(places[k], normals[k][None], np.zeros(1), SIGMA_MM))
    bounds = []
    for _ in range(20):
        some = rng.choice(150, 12, replace=False)
        touches = [Touched(places[k], normals[k][None], np.zeros(1), SIGMA_MM) for k in some]
        bounds.append(judge_touches(touches, TARGETS_MM, LIMIT_MM).most_mm)
    assert judge_touches(chosen, TARGETS_MM, LIMIT_MM).most_mm < np.min(bounds)


def test_touches_of_one_place_say_nothing_of_the_size_and_end_nothing() -> None:
    """All at the only target: no touch tells how large the bone is."""
    target = np.array([[1.0, 2.0, 3.0]])
    touches = [Touched(target[0], np.eye(3), np.full(3, 0.1), 0.2)] * FEWEST_TOUCHES
    result = judge_touches(touches, target, LIMIT_MM)
    assert result.answer is CheckAnswer.PASSED
    assert result.size_note.startswith("size: cannot tell")


def test_an_error_that_all_touches_have_in_common_does_not_shrink() -> None:
    touches = touch_all(np.random.default_rng(21), MOST_TOUCHES)
    alone = judge_touches(touches, TARGETS_MM, LIMIT_MM)
    together = judge_touches(touches, TARGETS_MM, LIMIT_MM, common_sigma_mm=0.3)
    assert together.measured_mm == alone.measured_mm
    assert together.most_mm > alone.most_mm + 0.1
