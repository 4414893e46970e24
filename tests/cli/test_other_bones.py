"""Which bones `--also` may name."""

import pytest

from navapp.cli.other_bones import check_others
from navapp.control.stages import stage_of
from navapp.errors import UsageError
from tests.control.fakes import a_plan

PLAN = a_plan("femur", "tibia", "patella")
FEMUR = stage_of("femur", PLAN)


def test_each_bone_is_followed_once() -> None:
    names = ("tibia", "patella", "tibia")
    assert check_others(names, PLAN, FEMUR) == ("tibia", "patella")
    assert check_others(("tibia",), PLAN, FEMUR, is_live=True) == ("tibia",)


@pytest.mark.parametrize(
    ("name", "is_live", "words"),
    [
        ("fibula", False, "no bone 'fibula'"),
        ("femur", False, "followed anyway"),
        ("patella", True, "the patella is not found from the femur"),
    ],
)
def test_what_cannot_be_followed_is_refused(name, is_live, words) -> None:
    with pytest.raises(UsageError, match=words):
        check_others((name,), PLAN, FEMUR, is_live=is_live)
