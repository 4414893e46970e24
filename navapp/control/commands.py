"""What an operator can ask of a session."""

from dataclasses import dataclass

from navapp.geometry.transform import RigidTransform
from navapp.values import Pick, Prior


@dataclass(frozen=True, slots=True)
class Register:
    """Start the first registration (again)."""

    # what the operator has just drawn or picked: later ones of the same bone begin from it too.
    # None: what was given last, at first the session's prior; an empty one: the session's prior.
    start: Prior | None = None
    bone: str = ""  # that was drawn; empty: the stage's


@dataclass(frozen=True, slots=True)
class Cancel:
    """Stop the registration that is running."""


@dataclass(frozen=True, slots=True)
class Propose:
    """Offer a pose by hand as the candidate; it is judged as it stands, not refined."""

    left_from_bone: RigidTransform


# What accept and reject name when no candidate was on the screen: there never is one of that
# number.
NO_CANDIDATE = 0


@dataclass(frozen=True, slots=True)
class Accept:
    """Take the candidate that the operator has seen; refused when another one is under review."""

    # as the snapshot tells it; None (of recordings that do not hold it) means whichever is under
    # review.
    candidate_id: int | None


@dataclass(frozen=True, slots=True)
class Reject:
    """Drop the candidate that the operator has seen; refused when another one is under review."""

    candidate_id: int | None  # as of `Accept`


@dataclass(frozen=True, slots=True)
class ChooseCandidate:
    """Put another of the candidates under review."""

    step: int  # 1: the next by its number, -1: the one before


@dataclass(frozen=True, slots=True)
class Blank:
    """Make the display black until `Show`."""


@dataclass(frozen=True, slots=True)
class Show:
    """Show pictures on the display again."""


@dataclass(frozen=True, slots=True)
class ToggleDepth:
    """Colour the operator's picture by the classes of the depth map, or no longer."""


@dataclass(frozen=True, slots=True)
class ToggleEye:
    """Show the operator what an eye sees in the simulated mirror, or the video again."""


@dataclass(frozen=True, slots=True)
class ToggleLayer:
    """Draw a layer of the overlay that is not drawn, or no longer draw it."""

    name: str


@dataclass(frozen=True, slots=True)
class CheckMirror:
    """Begin the check of the mirror, or give up the one that is under way."""


@dataclass(frozen=True, slots=True)
class NudgeCross:
    """Move the cross of the check, as the eye sees it."""

    right_px: int
    down_px: int


@dataclass(frozen=True, slots=True)
class ConfirmCross:
    """The cross lies on its point: go to the next one, or end the check after the last."""


@dataclass(frozen=True, slots=True)
class EnterStage:
    """Go to a stage by its number, 1 to 5."""

    number: int


@dataclass(frozen=True, slots=True)
class OverrideGate:
    """Go to a stage whose gate has just been told as not met, all the same."""

    number: int  # of the stage
    reason: str  # for the record


@dataclass(frozen=True, slots=True)
class ConfirmCondition:
    """A condition of the time-out or of a gate that a person answers for is met."""

    name: str


@dataclass(frozen=True, slots=True)
class WithdrawCondition:
    """A condition that was confirmed is not met after all."""

    name: str


@dataclass(frozen=True, slots=True)
class ConfirmStep:
    """A planned cut or hole has been made, or a part put in: the bone is what is left of it."""

    name: str  # in the plan


@dataclass(frozen=True, slots=True)
class WithdrawStep:
    """What was confirmed has not been made after all."""

    name: str


@dataclass(frozen=True, slots=True)
class ReadThickness:
    """The thickness of the bone below a cut that is made, read with a caliper."""

    name: str  # in the plan
    # of each point of `navapp.resection.list_caliper_points`
    thickness_mm: tuple[float, ...]


# A person says what was made of a bone.
StepCommand = ConfirmStep | WithdrawStep | ReadThickness


@dataclass(frozen=True, slots=True)
class TouchPoint:
    """Check on the patient: the pointer's tip rests on the bone; take that point."""

    landmark: str = ""  # of the plan, that it rests on; empty: anywhere on the surface


@dataclass(frozen=True, slots=True)
class CheckPicks:
    """Check on the patient: landmarks of the stage's bone, picked in the left picture."""

    picks: tuple[Pick, ...]


@dataclass(frozen=True, slots=True)
class DropPoint:
    """Check on the patient: forget the point that was taken last."""


@dataclass(frozen=True, slots=True)
class ForgetPoints:
    """Check on the patient: begin anew."""


@dataclass(frozen=True, slots=True)
class Reconnect:
    """Open lost devices again and bring the mirror to its place, now."""


# What a projector can be told by its name, and what that is called. Its source and its flips are
# those that the session needs: with others nothing is shown.
PROJECTOR_SETTINGS = {
    "on": "power on",
    "off": "power off",
    "source": "source as before",
    "flips": "flips as calibrated",
}


@dataclass(frozen=True, slots=True)
class SetProjector:
    """Tell the projector one of its settings."""

    name: str  # of the setting


@dataclass(frozen=True, slots=True)
class Interrupt:
    """The camera was lost at this point of a recorded session: forget what it was looking at."""


@dataclass(frozen=True, slots=True)
class DistrustRig:
    """The rig has moved: nothing that it measures is believed any more in this session."""

    why: str


@dataclass(frozen=True, slots=True)
class Quit:
    """End the session."""


Command = (
    Register
    | Cancel
    | Propose
    | Accept
    | Reject
    | ChooseCandidate
    | Blank
    | Show
    | ToggleDepth
    | ToggleEye
    | ToggleLayer
    | CheckMirror
    | NudgeCross
    | ConfirmCross
    | EnterStage
    | OverrideGate
    | ConfirmCondition
    | WithdrawCondition
    | ConfirmStep
    | WithdrawStep
    | ReadThickness
    | TouchPoint
    | CheckPicks
    | DropPoint
    | ForgetPoints
    | Reconnect
    | SetProjector
    | Interrupt
    | DistrustRig
    | Quit
)
