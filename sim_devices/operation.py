"""The steps of the operation, and what has been made at each stage."""

from dataclasses import dataclass
from typing import Literal

from navapp.errors import UsageError

StepKind = Literal["hole", "cut", "part"]


@dataclass(frozen=True, slots=True)
class Step:
    """Something that is made once."""

    name: str  # in the plan
    stage: str  # in which it is made
    bone: str  # that is changed
    kind: StepKind


# In the order in which they are made.
STEPS: tuple[Step, ...] = (
    Step("femoral_guide", "drilling", "femur", "hole"),
    Step("femur_distal", "implant", "femur", "cut"),
    Step("femur_anterior", "implant", "femur", "cut"),
    Step("femur_posterior", "implant", "femur", "cut"),
    Step("femur_chamfer_anterior", "implant", "femur", "cut"),
    Step("femur_chamfer_posterior", "implant", "femur", "cut"),
    Step("femoral_implant", "implant", "femur", "part"),
    Step("patella", "patella", "patella", "cut"),
    Step("patellar_implant", "patella", "patella", "part"),
    Step("tibia_proximal", "spacer", "tibia", "cut"),
    Step("spacer", "spacer", "tibia", "part"),
)
STAGES = ("opening", "drilling", "implant", "patella", "spacer")
# How many of its own steps a stage that is entered shows as made already.
_MADE_AT_ENTRY = {"opening": 0, "drilling": 1, "implant": 5, "patella": 0, "spacer": 1}
_NAMES = tuple(step.name for step in STEPS)


@dataclass(frozen=True, slots=True)
class State:
    """A stage, and the steps that have been made when it is seen."""

    stage: str
    made: frozenset[str]  # names of steps

    def __post_init__(self) -> None:
        if self.stage not in STAGES:
            raise UsageError(
                f"the simulator shows no stage {self.stage!r}",
                subject=self.stage,
                remedy=f"choose one of {', '.join(STAGES)}",
            )
        unknown = sorted(self.made.difference(_NAMES))
        if unknown:
            raise UsageError(
                f"the operation has no step {unknown[0]!r}",
                subject=unknown[0],
                remedy=f"choose of {', '.join(_NAMES)}",
            )

    def made_of(self, bone: str) -> tuple[str, ...]:
        """Names of the steps of one bone that have been made, in their order."""
        return tuple(step.name for step in STEPS if step.bone == bone and step.name in self.made)

    def is_made(self, name: str) -> bool:
        """Whether a step has been made."""
        return name in self.made

    def go_on(self, stage: str) -> "State":
        """Another stage, after what has been made of it: all of the stages before, none later.

        Raises:
            UsageError: there is no such stage.
        """
        own = {step.name for step in STEPS if step.stage == stage}
        before = enter(stage).made - own
        return State(stage, before | (own & self.made))

    def advance(self) -> "State":
        """With the stage's next step made.

        Raises:
            UsageError: all of its steps are made.
        """
        for step in STEPS:
            if step.stage == self.stage and step.name not in self.made:
                return State(self.stage, self.made | {step.name})
        raise UsageError(f"every step of the stage {self.stage!r} is made", subject=self.stage)


def enter(stage: str) -> State:
    """A stage as it is usually entered: everything of the stages before it has been made.

    The bone of the stages implant and spacer is sawn already, and without its component; the hole
    of the drilling stage is there; the patella is whole.

    Raises:
        UsageError: there is no such stage.
    """
    State(stage, frozenset())
    number = STAGES.index(stage)
    before = [step.name for step in STEPS if STAGES.index(step.stage) < number]
    own = [step.name for step in STEPS if step.stage == stage]
    return State(stage, frozenset(before + own[: _MADE_AT_ENTRY[stage]]))
