"""What must be so before guides are shown and before a surgical stage is entered or left."""

from dataclasses import dataclass
from enum import Enum, unique


@unique
class ConditionKind(Enum):
    """Who knows whether a condition is met."""

    PERSON = "a person says so, by the condition's name"
    BONE_OK = "the stage's bone is registered and accepted, and its newest pose is OK"
    STEPS_MADE = "every planned step of the stage is made, cuts measured within the tolerance"
    RIG_VALID = "the rig's calibration was accepted, and nothing says that the rig has moved"


@dataclass(frozen=True, slots=True)
class Condition:
    """One condition, as a row of the tables in `navapp.control.stages`."""

    name: str  # for programs: scripts, recordings
    text: str  # for people
    kind: ConditionKind = ConditionKind.PERSON
    is_repeated: bool = False  # what a person says counts for `[stages] check_minutes` only
