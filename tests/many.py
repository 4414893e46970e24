"""Many cases of one thing: a few stand for them in every run, all of them before a release."""

from collections.abc import Iterable
from typing import Any

import pytest


def few_of(cases: Iterable[Any], n: int = 1) -> list[Any]:
    """Values of one parameter; those after the first `n` are run with --release only."""
    return few_rows_of(((case,) for case in cases), n)


def few_rows_of(rows: Iterable[tuple[Any, ...]], n: int = 1) -> list[Any]:
    """Values of several parameters, a row for each case; rows after the first `n` likewise."""
    return [
        pytest.param(*row, marks=[pytest.mark.release] if number >= n else [])
        for number, row in enumerate(rows)
    ]
