"""Scores by hand, and tests made of them."""

from collections.abc import Sequence
from typing import Any

from navapp.evaluation.campaign import Done
from navapp.evaluation.methods import METHODS
from navapp.evaluation.paper.cases import ALL_CASES, Case, list_tests
from navapp.evaluation.scores import FrameScore, SequenceScore
from navapp.tracking import Method


def score(tre_mm: float | None, status: str = "OK", **changes: Any) -> FrameScore:
    """A frame whose bone is drawn twice as far beside itself as its targets are."""
    shown_mm = None if tre_mm is None else 2.0 * tre_mm
    values: dict[str, Any] = {
        "index": 1, "status": status, "reasons": () if status == "OK" else ("doubted",),
        "tre_mm": tre_mm, "displacement_mm": shown_mm, "outline_mm": shown_mm, "bound_mm": 0.5,
        "seen": 0.8, "hidden": 0.1, "total_ms": 20.0,
    }  # fmt: skip
    return FrameScore(**{**values, **changes})


def followed(*frames: FrameScore, registration_s: float | None = 1.0) -> SequenceScore:
    return SequenceScore(registration_s, 1, frames)


def done(
    *tests: SequenceScore, case: Case = ALL_CASES[0], methods: Sequence[Method] = METHODS
) -> list[Done]:
    """These tests of a case, the same for every method."""
    numbered = list_tests([case], len(tests), 1)
    return [
        Done(test, dict.fromkeys(methods, one)) for test, one in zip(numbered, tests, strict=True)
    ]
