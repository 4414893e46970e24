"""What is run for an ablation: our method whole, and without one part at a time."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from navapp.evaluation.following import Answers, follow
from navapp.evaluation.paper.cases import CaseTest
from navapp.evaluation.paper.settings import TableSettings
from navapp.evaluation.sequence import KnownSequence
from navapp.tracking import Part

# No test and no choice of a constant uses the seeds from here on, a hundred for each case.
FIRST_ABLATION_SEED = 120_001
WHOLE = "bimcc"
WITHOUT_FILL = "without filled depth"
VARIANTS: dict[str, frozenset[Part]] = {
    WHOLE: frozenset(),
    WITHOUT_FILL: frozenset({"fill"}),
    "without bidirectional pairs": frozenset({"backward pairs"}),
    "without contour": frozenset({"contour"}),
    "without second look": frozenset({"second look"}),
    "without judge": frozenset({"judge"}),
}


@dataclass(frozen=True, slots=True)
class AblationSettings:
    """What is run; another campaign in the same folder must have the same."""

    knees: TableSettings  # the cases, their tests and frames; every variant follows all of them

    @property
    def methods(self) -> tuple[str, ...]:
        """The variants by their names."""
        return tuple(VARIANTS)

    @property
    def tests(self) -> tuple[CaseTest, ...]:
        """All tests."""
        return self.knees.tests

    @property
    def timed_tests(self) -> tuple[CaseTest, ...]:
        """As for the tables: the first of each case; none for a quick look."""
        return self.knees.timed_tests

    def group(self, tests: Sequence[CaseTest]) -> list[tuple[CaseTest, ...]]:
        """As for the tables: each has pictures of its own."""
        return self.knees.group(tests)

    def count_frames(self, test: CaseTest) -> int:
        """As for the tables: a test with an instrument lasts until that has passed once."""
        return self.knees.count_frames(test)

    def render(self, test: CaseTest, n_frames: int) -> KnownSequence:
        """The pictures of a test, and one before them."""
        return self.knees.render(test, n_frames)

    def follow(self, sequence: KnownSequence, method: str) -> Answers:
        """What our method says of a sequence, without the part that a variant leaves out."""
        return follow(sequence, "bimcc", VARIANTS[method])

    def to_json(self) -> dict[str, Any]:
        """Named values."""
        variants = {name: sorted(parts) for name, parts in VARIANTS.items()}
        return {**self.knees.to_json(), "methods": list(VARIANTS), "ablation": variants}
