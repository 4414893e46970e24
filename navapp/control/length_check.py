"""What several looks at a known length say of the rig that measures it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

# Fewer do not say how far they scatter.
_FEWEST_LOOKS = 3
_NORMAL, _TAIL = 1.96, 0.975


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


@dataclass(frozen=True, slots=True)
class LengthCheck:
    """A known length in view, measured with the session's rig.

    Attributes:
        captured_ns: when it was seen last.
        ratio: measured over true.
        bound: 95 % bound of the error of `ratio`.
        n_looks: behind it.
        is_off: surely wrong by more than may be.
        is_within: surely not.
    """

    captured_ns: int
    ratio: float
    bound: float
    n_looks: int
    is_off: bool = False
    is_within: bool = False

    @property
    def is_judged(self) -> bool:
        """There were looks enough to say how far they scatter."""
        return self.n_looks >= _FEWEST_LOOKS

    def __str__(self) -> str:
        return (
            f"100 mm on the board are measured as {100.0 * self.ratio:.2f} +- "
            f"{100.0 * self.bound:.2f} mm"
        )


def pooled(lengths: Sequence[Length], captured_ns: int, worst_share: float) -> LengthCheck:
    """One check of several looks.

    What each look knows of its own error does not know a board that moves between the exposures,
    nor one that bends: the looks' scatter does, once they are enough, and the larger one counts.

    Args:
        lengths: at least one.
        captured_ns: of the last one.
        worst_share: of a length that may be wrong.

    Source: Student's interval for a mean.
    """
    from scipy.special import stdtrit

    n = len(lengths)
    ratios = np.array([one.ratio for one in lengths])
    sigmas = np.array([one.sigma for one in lengths])
    ratio, bound = float(ratios.mean()), _NORMAL * float(np.sqrt((sigmas**2).sum())) / n
    if n < _FEWEST_LOOKS:
        return LengthCheck(captured_ns, ratio, bound, n)
    scatter = float(stdtrit(n - 1, _TAIL)) * float(ratios.std(ddof=1)) / n**0.5
    bound = max(bound, scatter)
    off = abs(ratio - 1.0)
    return LengthCheck(
        captured_ns, ratio, bound, n, off - bound > worst_share, off + bound <= worst_share
    )
