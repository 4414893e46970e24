"""Commands as JSON, for a session's event file."""

from collections.abc import Mapping
from typing import Any

from navapp.control.commands import (
    Accept,
    Blank,
    Cancel,
    CheckMirror,
    CheckPicks,
    ChooseCandidate,
    Command,
    ConfirmCondition,
    ConfirmCross,
    ConfirmStep,
    DistrustRig,
    DropPoint,
    EnterStage,
    ForgetPoints,
    Interrupt,
    NudgeCross,
    OverrideGate,
    Propose,
    Quit,
    ReadThickness,
    Reconnect,
    Register,
    Reject,
    SetProjector,
    Show,
    ToggleDepth,
    ToggleEye,
    ToggleLayer,
    TouchPoint,
    WithdrawCondition,
    WithdrawStep,
)
from navapp.control.prior_files import prior_from_json, prior_to_json
from navapp.errors import SequenceError
from navapp.geometry.transform import RigidTransform
from navapp.values import Prior

_PLAIN: dict[str, type] = {
    "cancel": Cancel,
    "blank": Blank,
    "show": Show,
    "depth": ToggleDepth,
    "eye": ToggleEye,
    "check_mirror": CheckMirror,
    "confirm_cross": ConfirmCross,
    "drop_point": DropPoint,
    "forget_points": ForgetPoints,
    "reconnect": Reconnect,
    "interrupt": Interrupt,
    "quit": Quit,
}
# Older recordings do not say which candidate was meant: the one that was under review.
_DECISIONS: dict[str, type[Accept] | type[Reject]] = {"accept": Accept, "reject": Reject}
# Commands about something that has a name.
_Named = (
    ToggleLayer | ConfirmStep | WithdrawStep | ConfirmCondition | WithdrawCondition | SetProjector
)
_NAMED: dict[str, type[_Named]] = {
    "layer": ToggleLayer,
    "confirm_step": ConfirmStep,
    "withdraw_step": WithdrawStep,
    "confirm": ConfirmCondition,
    "withdraw": WithdrawCondition,
    "projector": SetProjector,
}
# What recordings before holes and parts call them.
_READ_NAMED = {**_NAMED, "confirm_cut": ConfirmStep, "withdraw_cut": WithdrawStep}
_NAMES = {kind: name for name, kind in (_PLAIN | _DECISIONS | _NAMED).items()}


def command_to_json(command: Command) -> dict[str, Any]:
    """A command as a JSON object."""
    if isinstance(command, EnterStage):
        return {"command": "stage", "number": command.number}
    if isinstance(command, OverrideGate):
        return {"command": "override", "number": command.number, "reason": command.reason}
    if isinstance(command, _Named):
        return {"command": _NAMES[type(command)], "name": command.name}
    if isinstance(command, ReadThickness):
        thickness_mm = list(command.thickness_mm)
        return {"command": "thickness", "name": command.name, "thickness_mm": thickness_mm}
    if isinstance(command, NudgeCross):
        nudge_px = [command.right_px, command.down_px]
        return {"command": "nudge_cross", "nudge_px": nudge_px}
    if isinstance(command, Register):
        if command.start is None:
            return {"command": "register"}
        start = prior_to_json(command.start)
        return {"command": "register", "start": start, "bone": command.bone}
    if isinstance(command, Propose):
        pose = command.left_from_bone
        return {"command": "propose", "bone": pose.source, "camera_from_model": pose.to_list()}
    if isinstance(command, TouchPoint):
        return {"command": "touch_point", "landmark": command.landmark}
    if isinstance(command, CheckPicks):
        return {"command": "check_picks", "start": prior_to_json(Prior(picks=command.picks))}
    if isinstance(command, DistrustRig):
        return {"command": "distrust_rig", "why": command.why}
    if isinstance(command, ChooseCandidate):
        return {"command": "choose", "step": command.step}
    if isinstance(command, Accept | Reject):
        return {"command": _NAMES[type(command)], "candidate_id": command.candidate_id}
    return {"command": _NAMES[type(command)]}


def command_from_json(value: Mapping[str, Any]) -> Command:
    """The command of such an object.

    Raises:
        SequenceError: it is none.
    """
    name = value.get("command")
    try:
        if name == "stage":
            return EnterStage(int(value["number"]))
        if name == "override":
            return OverrideGate(int(value["number"]), str(value["reason"]))
        if name in _READ_NAMED:
            return _READ_NAMED[name](str(value["name"]))
        if name == "thickness":
            thickness_mm = tuple(float(one) for one in value["thickness_mm"])
            return ReadThickness(str(value["name"]), thickness_mm)
        if name == "nudge_cross":
            right_px, down_px = value["nudge_px"]
            return NudgeCross(int(right_px), int(down_px))
        if name == "register":
            start = value.get("start")
            given = None if start is None else prior_from_json(start)
            return Register(given, str(value.get("bone", "")))
        if name == "propose":
            matrix = value["camera_from_model"]
            return Propose(RigidTransform("left", str(value["bone"]), matrix))
        if name == "touch_point":
            return TouchPoint(str(value["landmark"]))
        if name == "check_picks":
            return CheckPicks(prior_from_json(value["start"]).picks)
        if name == "choose":
            return ChooseCandidate(int(value["step"]))
        if name == "distrust_rig":
            return DistrustRig(str(value["why"]))
        if name in _DECISIONS:
            candidate_id = value.get("candidate_id")
            return _DECISIONS[name](None if candidate_id is None else int(candidate_id))
        command: Command = _PLAIN[str(name)]()
        return command
    except (LookupError, ValueError, TypeError, AttributeError) as error:
        raise SequenceError(
            f"the session's events hold a command '{name}' that is unknown or damaged",
            remedy="replay it with the version that recorded it",
        ) from error
