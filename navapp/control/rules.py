"""When a command may be given: what the screen offers and what the controller obeys is one rule.

What only the parts that carry a command out can know (is the cross in sight, does the plan have the
cut, is the gate met) is refused by them, in the same words to the operator.
"""

from navapp.control.commands import (
    PROJECTOR_SETTINGS,
    Accept,
    Cancel,
    CheckMirror,
    ChooseCandidate,
    Command,
    ConfirmCross,
    DistrustRig,
    EnterStage,
    NudgeCross,
    OverrideGate,
    Propose,
    Reconnect,
    Register,
    Reject,
    SetProjector,
    Show,
    ToggleEye,
    ToggleLayer,
)
from navapp.control.states import DeviceHealth, SessionState, Snapshot
from navapp.overlay import LAYERS
from navapp.values import Status


def why_refused(command: Command, snapshot: Snapshot) -> str:
    """Why a command makes no sense in a session as the snapshot has it; empty: it does."""
    match command:
        case Register() | Propose():
            return _why_not_look(command, snapshot)
        case Cancel() if snapshot.state is not SessionState.REGISTERING:
            return "no registration is running"
        case Accept() | Reject():
            return _why_undecided(command, snapshot)
        case ChooseCandidate() if len(snapshot.candidates) < 2:
            return "there is no other candidate"
        case Show() if not snapshot.is_blanked:
            return "the display is not blanked"
        case ToggleEye() if not snapshot.has_eye:
            return "there is no simulated mirror; start `navapp run --mirror`"
        case ToggleLayer() if command.name not in LAYERS:
            return f"there is no layer '{command.name}'"
        case CheckMirror():
            return _why_unchecked(snapshot)
        case NudgeCross() | ConfirmCross() if snapshot.cross_check is None:
            return "no check of the mirror is under way"
        case EnterStage() | OverrideGate():
            return _why_not_enter(command, snapshot)
        case DistrustRig() if snapshot.rig_alarm:
            return "the rig is known to have moved"
        case Reconnect() if not _has_failed_device(snapshot):
            return "no device is lost or in trouble"
        case SetProjector():
            return _why_not_told(command, snapshot)
    return ""


def _why_not_look(command: Register | Propose, snapshot: Snapshot) -> str:
    bone = snapshot.stage.bone
    if snapshot.rig_alarm:
        return snapshot.rig_alarm
    if snapshot.state is SessionState.FAULT:
        return "the camera is lost"
    if snapshot.state is SessionState.REGISTERING and isinstance(command, Register):
        return "a registration is running; cancel it first"
    if not snapshot.is_bone_planned:
        return f"the plan has no model of the {bone}"
    if isinstance(command, Propose):
        is_other = command.left_from_bone.source != bone
        return f"the pose is not one of the {bone}" if is_other else ""
    if command.bone not in ("", bone):
        return f"it was drawn for the {command.bone}; the stage shows the {bone}"
    if command.start is not None and not snapshot.can_draw_start:
        return "this method needs a rough pose: give --prior"
    return ""


def _why_undecided(command: Accept | Reject, snapshot: Snapshot) -> str:
    if snapshot.candidate_id is None:
        return "no candidate is under review"
    if command.candidate_id not in (None, snapshot.candidate_id):
        return "another candidate is under review now"
    if isinstance(command, Reject):
        return ""
    if snapshot.verdict is None:
        return "the candidate is not on the screen yet"
    if snapshot.verdict.status is Status.LOST:
        return "the judge calls this candidate lost"
    return ""


def _why_unchecked(snapshot: Snapshot) -> str:
    if snapshot.cross_check is not None:
        return ""
    if not snapshot.has_mirror:
        return "the display is not seen in a mirror"
    verdict = snapshot.verdict
    is_ok = verdict is not None and verdict.status is Status.OK
    if snapshot.state is not SessionState.NAVIGATING or not is_ok:
        return "the check needs an accepted bone whose pose is OK"
    return ""


def _why_not_enter(command: EnterStage | OverrideGate, snapshot: Snapshot) -> str:
    known = {stage.number: stage for stage in snapshot.stages}
    stage = known.get(command.number)
    if stage is None:
        return f"there is no stage {command.number}"
    if stage.number == snapshot.stage.number:
        return f"stage {stage.number} {stage.name} is in force already"
    if isinstance(command, OverrideGate):
        if snapshot.refused_stage != command.number:
            return f"enter stage {command.number} first, and read what is open"
        if not command.reason.strip():
            return "a gate is overridden with a reason only"
    return ""


def _why_not_told(command: SetProjector, snapshot: Snapshot) -> str:
    if command.name not in PROJECTOR_SETTINGS:
        return f"a projector has no setting '{command.name}'"
    healths = [device.health for device in snapshot.devices if device.kind == "projector"]
    if not healths or healths[0] is DeviceHealth.ABSENT:
        return "there is none to be told: name its backend under [projector]"
    if healths[0] is DeviceHealth.LOST:
        return "it does not answer: check its mains and its cable, then reopen it"
    return ""


def _has_failed_device(snapshot: Snapshot) -> bool:
    # A rig that has moved is not opened again, nor is a recording that was stopped.
    healths = {one.health for one in snapshot.devices if one.kind not in ("rig", "recording")}
    is_failed = bool(healths & {DeviceHealth.TROUBLE, DeviceHealth.LOST})
    return is_failed or (snapshot.state is SessionState.FAULT and not snapshot.rig_alarm)
