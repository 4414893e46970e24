"""How a tracker works."""

from dataclasses import dataclass
from typing import Literal

Method = Literal["bimcc", "paper", "icp"]
# What can be left out of the production chain, to see what it is worth.
Part = Literal["fill", "backward pairs", "contour", "second look", "judge"]


@dataclass(frozen=True, slots=True)
class TrackerSettings:
    """Chosen, all of them."""

    # `bimcc` is the production chain; `paper` is the paper's proposal, `icp` its state of the art.
    method: Method = "bimcc"
    # A pose that the judge refuses is carried on too, to be measured; it stays refused.
    follows_refused: bool = False
    # nearest and farthest surface that the rig is used for.
    depth_mm: tuple[float, float] = (300.0, 700.0)
    # parts of `bimcc` that are not made; nothing but an evaluation asks for that.
    leaves_out: frozenset[Part] = frozenset()
