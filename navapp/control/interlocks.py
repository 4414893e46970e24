"""Whether guides may be shown: one answer for display, overlay, log and screen."""

from dataclasses import replace
from statistics import median

from navapp.control.mirror_error import MirrorError
from navapp.control.states import (
    LimbLine,
    OtherBone,
    Rates,
    SessionState,
    Snapshot,
    ToolLine,
)
from navapp.values import Reason, Status

# A pose older than this shows where the bone was, not where it is, whatever is configured.
MAX_POSE_AGE_MS = 500.0
# Latencies of which the median tells whether a computer is too slow.
_FEWEST_LATENCIES = 10


def judge(draft: Snapshot) -> Snapshot:
    """A snapshot with the interlocks' answer; without guides its picture shows none either."""
    judged = replace(draft, reasons=check_interlocks(draft))
    is_young = judged.pose_age_ms is not None and judged.pose_age_ms <= _longest_ms(judged)
    is_reviewed = judged.is_candidate and is_young and not judged.is_blanked
    if not is_reviewed:
        judged = replace(judged, residual_picture=None)
    if judged.is_navigable or is_reviewed or draft.plain_picture is None:
        return judged
    return replace(judged, picture=draft.plain_picture)


def grow_older(snapshot: Snapshot, now_ns: int) -> Snapshot:
    """The same snapshot judged at a later moment: what it knows of poses has become older."""
    passed_ms = max(now_ns - snapshot.time_ns, 0) / 1e6
    others = tuple(
        other if other.age_ms is None else replace(other, age_ms=other.age_ms + passed_ms)
        for other in snapshot.others
    )
    age_ms = None if snapshot.pose_age_ms is None else snapshot.pose_age_ms + passed_ms
    limb = snapshot.limb
    if limb is not None and limb.age_ms is not None:
        limb = replace(limb, age_ms=limb.age_ms + passed_ms)
    tools = tuple(
        tool if tool.age_ms is None else replace(tool, age_ms=tool.age_ms + passed_ms)
        for tool in snapshot.tools
    )
    return judge(replace(snapshot, pose_age_ms=age_ms, others=others, limb=limb, tools=tools))


def check_interlocks(snapshot: Snapshot) -> tuple[Reason, ...]:
    """Why guides must not be shown, the most urgent first; empty means they may.

    A pure function of the snapshot; the snapshot's own `reasons` do not matter.
    """
    reasons: list[Reason] = []
    if snapshot.is_blanked:
        reasons.append(Reason.BLANKED)
    if snapshot.rig_alarm:
        reasons.append(Reason.RIG_MOVED)
    elif snapshot.state is SessionState.FAULT:
        reasons.append(Reason.DEVICE_FAULT)
    if snapshot.is_camera_silent:
        reasons.append(Reason.CAMERA_SILENT)
    reasons += snapshot.device_reasons
    if snapshot.mirror_error is not None:
        reasons += _of_mirror(snapshot.mirror_error)
    if snapshot.mirror_reason is not None:
        reasons.append(snapshot.mirror_reason)
    if not snapshot.is_bone_planned:
        reasons.append(Reason.STAGE_WITHOUT_BONE)
    if snapshot.state is SessionState.SUSPENDED:
        reasons.append(Reason.BONE_LOST)
    elif snapshot.state is not SessionState.NAVIGATING:
        reasons.append(Reason.NOT_NAVIGATING)
    if snapshot.state in (SessionState.NAVIGATING, SessionState.SUSPENDED):
        reasons += _of_pose(snapshot)
    check = snapshot.patient_check
    if check is not None and check.has_failed:
        reasons.append(Reason.CHECK_FAILED)
    if not all(line.is_met for line in snapshot.time_out):
        reasons.append(Reason.TIME_OUT_OPEN)
    return tuple(reasons)


def _of_mirror(error: MirrorError) -> list[Reason]:
    """When no layer is left: what would have to change first."""
    if not error.is_dark:
        return []
    return [Reason.OTHER_EYE if error.off_layers else Reason.MIRROR_INEXACT]


def is_limb_current(limb: LimbLine) -> bool:
    """Whether angles and gaps may be shown as those of now."""
    return limb.age_ms is not None and limb.age_ms <= MAX_POSE_AGE_MS


def is_tool_current(tool: ToolLine) -> bool:
    """Whether what a tool said may be shown as where it is now."""
    return tool.age_ms is not None and tool.age_ms <= MAX_POSE_AGE_MS


def is_current(other: OtherBone) -> bool:
    """Whether what is known of another bone may be shown as where it is now."""
    is_ok = other.verdict is not None and other.verdict.status is Status.OK
    return is_ok and other.age_ms is not None and other.age_ms <= MAX_POSE_AGE_MS


def _of_pose(snapshot: Snapshot) -> list[Reason]:
    verdict = snapshot.verdict
    if verdict is None or snapshot.left_from_bone is None:
        return [Reason.BONE_LOST] if snapshot.state is SessionState.NAVIGATING else []
    reasons: list[Reason] = []
    if verdict.status is not Status.OK:
        reasons += verdict.reasons or (Reason.BONE_LOST,)
    if snapshot.pose_age_ms is None or snapshot.pose_age_ms > _longest_ms(snapshot):
        reasons.append(Reason.TOO_SLOW if is_too_slow(snapshot) else Reason.POSE_TOO_OLD)
    if snapshot.has_mirror and snapshot.pose_at_light is None:
        reasons.append(Reason.MOVES_TOO_FAST)
    return reasons


def is_too_slow(snapshot: Snapshot) -> bool:
    """Whether poses are too old before the next one comes, picture after picture."""
    rates = snapshot.rates
    if rates.frames_per_s is None or len(rates.latency_history_ms) < _FEWEST_LATENCIES:
        return False
    return _latency_ms(rates) + 1e3 / rates.frames_per_s > _longest_ms(snapshot)


def describe_slowness(snapshot: Snapshot) -> str:
    """How many pictures a second there are, and how many guides would need; of a slow computer."""
    rates = snapshot.rates
    if rates.frames_per_s is None or not rates.latency_history_ms:
        return Reason.TOO_SLOW.value
    # A picture is handled for as long as the next one is waited for.
    needed = 2e3 / _longest_ms(snapshot)
    return (
        f"too slow: {rates.frames_per_s:.1f} pictures a second, {_latency_ms(rates):.0f} ms late; "
        f"guides need {needed:.0f}"
    )


def _latency_ms(rates: Rates) -> float:
    return median(rates.latency_history_ms[-_FEWEST_LATENCIES:])


def _longest_ms(snapshot: Snapshot) -> float:
    """How old a pose may be."""
    return min(snapshot.valid_ms, MAX_POSE_AGE_MS)
