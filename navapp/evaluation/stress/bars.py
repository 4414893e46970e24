"""What motion blur, rolling shutter and shake may cost, and whether it was kept."""

from collections.abc import Sequence
from dataclasses import dataclass

from navapp.evaluation.stress.rows import AxisRows, LevelRow

# Axes of motion blur, and the blur in px up to which they are held to the limits.
AXES_OF_BLUR = ("blur", "blur-shutter", "blur-shake", "blur-shutter-shake")
MOST_BLUR_PX = 3.0
LEAST_OK_SHARE, MOST_TRE_MM, MOST_WORST_MM, LEAST_COVERAGE = 0.9, 0.15, 0.4, 0.9


@dataclass(frozen=True, slots=True)
class Held:
    """A level that is held to the limits."""

    title: str
    row: LevelRow
    missed: tuple[str, ...]  # limits that it does not keep


def check_blur(axes: Sequence[AxisRows]) -> list[Held]:
    """Every level of motion blur up to the limit, with what it misses."""
    return [
        Held(f"{one.axis.title}, {row.level:g} px", row, tuple(_list_missed(row)))
        for one in axes
        if one.axis.name in AXES_OF_BLUR
        for row in one.rows
        if row.level <= MOST_BLUR_PX
    ]


def _list_missed(row: LevelRow) -> list[str]:
    coverage = row.figures.bound_coverage
    if row.tre_mm is None or row.worst_mm is None or coverage is None:
        return ["no frame is OK"]
    checks = {
        f"OK in {LEAST_OK_SHARE:.0%} of the frames": row.ok_share >= LEAST_OK_SHARE,
        f"TRE median {MOST_TRE_MM:g} mm": row.tre_mm <= MOST_TRE_MM,
        f"worst OK frame {MOST_WORST_MM:g} mm": row.worst_mm <= MOST_WORST_MM,
        f"bound holds in {LEAST_COVERAGE:.0%}": coverage >= LEAST_COVERAGE,
    }
    return [name for name, is_kept in checks.items() if not is_kept]
