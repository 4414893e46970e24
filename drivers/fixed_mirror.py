"""The mirror mount of a rig whose mirror does not move."""

import math

from drivers.interfaces import MirrorInfo
from navapp.errors import UnsupportedControl


class FixedMirror:
    """A mirror mount at a known angle that never moves.

    Raises:
        ValueError: the angle is not a number.
    """

    def __init__(self, angle_deg: float) -> None:
        if not math.isfinite(angle_deg):
            raise ValueError("the angle of a fixed mirror must be a finite number")
        self._angle_deg = float(angle_deg)

    @property
    def info(self) -> MirrorInfo:
        """Not movable."""
        return MirrorInfo("fixed mirror", "fixed", is_simulated=False, is_movable=False)

    def open(self) -> None:
        """Nothing to connect."""

    def home(self, timeout_s: float) -> None:
        """Nothing to find: the angle is known."""

    def move_to(self, angle_deg: float, timeout_s: float) -> None:
        """Refused, even to where it stands."""
        raise UnsupportedControl(
            f"the mirror is fixed at {self._angle_deg:g} deg and cannot be moved",
            subject="mirror",
            remedy="turn it by hand and give the new angle under [mirror]",
        )

    def position_deg(self) -> float:
        """The configured angle."""
        return self._angle_deg

    def stop(self) -> None:
        """It stands already."""

    def close(self) -> None:
        """Nothing to disconnect."""
