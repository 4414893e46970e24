"""The one table of what the operator can do: it feeds keys, footer, help and command palette."""

from collections.abc import Callable
from dataclasses import dataclass

from textual.binding import Binding, BindingType

from navapp.control.commands import (
    Accept,
    Blank,
    Cancel,
    CheckMirror,
    Command,
    ConfirmCross,
    EnterStage,
    NudgeCross,
    Quit,
    Reconnect,
    Register,
    Reject,
    Show,
    ToggleDepth,
    ToggleEye,
)
from navapp.control.states import (
    DeviceHealth,
    SessionState,
    Snapshot,
)
from navapp.values import Status

_KEY_LABELS = {
    "space": "SPACE",
    "enter": "ENTER",
    "left": "LEFT",
    "right": "RIGHT",
    "up": "UP",
    "down": "DOWN",
    "shift+left": "SHIFT LEFT",
    "shift+right": "SHIFT RIGHT",
    "shift+up": "SHIFT UP",
    "shift+down": "SHIFT DOWN",
}
# A step of a cross in the check of the mirror, and one with the shift key.
_STEPS_PX = (("", 1), ("shift+", 10))
_ARROWS = {"left": (-1, 0), "right": (1, 0), "up": (0, -1), "down": (0, 1)}


@dataclass(frozen=True, slots=True)
class Action:
    """One thing the operator can do."""

    name: str  # for programs
    key: str  # as Textual names it; single characters stand for themselves
    label: str  # one or two words for the footer
    description: str  # a sentence for help and palette
    is_enabled: Callable[[Snapshot], bool]  # whether it makes sense now
    needs: str  # what it needs for that, in a few words; empty where it always makes sense
    # made from the snapshot; None for what the screen does by itself.
    command: Callable[[Snapshot], Command] | None = None
    # place in the footer; actions that share one exclude each other. Empty: not there.
    slot: str = ""
    needs_width: bool = False  # in the footer of wide terminals only
    # works on every screen, also while a question is open and while the session is silent.
    is_everywhere: bool = False

    @property
    def key_label(self) -> str:
        """The key for people."""
        return _KEY_LABELS.get(self.key, self.key)

    def binding(self) -> Binding:
        """For Textual."""
        return Binding(self.key, f"app.act('{self.name}')", self.description, show=False)


def _always(_snapshot: Snapshot) -> bool:
    return True


def _in_states(*states: SessionState) -> Callable[[Snapshot], bool]:
    return lambda snapshot: snapshot.state in states


def is_acceptable(snapshot: Snapshot) -> bool:
    """A candidate waits that the judge does not call lost; another one is refused anyway."""
    verdict = snapshot.verdict
    return snapshot.is_candidate and verdict is not None and verdict.status is not Status.LOST


def _can_change_stage(snapshot: Snapshot) -> bool:
    return snapshot.state in (
        SessionState.READY,
        SessionState.REVIEW,
        SessionState.NAVIGATING,
        SessionState.SUSPENDED,
    )


def _has_neighbour(step: int) -> Callable[[Snapshot], bool]:
    return lambda snapshot: (
        _can_change_stage(snapshot) and 1 <= snapshot.stage.number + step <= len(snapshot.stages)
    )


def _to_neighbour(step: int) -> Callable[[Snapshot], Command]:
    return lambda snapshot: EnterStage(snapshot.stage.number + step)


def _has_failed_device(snapshot: Snapshot) -> bool:
    # A rig that has moved is not opened again.
    healths = {device.health for device in snapshot.devices if device.kind != "rig"}
    is_failed = bool(healths & {DeviceHealth.TROUBLE, DeviceHealth.LOST})
    return is_failed or (snapshot.state is SessionState.FAULT and not snapshot.rig_alarm)


def _is_checking(snapshot: Snapshot) -> bool:
    return snapshot.cross_check is not None


def _nudge_action(shift: str, arrow: str, step_px: int) -> Action:
    right, down = _ARROWS[arrow]
    return Action(
        f"nudge-{shift}{arrow}",
        f"{shift}{arrow}",
        "move",
        f"check of the mirror: move the cross by {step_px} px",
        _is_checking,
        "a check of the mirror under way",
        lambda _: NudgeCross(right * step_px, down * step_px),
    )


def _stage_action(number: int) -> Action:
    return Action(
        f"stage-{number}",
        str(number),
        f"stage {number}",
        f"go to stage {number}",
        lambda snapshot: _can_change_stage(snapshot) and snapshot.stage.number != number,
        f"another stage than {number} in force, and no registration that runs",
        lambda _: EnterStage(number),
    )


ACTIONS: tuple[Action, ...] = (
    Action(
        "blank",
        "space",
        "blank",
        "make the display dark, at once; works on every screen",
        _always,
        "",
        lambda _: Blank(),
        slot="blank",
        is_everywhere=True,
    ),
    Action(
        "show",
        "v",
        "show",
        "leave blank: show the guides on the display again",
        lambda snapshot: snapshot.is_blanked,
        "a display that was blanked",
        lambda _: Show(),
        slot="show",
    ),
    Action(
        "accept",
        "a",
        "accept",
        "accept the candidate under review",
        is_acceptable,
        "a candidate on the screen that the judge does not call lost",
        lambda snapshot: Accept(snapshot.candidate_id),
        slot="accept",
    ),
    Action(
        "reject",
        "r",
        "reject",
        "reject the candidate under review",
        lambda snapshot: snapshot.is_candidate,
        "a candidate on the screen",
        lambda snapshot: Reject(snapshot.candidate_id),
        slot="reject",
    ),
    Action(
        "register",
        "g",
        "register",
        "register: find the bone from the session's start pose",
        _in_states(
            SessionState.READY,
            SessionState.REVIEW,
            SessionState.NAVIGATING,
            SessionState.SUSPENDED,
        ),
        "a camera that sees, and no registration that runs",
        lambda _: Register(),
        slot="register",
    ),
    Action(
        "cancel",
        "c",
        "cancel",
        "cancel the registration that is running",
        _in_states(SessionState.REGISTERING),
        "a registration that runs",
        lambda _: Cancel(),
        slot="register",
    ),
    Action(
        "previous-stage",
        "[",
        "back",
        "go back to the previous stage",
        _has_neighbour(-1),
        "a stage before this one, and no registration that runs",
        _to_neighbour(-1),
        slot="previous",
        needs_width=True,
    ),
    Action(
        "next-stage",
        "]",
        "next",
        "go on to the next stage",
        _has_neighbour(1),
        "a stage after this one, and no registration that runs",
        _to_neighbour(1),
        slot="next",
    ),
    *(_stage_action(number) for number in range(1, 6)),
    Action(
        "reconnect",
        "o",
        "reopen",
        "open lost devices, turn the mirror back",
        _has_failed_device,
        "a device that is lost or in trouble",
        lambda _: Reconnect(),
    ),
    Action(
        "depth",
        "z",
        "depth",
        "colour the picture by its depth: matched, or guessed from which side; dense: in front",
        _always,
        "",
        lambda _: ToggleDepth(),
        slot="depth",
        needs_width=True,
    ),
    Action(
        "eye",
        "y",
        "eye",
        "with run --mirror: see what an eye sees in the simulated mirror",
        lambda snapshot: snapshot.is_simulated,
        "the simulated room",
        lambda _: ToggleEye(),
    ),
    Action(
        "layers",
        "l",
        "layers",
        "see the layers of the overlay, switch them on and off",
        _always,
        "",
        slot="layers",
        needs_width=True,
    ),
    Action(
        "cuts",
        "k",
        "cuts",
        "see the cuts of the stage, planned and measured; say that one has been made",
        lambda snapshot: bool(snapshot.cuts),
        "a stage whose bone has planned cuts",
        slot="cuts",
        needs_width=True,
    ),
    Action(
        "mirror",
        "m",
        "check",
        "check what is seen in the mirror, or give the check up",
        lambda snapshot: snapshot.has_mirror,
        "a display in the mirror",
        lambda _: CheckMirror(),
    ),
    *(_nudge_action(shift, arrow, step_px) for shift, step_px in _STEPS_PX for arrow in _ARROWS),
    Action(
        "confirm-cross",
        "enter",
        "confirm",
        "check of the mirror: the cross lies on its point",
        _is_checking,
        "a check of the mirror under way",
        lambda _: ConfirmCross(),
    ),
    Action("devices", "d", "devices", "see the devices in detail", _always, "", slot="devices"),
    Action(
        "events",
        "e",
        "events",
        "see all events",
        _always,
        "",
        slot="events",
        needs_width=True,
    ),
    Action(
        "help", "?", "help", "see all keys, and the legend of the overlay", _always, "", slot="help"
    ),
    Action(
        "quit",
        "q",
        "quit",
        "end the session; asks first while navigating",
        _always,
        "",
        lambda _: Quit(),
        slot="quit",
    ),
)

ACTION_OF_NAME = {action.name: action for action in ACTIONS}
ACTION_OF_KEY_EVERYWHERE = {action.key: action for action in ACTIONS if action.is_everywhere}


def bindings() -> list[BindingType]:
    """Of the application."""
    return [action.binding() for action in ACTIONS]


def say_why_not(action: Action, is_silent: bool) -> str:
    """Why an action that is not possible was not done, in one line."""
    why = "a session that answers" if is_silent else action.needs
    return f"{action.label} needs {why}"


def is_possible(action: Action, snapshot: Snapshot, is_silent: bool) -> bool:
    """Whether the action may be done; on a silent session only what needs no judgement is."""
    if is_silent and action.is_enabled is not _always:
        return False
    return action.is_enabled(snapshot)
