"""Limits that the calibration of a display has to meet, and what is said when it does not."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class DisplayLimits:
    """Limits that a calibration has to meet."""

    fewest_views: int = 6  # that must be used
    accept_mm: float = 0.30  # largest error at the anatomy, held out and predicted, 95 %
    accept_arcmin: float = 2.0  # the same as the eye sees it
    worst_rms_px: float = 0.6  # of what is left at the marks


@dataclass(frozen=True, slots=True)
class Found:
    """What is judged; lengths and angles are 95 % errors at the anatomy."""

    n_views: int
    is_settled: bool
    rms_px: float
    held_out_mm: float
    held_out_arcmin: float
    predicted_mm: float
    predicted_arcmin: float


def judge(found: Found, limits: DisplayLimits) -> list[str]:
    """Why a calibration is not accepted; empty when it is. One sentence each."""
    reasons = []
    if found.n_views < limits.fewest_views:
        reasons.append(f"only {found.n_views} views can be used, {limits.fewest_views} are needed")
    if not found.rms_px <= limits.worst_rms_px:
        return [
            *reasons,
            f"the marks fit badly ({found.rms_px:.2f} px rms, {limits.worst_rms_px:.2f} px are "
            "allowed): pictures of different moments, or not the board of its file",
        ]
    if not found.is_settled:
        reasons.append("the solve did not come to rest: the views do not fix the display")
    for name, mm, arcmin in (
        ("held-out views are off", found.held_out_mm, found.held_out_arcmin),
        ("the predicted 95 % error is", found.predicted_mm, found.predicted_arcmin),
    ):
        if not (mm <= limits.accept_mm and arcmin <= limits.accept_arcmin):
            reasons.append(
                f"{name} {mm:.2f} mm ({arcmin:.1f} arcmin) at the anatomy, "
                f"{limits.accept_mm:.2f} mm ({limits.accept_arcmin:.1f} arcmin) are allowed"
            )
    return reasons
