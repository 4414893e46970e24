"""The check on the patient: touched places tell whether the registration lies where it says.

Every touch says how far the bone lies beside its model along some directions. From all of them
follows the motion that would explain them, with its covariance, and so the mean distance over the
stage's targets by which the registration is off, with a 95 % bound.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from navapp.geometry.transform import FloatArray

# What is thought possible before the first touch: it keeps few touches from telling too much.
_PRIOR_MM, _PRIOR_RAD = 3.0, 0.06
# Fewer touches decide nothing; more than the most say that the check cannot tell.
FEWEST_TOUCHES, MOST_TOUCHES = 6, 30
# A misfit of the touches that one in a thousand right registrations shows.
_MISFIT_SHARE = 0.001
# A size that is off by so many standard deviations is not chance, looked at after every touch.
_SURE_SIGMAS = 3.6
# Whether the touches could tell this share of the size, and how surely they should.
_SIZE, _POWER, _NORMAL_95 = 0.02, 0.95, 1.645


class CheckAnswer(Enum):
    """What a check says."""

    OPEN = "more points"
    PASSED = "passed"
    FAILED = "failed"
    CANNOT_TELL = "cannot tell"


@dataclass(frozen=True, slots=True, eq=False)
class Touched:
    """A place that was touched, all in bone coordinates."""

    point_mm: FloatArray  # (3,) of the model
    directions: FloatArray  # (k, 3) unit: along these it tells something; k is 1, 2 or 3
    off_mm: FloatArray  # (k,) of the bone from the model, along them
    sigma_mm: float  # standard deviation of each


@dataclass(frozen=True, slots=True, eq=False)
class CheckResult:
    """What the touches say together."""

    answer: CheckAnswer
    # root mean square, over the targets, of the motion that explains them
    measured_mm: float
    # least_mm, most_mm: 95 % bounds of that distance, each on its own.
    least_mm: float
    most_mm: float
    limit_mm: float
    reason: str = ""  # in words, of a check that failed or cannot tell
    size_note: str = ""  # in words, when the touches cannot tell whether the bone has this size


def judge_touches(
    touches: Sequence[Touched], targets_mm: FloatArray, limit_mm: float
) -> CheckResult:
    """Decide, or ask for more.

    Args:
        touches: so far.
        targets_mm: (N, 3) of the stage, bone coordinates.
        limit_mm: the smaller of the stage's tolerance and 1 mm.
    """
    middle = targets_mm.mean(axis=0)
    motion, covariance, misfit = _explain(touches, middle)
    jacobian = _slopes(targets_mm, middle)
    mean_square = np.einsum("nki,nkj->ij", jacobian, jacobian) / len(jacobian)
    measured_mm = float(np.sqrt(motion @ mean_square @ motion))
    least_mm, most_mm = _find_bounds(measured_mm, covariance @ mean_square)

    size, size_sigma = _compare_size(touches, middle)
    note = _tell_power(size_sigma)

    def answer(what: CheckAnswer, reason: str = "") -> CheckResult:
        return CheckResult(what, measured_mm, least_mm, most_mm, limit_mm, reason, note)

    if len(touches) < FEWEST_TOUCHES:
        return answer(CheckAnswer.OPEN)
    if misfit < _MISFIT_SHARE:
        return answer(
            CheckAnswer.FAILED, "no motion explains the points: is it this bone, of this size?"
        )
    if abs(size) > _SURE_SIGMAS * size_sigma:
        more = "larger" if size > 0.0 else "smaller"
        return answer(
            CheckAnswer.FAILED, f"the bone seems {100.0 * abs(size):.1f} % {more} than its model"
        )
    if most_mm <= limit_mm:
        return answer(CheckAnswer.PASSED)
    if least_mm > limit_mm:
        return answer(CheckAnswer.FAILED, f"the bone lies {measured_mm:.1f} mm beside its model")
    if len(touches) >= MOST_TOUCHES:
        return answer(CheckAnswer.CANNOT_TELL, f"{MOST_TOUCHES} points did not decide it")
    return answer(CheckAnswer.OPEN)


def find_next_place(
    touches: Sequence[Touched],
    targets_mm: FloatArray,
    places_mm: FloatArray,
    normals: FloatArray,
    sigma_mm: float,
) -> int:
    """Which of some places of the surface, touched next, would make the bound smallest.

    Args:
        touches: so far.
        targets_mm: (N, 3).
        places_mm: (M, 3) that can be touched.
        normals: (M, 3) unit, of the surface there.
        sigma_mm: of a touch.
    """
    middle = targets_mm.mean(axis=0)
    _, covariance, _ = _explain(touches, middle)
    jacobian = _slopes(targets_mm, middle)
    mean_square = np.einsum("nki,nkj->ij", jacobian, jacobian) / len(jacobian)
    rows = np.einsum("mk,mkj->mj", normals, _slopes(places_mm, middle))
    # By Sherman and Morrison: what one more row takes off the mean square error.
    seen = rows @ covariance
    gains = np.einsum("mi,ij,mj->m", seen, mean_square, seen)
    gains /= sigma_mm**2 + np.einsum("mi,mi->m", seen, rows)
    return int(gains.argmax())


def _explain(
    touches: Sequence[Touched], middle_mm: FloatArray
) -> tuple[FloatArray, FloatArray, float]:
    """Motion (6,) of the bone about a point, its covariance, and the misfit's probability."""
    from scipy.special import chdtrc

    prior = np.array([_PRIOR_MM**-2] * 3 + [_PRIOR_RAD**-2] * 3)
    information, right = np.diag(prior), np.zeros(6)
    rows, offs = [], []
    for one in touches:
        slopes = one.directions @ _slopes(one.point_mm[None], middle_mm)[0]
        rows.append(slopes / one.sigma_mm)
        offs.append(one.off_mm / one.sigma_mm)
        information = information + slopes.T @ slopes / one.sigma_mm**2
        right = right + slopes.T @ one.off_mm / one.sigma_mm**2
    covariance = np.linalg.inv(information)
    motion = covariance @ right
    freedom = sum(len(one) for one in offs) - 6
    if freedom < 1:
        return motion, covariance, 1.0
    left = np.concatenate(offs) - np.concatenate(rows) @ motion
    return motion, covariance, float(chdtrc(freedom, float(left @ left)))


def _compare_size(touches: Sequence[Touched], middle_mm: FloatArray) -> tuple[float, float]:
    """By which share the bone seems larger than its model, whatever its motion; its deviation."""
    information = np.zeros((7, 7))
    information[range(6), range(6)] = [_PRIOR_MM**-2] * 3 + [_PRIOR_RAD**-2] * 3
    right = np.zeros(7)
    for one in touches:
        motion = one.directions @ _slopes(one.point_mm[None], middle_mm)[0]
        growth = one.directions @ (one.point_mm - middle_mm)
        slopes = np.column_stack([motion, growth])
        information += slopes.T @ slopes / one.sigma_mm**2
        right += slopes.T @ one.off_mm / one.sigma_mm**2
    covariance = np.linalg.pinv(information, hermitian=True)
    if len(touches) < FEWEST_TOUCHES:
        return 0.0, float("inf")
    return float(covariance[6] @ right), float(np.sqrt(covariance[6, 6]))


def _tell_power(size_sigma: float) -> str:
    """Whether a size that is off by two hundredths would be noticed."""
    from scipy.special import ndtr

    power = float(ndtr(_SIZE / size_sigma - _NORMAL_95))
    if power >= _POWER:
        return ""
    percent = 100.0 * _SIZE
    return f"size: cannot tell {percent:.0f} % (it would be noticed in {100.0 * power:.0f} of 100)"


def _slopes(points_mm: FloatArray, middle_mm: FloatArray) -> FloatArray:
    """(N, 3, 6) of places by a small motion: shift mm, then turn rad about the middle."""
    x, y, z = (points_mm - middle_mm).T
    slopes = np.zeros((len(points_mm), 3, 6))
    slopes[:, :, :3] = np.eye(3)
    slopes[:, 0, 4], slopes[:, 0, 5] = z, -y
    slopes[:, 1, 3], slopes[:, 1, 5] = -z, x
    slopes[:, 2, 3], slopes[:, 2, 4] = y, -x
    return slopes


def _find_bounds(measured_mm: float, errors: FloatArray) -> tuple[float, float]:
    """95 % bounds from below and from above of a root mean square distance.

    Measured squares are a weighted sum of noncentral chi-squares, here taken as one with the mean
    and variance that errors alone would give (Welch 1938, Satterthwaite 1946); the bounds are the
    distances from which so small, or so large, a measurement comes once in twenty times. The upper
    one is never below what errors alone reach: touches that agree by luck say no more than that.

    Args:
        measured_mm: the distance.
        errors: (6, 6) covariance times mean square of its motion.
    """
    from scipy.special import chdtri, chndtrinc

    first, second = float(np.trace(errors)), float(np.trace(errors @ errors))
    freedom, unit = first**2 / second, second / first
    seen = measured_mm**2 / unit
    bounds = [float(chndtrinc(seen, freedom, share)) for share in (0.95, 0.05)]
    low, high = (max(one, 0.0) if np.isfinite(one) else 0.0 for one in bounds)
    high = max(high, float(chdtri(freedom, 0.05)))
    return float(np.sqrt(low * unit)), float(np.sqrt(high * unit))
