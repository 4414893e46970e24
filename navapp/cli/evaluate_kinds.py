"""The kinds of `navapp evaluate`, and which options belong to each."""

import argparse
from typing import Final, Literal

from navapp.errors import UsageError

Kind = Literal["tables", "stress", "ablation", "recording"]
_KINDS: Final[tuple[Kind, ...]] = ("recording", "stress", "ablation")
_CASES = ("samples", "stages", "situations")
_COUNTS = ("tests", "frames", "seed", "quick", "processes")
# Options that have a meaning in each kind; those not named here have one in all.
_OPTIONS: dict[Kind, tuple[str, ...]] = {
    "tables": (*_CASES, "methods", *_COUNTS, "peers"),
    "ablation": (*_CASES, *_COUNTS),
    "stress": (*_COUNTS, "axes"),
    "recording": ("methods", "rig", "plan", "truth", "prior", "bone", "fps", "allow_unaccepted"),
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
    for name in dict.fromkeys(name for names in _OPTIONS.values() for name in names):
        if name in _OPTIONS[kind] or not _is_given(options, name):
            continue
        option = f"--{name.replace('_', '-')}"
        if asked:
            raise UsageError(
                f"{option} cannot be used with --{kind}", remedy="leave one of them out"
            )
        needed = next(one for one, names in _OPTIONS.items() if name in names)
        raise UsageError(f"{option} means nothing without --{needed}", remedy=f"add --{needed}")
    return kind


def _is_given(options: argparse.Namespace, name: str) -> bool:
    value = getattr(options, name)
    return value is not None and value is not False  # a seed of 0 is given
