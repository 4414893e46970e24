"""The check on the patient: touched places tell whether the registration lies where it says.

Every touch says how far the bone lies beside its model along some directions. From all of them
follows the motion that would explain them, with its covariance, and so the distance over the
stage's targets by which the registration is off, with 95 % bounds.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from navapp.geometry.transform import FloatArray, twist_slopes

# What is thought possible before the first touch (standard deviations): it keeps few touches from
# telling too much. A motion's shift and turn, a bone's growth.
_PRIOR_MM, _PRIOR_RAD, _PRIOR_SIZE = 3.0, 0.06, 0.1
_PRIOR = np.array([_PRIOR_MM**-2] * 3 + [_PRIOR_RAD**-2] * 3)
# Fewer touches decide nothing; after the most the check cannot tell.
FEWEST_TOUCHES, MOST_TOUCHES = 6, 30
# A misfit of the touches that one in a thousand right registrations shows.
_MISFIT_SHARE = 0.001
# A size that is off by so many standard deviations is not chance, looked at after every touch.
_SURE_SIGMAS = 3.6
# Whether the touches could tell this share of the size, and how surely they should.
_SIZE, _POWER = 0.02, 0.95


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
    name: str = ""  # of the landmark; empty: anywhere on the surface


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
    touches: Sequence[Touched],
    targets_mm: FloatArray,
    limit_mm: float,
    common_sigma_mm: float = 0.0,
) -> CheckResult:
    """Decide, or ask for more.

    Args:
        touches: so far.
        targets_mm: (N, 3) of the stage, bone coordinates.
        limit_mm: the smaller of the stage's tolerance and 1 mm.
        common_sigma_mm: standard deviation of an error that all touches have in common along each
            axis, as that of the tip's calibration.
    """
    middle_mm = targets_mm.mean(axis=0)
    found = _explain(touches, middle_mm, common_sigma_mm)
    mean_square = _mean_square(targets_mm, middle_mm)
    measured_mm = float(np.sqrt(found.motion @ mean_square @ found.motion))
    least_mm, most_mm = _find_bounds(measured_mm, found.covariance @ mean_square)
    note = _tell_power(found.size_sigma) if len(touches) >= FEWEST_TOUCHES else ""
    answer, reason = _decide(found, least_mm, most_mm, limit_mm, len(touches))
    if answer is CheckAnswer.FAILED and not reason:
        reason = f"the bone lies {measured_mm:.1f} mm beside its model"
    return CheckResult(answer, measured_mm, least_mm, most_mm, limit_mm, reason, note)


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
    middle_mm = targets_mm.mean(axis=0)
    covariance = _explain(touches, middle_mm, 0.0).covariance
    mean_square = _mean_square(targets_mm, middle_mm)
    rows = np.einsum("mk,mkj->mj", normals, twist_slopes(places_mm - middle_mm))
    # By Sherman and Morrison: what one more row takes off the mean square error.
    seen = rows @ covariance
    gains = np.einsum("mi,ij,mj->m", seen, mean_square, seen)
    gains /= sigma_mm**2 + np.einsum("mi,mi->m", seen, rows)
    return int(gains.argmax())


@dataclass(frozen=True, slots=True, eq=False)
class _Explained:
    """The motion of the bone that explains touches, and whether it is one."""

    motion: FloatArray  # (6,) shift mm, turn rad, about the targets' middle
    covariance: FloatArray  # (6, 6)
    misfit: float  # how often touches of such a motion fit as badly
    size: float  # by which share the bone seems larger than its model, whatever its motion
    size_sigma: float  # standard deviation of that


def _explain(
    touches: Sequence[Touched], middle_mm: FloatArray, common_sigma_mm: float
) -> _Explained:
    from scipy.special import chdtrc

    # Six of the motion, one of the size.
    information, right = np.diag(np.append(_PRIOR, _PRIOR_SIZE**-2)), np.zeros(7)
    common, rows, offs = np.zeros((6, 3)), [np.empty((0, 6))], [np.empty(0)]
    for one in touches:
        motion = one.directions @ twist_slopes(one.point_mm[None] - middle_mm)[0]
        growth = one.directions @ (one.point_mm - middle_mm)
        slopes = np.column_stack([motion, growth])
        information = information + slopes.T @ slopes / one.sigma_mm**2
        right = right + slopes.T @ one.off_mm / one.sigma_mm**2
        common += motion.T @ one.directions / one.sigma_mm**2
        rows.append(motion / one.sigma_mm)
        offs.append(one.off_mm / one.sigma_mm)
    covariance = np.linalg.inv(information[:6, :6])
    moved = covariance @ right[:6]
    off = np.concatenate(offs)
    left = off - np.concatenate(rows) @ moved
    misfit = float(chdtrc(len(off) - 6, float(left @ left))) if len(off) > 6 else 1.0
    by_common = covariance @ common
    with_size = np.linalg.inv(information)
    return _Explained(
        moved,
        covariance + common_sigma_mm**2 * by_common @ by_common.T,
        misfit,
        float((with_size @ right)[6]),
        float(np.sqrt(with_size[6, 6])),
    )


def _decide(
    found: _Explained, least_mm: float, most_mm: float, limit_mm: float, n_touches: int
) -> tuple[CheckAnswer, str]:
    """The answer, and why; of a bone that lies elsewhere the reason is left to the caller."""
    if n_touches < FEWEST_TOUCHES:
        return CheckAnswer.OPEN, ""
    if found.misfit < _MISFIT_SHARE:
        reason = "no motion explains the points: is it this bone, of this size?"
        return CheckAnswer.FAILED, reason
    if abs(found.size) > _SURE_SIGMAS * found.size_sigma:
        more = "larger" if found.size > 0.0 else "smaller"
        reason = f"the bone seems {100.0 * abs(found.size):.1f} % {more} than its model"
        return CheckAnswer.FAILED, reason
    if most_mm <= limit_mm:
        return CheckAnswer.PASSED, ""
    if least_mm > limit_mm:
        return CheckAnswer.FAILED, ""
    if n_touches >= MOST_TOUCHES:
        return CheckAnswer.CANNOT_TELL, f"{n_touches} points did not decide it"
    return CheckAnswer.OPEN, ""


def _tell_power(size_sigma: float) -> str:
    """Whether the test above would notice a size that is off by two hundredths."""
    from scipy.special import ndtr

    power = float(ndtr(_SIZE / size_sigma - _SURE_SIGMAS))
    if power >= _POWER:
        return ""
    percent = 100.0 * _SIZE
    return f"size: cannot tell {percent:.0f} % (it would be noticed in {100.0 * power:.0f} of 100)"


def _mean_square(targets_mm: FloatArray, middle_mm: FloatArray) -> FloatArray:
    """(6, 6) M: m M m is the mean squared distance that a motion m moves the targets by."""
    jacobian = twist_slopes(targets_mm - middle_mm)
    return np.asarray(np.einsum("nki,nkj->ij", jacobian, jacobian) / len(jacobian))


def _find_bounds(measured_mm: float, errors: FloatArray) -> tuple[float, float]:
    """95 % bounds from below and from above of a root mean square distance.

    The measured square is a weighted sum of noncentral chi-squares, here taken as one with the mean
    and variance that errors alone would give (Welch 1938, Satterthwaite 1946). A true distance at
    the upper bound would give a smaller measurement once in twenty times, one at the lower bound a
    larger one. The upper bound is never below what errors alone reach: touches that agree by luck
    say no more than that.

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
