"""The one table of what the operator can do: it feeds keys, footer, help and command palette."""

from collections.abc import Callable
from dataclasses import dataclass

from textual.binding import Binding, BindingType

from navapp.control.commands import (
    NO_CANDIDATE,
    Accept,
    Blank,
    Cancel,
    CheckMirror,
    ChooseCandidate,
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
from navapp.control.rules import why_refused
from navapp.control.states import Snapshot

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
# What needs no answer of the session.
_HEEDLESS = ("blank", "quit")
# A step of a cross in the check of the mirror, and one with the shift key.
_STEPS_PX = (("", 1), ("shift+", 10))
ARROWS = {"left": (-1, 0), "right": (1, 0), "up": (0, -1), "down": (0, 1)}


@dataclass(frozen=True, slots=True)
class Action:
    """One thing the operator can do."""

    name: str  # for programs
    key: str  # as Textual names it; single characters stand for themselves
    label: str  # one or two words for the footer
    description: str  # a sentence for help and palette
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


def _shown_candidate(snapshot: Snapshot) -> int:
    """A key decides about what was on the screen, and about nothing else."""
    return NO_CANDIDATE if snapshot.candidate_id is None else snapshot.candidate_id


def _to_neighbour(step: int) -> Callable[[Snapshot], Command]:
    return lambda snapshot: EnterStage(snapshot.stage.number + step)


def _nudge_action(shift: str, arrow: str, step_px: int) -> Action:
    right, down = ARROWS[arrow]
    return Action(
        f"nudge-{shift}{arrow}",
        f"{shift}{arrow}",
        "move",
        f"check of the mirror: move the cross by {step_px} px",
        lambda snapshot: _choose_or_nudge(snapshot, right * step_px, down * step_px),
    )


def _choose_or_nudge(snapshot: Snapshot, right_px: int, down_px: int) -> Command:
    """The arrows to left and right go through the candidates that wait for a decision."""
    if len(snapshot.candidates) > 1 and right_px != 0:
        return ChooseCandidate(1 if right_px > 0 else -1)
    return NudgeCross(right_px, down_px)


def _stage_action(number: int) -> Action:
    return Action(
        f"stage-{number}",
        str(number),
        f"stage {number}",
        f"go to stage {number}",
        lambda _: EnterStage(number),
    )


ACTIONS: tuple[Action, ...] = (
    Action(
        "blank",
        "space",
        "blank",
        "make the display dark, at once; works on every screen",
        lambda _: Blank(),
        slot="blank",
        is_everywhere=True,
    ),
    Action(
        "show",
        "v",
        "show",
        "leave blank: show the guides on the display again",
        lambda _: Show(),
        slot="show",
    ),
    Action(
        "gates",
        "t",
        "gates",
        "see and confirm the time-out and the next stage's gate",
        slot="show",
    ),
    Action(
        "accept",
        "a",
        "accept",
        "accept the candidate under review",
        lambda snapshot: Accept(_shown_candidate(snapshot)),
        slot="accept",
    ),
    Action(
        "reject",
        "r",
        "reject",
        "reject the candidate under review",
        lambda snapshot: Reject(_shown_candidate(snapshot)),
        slot="reject",
    ),
    Action(
        "register",
        "g",
        "register",
        "register: find the bone where it is known or drawn",
        lambda _: Register(),
        slot="register",
    ),
    Action(
        "start",
        "b",
        "box",
        "draw a box around the bone, and search in it",
        slot="start",
        needs_width=True,
    ),
    Action("picks", "p", "picks", "pick landmarks in the picture, and search from them"),
    Action(
        "cancel",
        "c",
        "cancel",
        "cancel the registration that is running",
        lambda _: Cancel(),
        slot="register",
    ),
    Action(
        "previous-stage",
        "[",
        "back",
        "go back to the previous stage",
        _to_neighbour(-1),
        slot="previous",
        needs_width=True,
    ),
    Action(
        "next-stage",
        "]",
        "next",
        "go on to the next stage",
        _to_neighbour(1),
        slot="next",
    ),
    *(_stage_action(number) for number in range(1, 6)),
    Action(
        "reconnect",
        "o",
        "reopen",
        "open lost devices, turn the mirror back",
        lambda _: Reconnect(),
    ),
    Action(
        "depth",
        "z",
        "depth",
        "colour the picture by its depth: matched, or guessed",
        lambda _: ToggleDepth(),
    ),
    Action(
        "near",
        "w",
        "whole",
        "see the region around the bone, or the whole picture",
    ),
    Action(
        "eye",
        "y",
        "eye",
        "see what an eye sees in the mirror (run --mirror)",
        lambda _: ToggleEye(),
    ),
    Action(
        "layers",
        "l",
        "layers",
        "see the layers of the overlay, switch them on and off",
        slot="layers",
        needs_width=True,
    ),
    Action(
        "steps",
        "k",
        "steps",
        "see and confirm the stage's cuts, holes and parts",
        slot="steps",
        needs_width=True,
    ),
    Action(
        "tools",
        "u",
        "tools",
        "see pointer and drill, and check the bone with the pointer",
        slot="tools",
        needs_width=True,
    ),
    Action(
        "mirror",
        "m",
        "check",
        "begin the check of the mirror, or give it up",
        lambda _: CheckMirror(),
    ),
    *(_nudge_action(shift, arrow, step_px) for shift, step_px in _STEPS_PX for arrow in ARROWS),
    Action(
        "confirm-cross",
        "enter",
        "confirm",
        "check of the mirror: the cross lies on its point",
        lambda _: ConfirmCross(),
    ),
    Action("plan", "i", "plan", "look at the plan: slices, bones, warnings"),
    Action("calibration", "h", "calibration", "see how old the calibrations are, and what moved"),
    Action("settings", "s", "settings", "see the settings in force"),
    Action("devices", "d", "devices", "see the devices in detail", slot="devices"),
    Action(
        "events",
        "e",
        "events",
        "see all events",
        slot="events",
        needs_width=True,
    ),
    Action("help", "?", "help", "see all keys, and the legend of the overlay", slot="help"),
    Action(
        "quit",
        "q",
        "quit",
        "end the session; asks first while navigating",
        lambda _: Quit(),
        slot="quit",
    ),
)

ACTION_OF_NAME = {action.name: action for action in ACTIONS}
ACTION_OF_KEY_EVERYWHERE = {action.key: action for action in ACTIONS if action.is_everywhere}


def bindings() -> list[BindingType]:
    """Of the application."""
    return [action.binding() for action in ACTIONS]


def is_possible(action: Action, snapshot: Snapshot, is_silent: bool) -> bool:
    """Whether an action makes sense now; of a silent session only what needs no answer does."""
    if action.command is None or action.name in _HEEDLESS:
        return True
    return not is_silent and not why_refused(action.command(snapshot), snapshot)
