"""The paper's test cases on simulated knees: samples, stages, situations, and their seeds.

Maharjan et al. 2020, section 4, tables 1 to 3: three groups of patients, five stages, four
situations, five tests of each.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

from navapp.config import Configuration
from navapp.config.camera_sections import CameraSection, SimulationSection
from navapp.control.stages import STAGES
from navapp.evaluation.sequence import KnownSequence, render_room

SampleName = Literal["man", "woman", "adult"]
SituationName = Literal["registration", "overlay", "patient", "instrument"]
MotionName = Literal["still", "breathing", "patient"]


@dataclass(frozen=True, slots=True)
class Sample:
    """A group of patients."""

    title: str
    sexes: tuple[Literal["male", "female"], ...]  # taken in turns
    # Of the simulated bones: with age the fine relief of their surfaces grows, from 0.10 mm (young)
    # to 0.15 mm (middle, root mean square); nothing else changes.
    age_group: Literal["young", "middle"]


@dataclass(frozen=True, slots=True)
class Situation:
    """What happens while the bone is followed."""

    title: str
    motion: MotionName  # of the leg
    instrument: Literal["none", "sweep"]  # that passes in front of the bone


SAMPLES: dict[SampleName, Sample] = {
    "man": Sample("man, 35 to 45", ("male",), "middle"),
    "woman": Sample("woman, 35 to 45", ("female",), "middle"),
    "adult": Sample("adult, 20 to 30", ("male", "female"), "young"),
}
SITUATIONS: dict[SituationName, Situation] = {
    "registration": Situation("image registration: the leg lies still", "still", "none"),
    "overlay": Situation("image overlay: the leg breathes", "breathing", "none"),
    "patient": Situation("the patient moves", "patient", "none"),
    "instrument": Situation("an instrument moves, the leg breathes", "breathing", "sweep"),
}
# When the simulated instrument begins and ceases to lie before the bone, in every six seconds.
INSTRUMENT_S = (1.8, 4.2)
# Fifteen a second, until it has passed once.
SWEEP_FRAMES = 90
STAGE_NAMES = tuple(stage.name for stage in STAGES)
# First seeds of the tables and of the ablation, 6000 each. No other test uses them, and no constant
# was set on them.
FIRST_SEED, FIRST_ABLATION_SEED = 130_001, 160_001
# Seeds of a case: its later tests have their own, however many there are.
MOST_TESTS = 100


@dataclass(frozen=True, slots=True)
class Case:
    """One row of the paper's tables."""

    sample: SampleName
    stage: str
    situation: SituationName

    @property
    def name(self) -> str:
        """Part of the names of its files."""
        return f"{self.sample}-{self.stage}-{self.situation}"

    @property
    def place(self) -> tuple[str, SituationName]:
        """Stage and situation."""
        return self.stage, self.situation


@dataclass(frozen=True, slots=True)
class CaseTest:
    """One knee of a case."""

    case: Case
    number: int  # of the test, from 0
    seed: int  # of the knee, its room and its pictures

    @property
    def name(self) -> str:
        """For files."""
        return f"{self.case.name}-{self.number}"

    def configure(self) -> Configuration:
        """The simulated camera before this knee, stepped."""
        sample, situation = SAMPLES[self.case.sample], SITUATIONS[self.case.situation]
        simulated = SimulationSection(
            seed=self.seed,
            side="left" if self.number % 2 else "right",
            sex=sample.sexes[self.number % len(sample.sexes)],
            age_group=sample.age_group,
            motion=situation.motion,
            instrument=situation.instrument,
            stepped=True,
        )
        return Configuration(camera=CameraSection(simulated=simulated))

    def render(self, n_frames: int) -> KnownSequence:
        """Its pictures, with the truth about the stage's bone."""
        return render_room(self.configure(), self.case.stage, n_frames)


ALL_CASES: tuple[Case, ...] = tuple(
    Case(sample, stage, situation)
    for sample in SAMPLES
    for stage in STAGE_NAMES
    for situation in SITUATIONS
)


def list_tests(cases: Sequence[Case], n_tests: int, first_seed: int) -> Iterator[CaseTest]:
    """All tests of some cases; every one has another knee, the same whatever else is run.

    Raises:
        ValueError: more tests than a case has seeds.
    """
    if n_tests > MOST_TESTS:
        raise ValueError(f"a case has at most {MOST_TESTS} tests")
    for case in cases:
        place = ALL_CASES.index(case)
        for number in range(n_tests):
            yield CaseTest(case, number, first_seed + MOST_TESTS * place + number)
