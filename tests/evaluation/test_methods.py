"""The methods that are compared, and the variants of ours."""

from typing import get_args

import pytest

from navapp.evaluation.methods import METHODS, OURS, VARIANTS, WITHOUT_FILL, find_method
from navapp.tracking import Method, Part


def test_the_whole_method_stands_first_and_every_part_is_left_out_once() -> None:
    assert next(iter(VARIANTS)) == OURS
    assert VARIANTS[OURS] == frozenset()
    assert VARIANTS[WITHOUT_FILL] == {"fill"}
    left_out = [part for parts in VARIANTS.values() for part in parts]
    assert sorted(left_out) == sorted(get_args(Part))


def test_all_methods_of_a_session_are_compared_whole() -> None:
    assert set(METHODS) == set(get_args(Method))
    for name in METHODS:
        assert find_method(name) == (name, frozenset())


def test_a_variant_is_ours_without_its_parts() -> None:
    for name, parts in VARIANTS.items():
        assert find_method(name) == ("bimcc", parts)
    with pytest.raises(KeyError):
        find_method("without a camera")
