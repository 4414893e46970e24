"""Text gauges: numbers of fixed width, bars with a limit, sparklines."""

import math
from collections.abc import Sequence
from enum import Enum

from navapp.ui.symbols import Symbols

# A bar ends this much beyond its limit, so that a small excess is seen as such.
_BAR_END = 1.25
# A sparkline's largest value stays below the line above.
_HEADROOM = 1.3


class Number(Enum):
    """Formats by width and decimals; the text keeps its width for any value."""

    MM = (5, 2)
    RATE = (5, 1)
    SKEW = (4, 1)
    WHOLE = (5, 0)
    PERCENT = (3, 0)

    def text(self, value: float | None) -> str:
        """The number, right-aligned; dashes for None, the largest that fits for what does not."""
        width, decimals = self.value
        if value is None or math.isnan(value):
            return ("-" if decimals == 0 else "-." + "-" * decimals).rjust(width)
        whole = width - decimals - (1 if decimals else 0)
        largest = 10**whole - 10**-decimals if decimals else 10**whole - 1
        return f"{min(max(value, 0.0), largest):{width}.{decimals}f}"


def draw_bar(value: float | None, limit: float, width: int, symbols: Symbols) -> str:
    """A bar of `width` cells with the limit at four fifths; an arrow ends it beyond its end."""
    inner = max(width - 2, 2)
    end = limit * _BAR_END
    filled = 0 if value is None or math.isnan(value) else round(inner * min(value / end, 1.0))
    cells = [symbols.bar_full] * filled + [symbols.bar_empty] * (inner - filled)
    cells[min(round(inner / _BAR_END), inner - 1)] = symbols.bar_limit
    if value is not None and value > end:
        cells[-1] = symbols.bar_over
    return symbols.bar_left + "".join(cells) + symbols.bar_right


def draw_fraction_bar(share: float, width: int, symbols: Symbols) -> str:
    """A bar of `width` cells for work that is done to this share."""
    inner = max(width - 2, 1)
    filled = round(inner * min(max(share, 0.0), 1.0))
    cells = symbols.bar_full * filled + symbols.bar_empty * (inner - filled)
    return symbols.bar_left + cells + symbols.bar_right


def draw_sparkline(values: Sequence[float], width: int, symbols: Symbols) -> str:
    """The newest values on a scale from zero, newest at the right, `width` cells."""
    newest = [value for value in values[-width:] if math.isfinite(value)] if width > 0 else []
    top = _HEADROOM * max(newest, default=0.0)
    if top <= 0:
        return " " * max(width, 0)
    last = len(symbols.levels) - 1
    marks = [symbols.levels[round(last * max(value, 0.0) / top)] for value in newest]
    return "".join(marks).rjust(width)


def cut(text: str, width: int, symbols: Symbols) -> str:
    """One line of at most `width` characters; what would steer the terminal becomes a space."""
    line = " ".join("".join(c if c.isprintable() else " " for c in text).split())
    if len(line) <= width:
        return line
    return line[: max(width - 1, 0)] + symbols.ellipsis if width > 0 else ""
