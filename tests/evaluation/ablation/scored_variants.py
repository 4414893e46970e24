"""Tests of an ablation by hand."""

from collections.abc import Sequence

from navapp.evaluation.campaign import Done
from navapp.evaluation.methods import VARIANTS
from navapp.evaluation.paper.cases import Case, list_tests
from navapp.evaluation.scores import SequenceScore


def done_by_variants(
    cases: Sequence[Case], whole: SequenceScore, **others: SequenceScore
) -> list[Done]:
    """A test of each case; variants without frames of their own are as the whole method.

    In the names of `others` an underscore stands for a blank: `without_judge`.
    """
    named = {name.replace("_", " "): one for name, one in others.items()}
    assert named.keys() <= VARIANTS.keys()
    answers = {name: named.get(name, whole) for name in VARIANTS}
    return [Done(test, dict(answers)) for test in list_tests(cases, 1, 1)]
