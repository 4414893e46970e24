"""Which options belong to which kind of evaluation."""

import pytest

from navapp.cli.evaluate_kinds import _OPTIONS, find_kind
from navapp.cli.main import _parser
from navapp.errors import UsageError


def options(*words: str):
    return _parser().parse_args(["evaluate", "--out", "out", *words])


@pytest.mark.parametrize(
    ("words", "kind"),
    [
        ((), "tables"),
        (("--peers", "--seed", "0"), "tables"),
        (("--stress", "--axes", "light"), "stress"),
        (("--ablation", "--samples", "man"), "ablation"),
        (("--recording", "pairs", "--fps", "15", "--methods", "icp"), "recording"),
    ],
)
def test_the_kind_is_what_is_asked_for(words, kind) -> None:
    assert find_kind(options(*words)) == kind


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("--stress", "--recording", "pairs"), "--recording and --stress are two evaluations: run"),
        (
            ("--stress", "--seed", "0", "--rig", "r"),
            "--rig cannot be used with --stress: leave one",
        ),
        (("--recording", "pairs", "--seed", "0"), "--seed cannot be used with --recording"),
        (("--axes", "light"), "--axes means nothing without --stress: add --stress"),
        (("--allow-unaccepted",), "--allow-unaccepted means nothing without --recording"),
    ],
)
def test_an_option_of_another_kind_is_refused(words, told) -> None:
    with pytest.raises(UsageError, match=told) as error:
        find_kind(options(*words))
    assert error.value.exit_code == 2


def test_every_option_of_the_verb_is_placed() -> None:
    anywhere = {"stress", "ablation", "recording", "out", "json", "verb"}
    names = set(vars(options())) - set(vars(_parser().parse_args(["doctor"])))
    assert names - anywhere == {name for names in _OPTIONS.values() for name in names}
