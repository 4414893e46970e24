"""Terminals that screens are shown in: the smallest in every run, larger ones before a release."""

import pytest

from tests.many import few_of

SIZES = pytest.mark.parametrize(
    "size", few_of([(80, 24), (160, 48), (200, 60)]), ids=["80x24", "160x48", "200x60"]
)
