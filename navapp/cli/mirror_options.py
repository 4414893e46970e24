"""Options of `navapp calibrate mirror` that tell the display and its plate."""

import argparse
import math

from navapp.errors import UsageError

USUAL_GLASS_MM, USUAL_GLASS_DEG = 3.0, 45.0
_MM_PER_INCH = 25.4
_RESULT = frozenset({"out", "report", "force", "json"})
_DISPLAY = frozenset({"board", "rig", "diagonal_inch", "glass_mm", "glass_deg", "viewing_eye"})
# Where a display is solved from, or that its pattern is written; and the options of each.
SOURCES = {
    "views": _RESULT | _DISPLAY | {"size", "curved", "lens", "eye_views"},
    "alignments": _RESULT,
    "by_keys": _RESULT | _DISPLAY | {"headless", "save_alignments", "upside_down"},
    "pattern": frozenset({"board", "size"}),
}


def choose_source(options: argparse.Namespace) -> str:
    """The one of `SOURCES` that is asked for.

    Raises:
        UsageError: none, several, no file to write, or an option of another source.
    """
    given = [name for name in SOURCES if getattr(options, name)]
    if len(given) != 1 or (options.out is None and given != ["pattern"]):
        raise UsageError(
            "calibrate mirror needs one source, and a file to write",
            remedy="give --out DISPLAY.yml with --views DIR, --by-keys or --alignments FILE.json, "
            "or --pattern FILE.png alone",
        )
    source = given[0]
    for name in sorted(frozenset().union(*SOURCES.values()) - SOURCES[source]):
        value = getattr(options, name)
        # 0 is a value, too.
        if value is not None and value is not False and value != "":
            owners = [_flag(other) for other, names in SOURCES.items() if name in names]
            raise UsageError(
                f"{_flag(name)} does not go with {_flag(source)}",
                remedy=f"it belongs to {' and '.join(owners)}; leave it away",
            )
    return source


def _flag(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def find_pitch_mm(options: argparse.Namespace, size: tuple[int, int]) -> float | None:
    """Of a display of that size in px, from its diagonal; None when that is not told.

    Raises:
        UsageError: no possible length.
    """
    if options.diagonal_inch is None:
        return None
    if not 0.0 < options.diagonal_inch < 1000.0:
        raise UsageError("--diagonal-inch must be a length", remedy="give it in inches, such as 24")
    return float(options.diagonal_inch * _MM_PER_INCH / math.hypot(*size))
