"""What is run for the paper's tables."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, cast

from navapp.evaluation.following import Answers, follow
from navapp.evaluation.paper.cases import (
    ALL_CASES,
    SITUATIONS,
    SWEEP_FRAMES,
    Case,
    CaseTest,
    list_tests,
)
from navapp.evaluation.sequence import KnownSequence
from navapp.tracking import Method


@dataclass(frozen=True, slots=True)
class TableSettings:
    """What is run; another campaign in the same folder must have the same."""

    cases: tuple[Case, ...]
    methods: tuple[Method, ...]
    n_tests: int  # of each case
    # of each test, after the one that is registered in; at least `SWEEP_FRAMES` of those with an
    # instrument, unless it is a quick look.
    n_frames: int
    first_seed: int
    is_quick: bool = False

    def to_json(self) -> dict[str, Any]:
        """Named values."""
        return {
            "cases": [case.name for case in self.cases],
            **{key: value for key, value in asdict(self).items() if key != "cases"},
            "methods": list(self.methods),
        }

    @classmethod
    def from_json(cls, content: Mapping[str, Any]) -> "TableSettings":
        """Of such an object.

        Raises:
            KeyError, TypeError: it is none.
        """
        by_name = {case.name: case for case in ALL_CASES}
        return cls(
            tuple(by_name[name] for name in content["cases"]),
            tuple(content["methods"]),
            content["n_tests"],
            content["n_frames"],
            content["first_seed"],
            content["is_quick"],
        )

    @property
    def tests(self) -> tuple[CaseTest, ...]:
        """All tests."""
        return tuple(list_tests(self.cases, self.n_tests, self.first_seed))

    @property
    def timed_tests(self) -> tuple[CaseTest, ...]:
        """The first of each case; none for a quick look, whose times are those of its tests."""
        return () if self.is_quick else self.tests[:: self.n_tests]

    def group(self, tests: Sequence[CaseTest]) -> list[tuple[CaseTest, ...]]:
        """Each has pictures of its own."""
        return [(test,) for test in tests]

    def count_frames(self, test: CaseTest) -> int:
        """A test with an instrument lasts until that has passed once."""
        has_instrument = SITUATIONS[test.case.situation].instrument != "none"
        is_whole = has_instrument and not self.is_quick
        return max(self.n_frames, SWEEP_FRAMES) if is_whole else self.n_frames

    def render(self, test: CaseTest, n_frames: int) -> KnownSequence:
        """The pictures of a test, and one before them."""
        return test.render(n_frames + 1)

    def follow(self, sequence: KnownSequence, method: str) -> Answers:
        """What one of the methods says of a sequence."""
        return follow(sequence, cast("Method", method))
