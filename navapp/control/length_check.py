"""What several looks at a known length say of the rig that measures it."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Protocol

import numpy as np

# Fewer do not say how far they scatter; of more the newest count, so that a move is soon seen.
FEWEST_LOOKS, _MOST_LOOKS = 3, 5
# An alarm has two pools as large as it needs: so many looks of a showing are of use.
_LARGEST_POOL = 10
MOST_LOOKS = 2 * _LARGEST_POOL
_TAIL = 0.975
# An alarm cannot be taken back, and a long session asks a thousand times: two-sided 99.99 %.
_SURE_TAIL = 0.99995
# A board held still scatters as its marks do; or so little that three looks which scatter like that
# are seven standard errors from being wrong by the limit.
_MOST_EXCESS, _LITTLE = 3.0, 0.25


class Length(Protocol):
    """A measured length over the true one."""

    @property
    def ratio(self) -> float:
        """1.0: as it is."""
        ...

    @property
    def sigma(self) -> float:
        """Its standard error."""
        ...


class Finding(Enum):
    """What a known length says of the rig."""

    OFF = "off"
    DOUBTFUL = "doubtful"
    WITHIN = "within"
    NOT_JUDGED = "not judged"


@dataclass(frozen=True, slots=True)
class LengthCheck:
    """A known length in view, measured with the session's rig."""

    captured_ns: int  # when it was seen last
    ratio: float  # measured over true
    bound: float  # 95 % bound of the error of `ratio`
    n_looks: int  # behind it
    # OFF: surely wrong by more than may be; WITHIN: at 95 % not; DOUBTFUL: neither; NOT_JUDGED: too
    # few looks, or they scatter as only a board does that is moved about.
    finding: Finding = Finding.NOT_JUDGED

    @property
    def is_judged(self) -> bool:
        """It says something of the rig."""
        return self.finding is not Finding.NOT_JUDGED

    def __str__(self) -> str:
        if self.is_judged:
            return (
                f"100 mm on the board are measured as {100.0 * self.ratio:.2f} +- "
                f"{100.0 * self.bound:.2f} mm"
            )
        if self.n_looks < FEWEST_LOOKS:
            return f"{self.n_looks} of {FEWEST_LOOKS} looks at the board"
        return "the board is not held still"


@dataclass(frozen=True, slots=True)
class _Pool:
    """Looks of one showing, taken together."""

    n: int  # so many
    ratio: float  # their mean
    sigma: float  # standard error of one look, from what the looks know of themselves
    scatter: float  # standard deviation of the looks

    @classmethod
    def of(cls, lengths: Sequence[Length]) -> "_Pool":
        """Of at least one."""
        n = len(lengths)
        ratios = np.array([one.ratio for one in lengths])
        sigma = float(np.sqrt(np.mean([one.sigma**2 for one in lengths])))
        return cls(n, float(ratios.mean()), sigma, float(ratios.std(ddof=1)) if n > 1 else 0.0)

    def bound(self, tail: float, scatter: float, freedom: int) -> float:
        """Of the mean's error: what the looks know of themselves, or how they scatter.

        Args:
            tail: of the distribution, below it.
            scatter: standard deviation of looks like these ...
            freedom: ... estimated with so many degrees of freedom; 0: it is not known.

        Source: Student's interval for a mean; the normal one.
        """
        from scipy.special import ndtri, stdtrit

        known = float(ndtri(tail)) * self.sigma
        found = float(stdtrit(freedom, tail)) * scatter if freedom > 0 else 0.0
        return max(known, found) / float(np.sqrt(self.n))

    def is_still(self, worst_share: float) -> bool:
        """The looks scatter as those at a board held still do."""
        return self.scatter <= max(_MOST_EXCESS * self.sigma, _LITTLE * worst_share)


def pool_lengths(lengths: Sequence[Length], captured_ns: int, worst_share: float) -> LengthCheck:
    """One check of several looks: of the newest.

    What each look knows of its own error does not know a board that moves between the exposures,
    nor one that bends: the looks' scatter does, once they are enough, and the larger one counts.

    Args:
        lengths: of one showing, oldest first; at least one.
        captured_ns: of the last one.
        worst_share: of a length that may be wrong.
    """
    pool = _Pool.of(lengths[-_MOST_LOOKS:])
    bound = pool.bound(_TAIL, pool.scatter, pool.n - 1 if pool.n >= FEWEST_LOOKS else 0)
    finding = Finding.DOUBTFUL
    if _are_off(lengths, worst_share):
        finding = Finding.OFF
    elif pool.n < FEWEST_LOOKS or not pool.is_still(worst_share):
        finding = Finding.NOT_JUDGED
    elif abs(pool.ratio - 1.0) + bound <= worst_share:
        finding = Finding.WITHIN
    return LengthCheck(captured_ns, pool.ratio, bound, pool.n, finding)


def _are_off(lengths: Sequence[Length], worst_share: float) -> bool:
    """Two pools that share no look are both surely off, and to the same side."""
    sizes = range(FEWEST_LOOKS, min(_LARGEST_POOL, len(lengths) // 2) + 1)
    return any(
        _agree(_Pool.of(lengths[-2 * n : -n]), _Pool.of(lengths[-n:]), worst_share) for n in sizes
    )


def _agree(one: _Pool, other: _Pool, worst_share: float) -> bool:
    """Of two pools of the same size: how looks scatter is told best by both."""
    pools = one, other
    scatter = float(np.hypot(one.scatter, other.scatter)) / 2**0.5
    freedom = one.n + other.n - 2
    side = np.sign(one.ratio - 1.0)
    return all(
        pool.is_still(worst_share)
        and side * (pool.ratio - 1.0) - pool.bound(_SURE_TAIL, scatter, freedom) > worst_share
        for pool in pools
    )
