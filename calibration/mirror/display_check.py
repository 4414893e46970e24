"""Whether a display in a mirror is still where its calibration has it, by new views."""

from dataclasses import dataclass

import numpy as np

from calibration.mirror.display_acceptance import DisplayLimits
from calibration.mirror.seen_views import Scene, SeenView
from calibration.mirror.view_errors import look_with
from navapp.errors import ResultError
from navapp.geometry.camera import Camera
from navapp.geometry.display_model import DisplayModel

_FEWEST = 3


@dataclass(frozen=True, slots=True)
class DisplayCheck:
    """Result of checking a display on new views."""

    n_views: int
    # error_mm, error_arcmin: 95 % of the distances between guides and their points.
    error_mm: float
    error_arcmin: float
    reasons: tuple[str, ...]  # why the display should not be used; empty when it may


def check_display(
    scene: Scene,
    views: list[SeenView],
    model: DisplayModel,
    lens: Camera | None = None,
    limits: DisplayLimits | None = None,
) -> DisplayCheck:
    """Judge a display by views that it was not solved with.

    Args:
        scene: what all views have in common.
        views: that show board and pattern.
        model: as its file has it.
        lens: of the eye's camera; None: solved from these views.
        limits: that must be met.

    Raises:
        ResultError: too few views to tell anything.
    """
    limits = limits or DisplayLimits()
    if len(views) < _FEWEST:
        raise ResultError(
            f"only {len(views)} views show board and pattern, {_FEWEST} are needed",
            remedy="show the board at the site to all three cameras, the pattern to the eye's",
        )
    is_mirrored = model.flips_columns ^ model.flips_rows
    if any(view.is_mirrored != is_mirrored for view in views):
        reason = "the pattern is seen the other way round: a flip was changed since"
        return DisplayCheck(len(views), float("nan"), float("nan"), (reason,))
    mm, arcmin = look_with(scene, views, model, lens).quantile(0.95)
    reasons = []
    if np.isnan(mm):
        reasons.append("the pattern is not seen beside the board in any view")
    elif not (mm <= limits.accept_mm and arcmin <= limits.accept_arcmin):
        reasons.append(
            f"guides appear {mm:.2f} mm ({arcmin:.1f} arcmin) from where they should, "
            f"{limits.accept_mm:.2f} mm ({limits.accept_arcmin:.1f} arcmin) are allowed: mirror, "
            "monitor or cameras have moved"
        )
    return DisplayCheck(len(views), mm, arcmin, tuple(reasons))
