"""Bones are looked at from few sides: a plan is made in a fraction of the time."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial

import pytest

import navapp.preop
from navapp.preop import AspectSettings


@contextmanager
def from_few_sides(step_deg: float = 45.0) -> Iterator[None]:
    """Within it, the aspects of a plan are `step_deg` apart."""
    coarse = partial(navapp.preop.build_aspects, settings=AspectSettings(step_deg=step_deg))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(navapp.preop, "build_aspects", coarse)
        yield
