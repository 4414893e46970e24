"""Plans whose bones are looked at from few sides: made in a fraction of the time."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial

import pytest

import navapp.preop
from navapp.preop import AspectSettings

FEW_SIDES = AspectSettings(step_deg=45.0)


@contextmanager
def from_few_sides() -> Iterator[None]:
    """Aspects that are built within it are as far apart as `FEW_SIDES` says."""
    coarse = partial(navapp.preop.build_aspects, settings=FEW_SIDES)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(navapp.preop, "build_aspects", coarse)
        yield
