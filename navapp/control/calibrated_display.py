"""The display in the mirror: whether what is shown on it is seen where it was calibrated."""

from dataclasses import dataclass
from datetime import date
from typing import Literal

from drivers.interfaces import DisplayInfo
from navapp.control.states import MirrorCheck
from navapp.geometry.display_model import DisplayModel
from navapp.values import Reason

Eyes = Literal["both", "left", "right"]


@dataclass(frozen=True, slots=True, eq=False)
class CalibratedDisplay:
    """A display model, and what is asked of it in a session."""

    model: DisplayModel
    check_minutes: float = 30.0  # after so long the surgeon's check is asked for again
    check_mm: float = 1.0  # what the check may be off by, at the bone
    allows_unaccepted: bool = False
    eyes: Eyes = "both"  # that look into the mirror; the other one is covered

    def find_reason(self, info: DisplayInfo, today: date) -> Reason | None:
        """Why nothing may be lit on a display; None when it may."""
        model, quality = self.model, self.model.quality
        size = model.screen.width_px, model.screen.height_px
        if (info.width, info.height) != size:
            return Reason.DISPLAY_DIFFERS
        if (info.flips_horizontally, info.flips_vertically) != model.backend_flips:
            return Reason.DISPLAY_DIFFERS
        if model.display_name and info.name != model.display_name:
            return Reason.DISPLAY_DIFFERS
        if quality is not None and quality.has_expired(today):
            return Reason.DISPLAY_EXPIRED
        is_accepted = quality is not None and quality.is_accepted
        return None if is_accepted or self.allows_unaccepted else Reason.DISPLAY_NOT_ACCEPTED

    def find_check_reason(self, check: MirrorCheck | None, now_ns: int) -> Reason | None:
        """What the surgeon's check has against guides; None when it was passed lately."""
        if check is None:
            return Reason.MIRROR_UNCHECKED
        # Not passed by what is no number.
        if not 0.0 <= check.residual_mm <= self.check_mm:
            return Reason.MIRROR_CHECK_FAILED
        is_old = now_ns - check.time_ns > self.check_minutes * 60e9
        return Reason.MIRROR_CHECK_OLD if is_old else None
