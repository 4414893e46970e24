"""What the two pictures themselves say against a pose: cameras that moved, no light, a cover."""

import math
from dataclasses import replace

from navapp.geometry.rectification import RectifiedGeometry
from navapp.stereo import PictureHealth, StereoHealth
from navapp.tracking.judge import OK_ERROR_MM
from navapp.values import Reason, RowCheck, Status, Verdict

_SURE_SIGMAS = 3.0
# A bone fills half of its box and more; what lies around it may be black.
_UNUSABLE_SHARE = 0.7
# Noise alone keeps two sharp pictures of one scene within a few per cent of each other.
_UNLIKE_RATIO = 2.0


def with_pair_doubts(
    verdict: Verdict, health: StereoHealth, geometry: RectifiedGeometry, depth_mm: float
) -> Verdict:
    """A verdict, with what its pair of pictures has against it: that comes first, as the cause.

    Args:
        verdict: of the judge.
        health: of the pair.
        geometry: of the pair.
        depth_mm: of the bone.
    """
    doubts = pair_doubts(health, geometry, depth_mm)
    verdict = replace(verdict, predicted_tre_mm=_widened_mm(verdict, health, geometry, depth_mm))
    if not doubts:
        return verdict
    status = Status.DEGRADED if verdict.status is Status.OK else verdict.status
    return replace(verdict, status=status, reasons=(*doubts, *verdict.reasons))


def pair_doubts(
    health: StereoHealth, geometry: RectifiedGeometry, depth_mm: float
) -> tuple[Reason, ...]:
    """What the health of a pair has against any pose at a depth.

    Rows tell of turns about the line between the cameras, and those alone cost little. But what
    turned a camera about that line turned it as far about others, and a turn that moves a picture
    sideways by v px moves the measured depth by z^2 / (f B) v.
    """
    doubts = _picture_doubts(health)
    doubts += [Reason.ROWS_DISAGREE] * (health.has_lost_rows or _is_off(health, geometry, depth_mm))
    return tuple(doubts)


def row_check(
    health: StereoHealth, geometry: RectifiedGeometry, depth_mm: float
) -> RowCheck | None:
    """What a pair says of its rig; None when its pictures or its points are too poor to tell.

    Rows that are lost tell nothing either: what is matched where nothing is to be matched looks
    the same.
    """
    if math.isnan(health.row_offset_px) or _picture_doubts(health):
        return None
    return RowCheck(health.row_offset_px, _is_off(health, geometry, depth_mm))


def _picture_doubts(health: StereoHealth) -> list[Reason]:
    both = (health.left, health.right)
    is_dark = any(one.dark_share > _UNUSABLE_SHARE for one in both)
    is_clipped = any(one.saturated_share > _UNUSABLE_SHARE for one in both)
    doubts = [Reason.PICTURE_DARK] * is_dark + [Reason.PICTURE_OVEREXPOSED] * is_clipped
    return doubts or [Reason.PICTURES_UNLIKE] * _are_unlike(*both)


def _is_off(health: StereoHealth, geometry: RectifiedGeometry, depth_mm: float) -> bool:
    return bool(_row_cost_mm(health, geometry, depth_mm) > OK_ERROR_MM)


def _row_cost_mm(health: StereoHealth, geometry: RectifiedGeometry, depth_mm: float) -> float:
    """What rows that surely disagree may cost in depth; 0 when noise explains them."""
    offset_px = abs(health.row_offset_px)
    if not offset_px > _SURE_SIGMAS * health.row_offset_sigma_px:
        return 0.0
    return offset_px * depth_mm**2 / (geometry.focal_px * geometry.baseline_mm)


def _widened_mm(
    verdict: Verdict, health: StereoHealth, geometry: RectifiedGeometry, depth_mm: float
) -> float | None:
    """The predicted error with what is known against the rig."""
    if verdict.predicted_tre_mm is None:
        return None
    return math.hypot(verdict.predicted_tre_mm, _row_cost_mm(health, geometry, depth_mm))


def _are_unlike(left: PictureHealth, right: PictureHealth) -> bool:
    return max(left.detail, right.detail) > _UNLIKE_RATIO * min(left.detail, right.detail)
