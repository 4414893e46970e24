"""What the tables say of ours beside the paper's own figures."""

from collections.abc import Sequence
from typing import Any

from navapp.evaluation.methods import OURS
from navapp.evaluation.paper.published import find_published
from navapp.evaluation.paper.rows import Row


def compare_with_paper(rows: Sequence[Row]) -> dict[str, Any]:
    """In how many cases ours is nearer and faster than the paper's proposal says of itself."""
    ours = [row for row in rows if row.method == OURS]
    nearer = [
        row.overlay_mm is not None and row.overlay_mm < find_published(row.case).paper_mm
        for row in ours
    ]
    faster = [row.fps is not None and row.fps > find_published(row.case).paper_fps for row in ours]
    return {"cases": len(ours), "nearer": sum(nearer), "faster": sum(faster)}
