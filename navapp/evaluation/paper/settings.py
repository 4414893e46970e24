"""What is run for the paper's tables, and for the ablation."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from navapp.evaluation.methods import METHODS
from navapp.evaluation.paper.cases import (
    ALL_CASES,
    SITUATIONS,
    SWEEP_FRAMES,
    Case,
    CaseTest,
    list_tests,
)
from navapp.evaluation.sequence import KnownSequence


@dataclass(frozen=True, slots=True)
class TableSettings:
    """What is run; another campaign in the same folder must have the same."""

    cases: tuple[Case, ...]
    methods: tuple[str, ...]  # `methods.find_method`
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
        """Settings from what `to_json` returned.

        Raises:
            KeyError, TypeError: keys are missing, or of a wrong type.
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

    @property
    def has_details(self) -> bool:
        """The tables show worst frames and the noise limit; the ablation does not."""
        return set(self.methods) <= set(METHODS)

    def render(self, test: CaseTest, n_frames: int | None = None) -> KnownSequence:
        """The pictures of a test: so many, or its own number, after the first one."""
        return test.render(1 + (self._count_frames(test) if n_frames is None else n_frames))

    def _count_frames(self, test: CaseTest) -> int:
        """A test with an instrument lasts until that has passed once."""
        has_instrument = SITUATIONS[test.case.situation].instrument != "none"
        is_whole = has_instrument and not self.is_quick
        return max(self.n_frames, SWEEP_FRAMES) if is_whole else self.n_frames
