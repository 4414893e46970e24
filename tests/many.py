"""Many cases of one thing: a few stand for them in every run, all of them before a release."""

from collections.abc import Iterable
from typing import Any

import pytest


def few_of(cases: Iterable[Any], n: int = 1) -> list[Any]:
    """Parameters; those after the first `n` are run with --release only."""
    return [
        case if number < n else pytest.param(case, marks=pytest.mark.release)
        for number, case in enumerate(cases)
    ]
