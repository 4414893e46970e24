"""Characters for status, gauges and frames: one set for UTF-8 terminals, one for plain ASCII."""

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Symbols:
    """A set of characters, each one cell wide; `at_most` may be wider.

    Attributes:
        dot, dash, at_most, times: of running text; `dash` joins the stages.
    """

    # ok, attention, bad, absent: marks of a status.
    ok: str
    attention: str
    bad: str
    absent: str
    dot: str
    dash: str
    at_most: str
    ellipsis: str
    # bar_full, bar_empty, bar_limit, bar_left, bar_right, bar_over: of gauges.
    bar_full: str
    bar_empty: str
    bar_limit: str
    bar_left: str
    bar_right: str
    bar_over: str
    levels: str  # of sparklines, lowest first
    # brightness for pictures without half blocks, darkest first; empty where half blocks can be
    # drawn.
    ramp: str = ""

    @property
    def is_ascii(self) -> bool:
        """Nothing beyond ASCII is drawn."""
        return bool(self.ramp)


UNICODE = Symbols(
    ok="●",
    attention="▲",
    bad="✗",
    absent="–",  # noqa: RUF001 (an en dash is meant)
    dot="·",
    dash="─",
    at_most="≤",
    ellipsis="…",
    bar_full="█",
    bar_empty="░",
    bar_limit="┃",
    bar_left="▕",
    bar_right="▏",
    bar_over="▶",
    levels="▁▂▃▄▅▆▇█",
)

ASCII = Symbols(
    ok="+",
    attention="!",
    bad="X",
    absent="-",
    dot="|",
    dash="-",
    at_most="<=",
    ellipsis="~",
    bar_full="#",
    bar_empty=".",
    bar_limit="|",
    bar_left="[",
    bar_right="]",
    bar_over=">",
    levels="_.-=#",
    ramp=" .:-=+*#%@",
)


def choose_symbols(encoding: str | None, environment: Mapping[str, str]) -> Symbols:
    """The set that a terminal can draw.

    Python reports UTF-8 in the C locale too, so a locale set to C or POSIX by name counts more.

    Args:
        encoding: of the output stream.
        environment: variables of the process.
    """
    for name in ("LC_ALL", "LC_CTYPE", "LANG"):
        locale = environment.get(name, "")
        if locale:
            if locale in ("C", "POSIX"):
                return ASCII
            break
    is_utf8 = (encoding or "").lower().replace("-", "").replace("_", "") == "utf8"
    return UNICODE if is_utf8 else ASCII
