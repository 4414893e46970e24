"""The kinds of `navapp evaluate`, and which options belong to each."""

import argparse
from typing import Final, Literal

from navapp.errors import UsageError

Kind = Literal["tables", "stress", "ablation", "recording"]
_KINDS: Final[tuple[Kind, ...]] = ("recording", "stress", "ablation")
# Kinds in which each option has a meaning; the others have one in all.
_OPTIONS: dict[str, frozenset[Kind]] = {
    **dict.fromkeys(("samples", "stages", "situations"), frozenset[Kind](("tables", "ablation"))),
    "methods": frozenset(("tables", "recording")),
    **dict.fromkeys(
        ("tests", "frames", "seed", "quick", "processes"),
        frozenset[Kind](("tables", "stress", "ablation")),
    ),
    "peers": frozenset(("tables",)),
    "axes": frozenset(("stress",)),
    **dict.fromkeys(
        ("rig", "plan", "truth", "prior", "bone", "fps", "allow_unaccepted"),
        frozenset[Kind](("recording",)),
    ),
}


def find_kind(options: argparse.Namespace) -> Kind:
    """What is to be evaluated.

    Raises:
        UsageError: two kinds at once, or an option that has no meaning in this one.
    """
    asked = [kind for kind in _KINDS if _is_given(options, kind)]
    if len(asked) > 1:
        raise UsageError(
            f"--{asked[0]} and --{asked[1]} are two evaluations", remedy="run one at a time"
        )
    kind: Kind = asked[0] if asked else "tables"
    for name, kinds in _OPTIONS.items():
        if kind in kinds or not _is_given(options, name):
            continue
        option = f"--{name.replace('_', '-')}"
        if asked:
            raise UsageError(
                f"{option} cannot be used with --{kind}", remedy="leave one of them out"
            )
        (needed,) = kinds
        raise UsageError(f"{option} means nothing without --{needed}", remedy=f"add --{needed}")
    return kind


def _is_given(options: argparse.Namespace, name: str) -> bool:
    value = getattr(options, name)
    return value is not None and value is not False  # a seed of 0 is given
