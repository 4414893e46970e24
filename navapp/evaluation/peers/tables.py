"""The peers beside ours: a section of `tables.md`, and every frame as CSV."""

import csv
import io
from collections.abc import Sequence

from navapp.evaluation.paper.cases import SITUATIONS
from navapp.evaluation.peers.rows import PeerRow
from navapp.evaluation.peers.scores import PeerTest

_ABOUT = (
    "Other people's trackers on the same frames, all samples of a stage and situation together. A "
    "peer has no registration of its own: it starts from the pose that ours found in the first "
    "frame, and is never helped again; one that has lost the bone goes on from its last pose. "
    "It gets the same rig, the same surface of the bone, and no truth. TRE: over the frames with a "
    "pose. Within 1 mm and no pose: of all counted frames. A peer has no judge: a pose that is far "
    "off counts like any other. ms: median time of a frame, taken while nothing else ran: of a "
    "peer until it has the pose, of ours with judge, foreground and overlay as well."
)


def format_peers(rows: Sequence[PeerRow]) -> list[str]:
    """Lines of the section; none without rows."""
    if not rows:
        return []
    lines = [
        "## Peers on the same frames",
        "",
        _ABOUT,
        "",
        "| stage | situation | tracker | tests | frames | TRE median, mm | TRE 95 %, mm "
        "| within 1 mm | no pose | ms |",
        "|---" * 10 + "|",
    ]
    return [*lines, *(_format(row) for row in rows), ""]


def make_peer_csv(peers: Sequence[PeerTest]) -> str:
    """Every counted frame of every peer."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(
        ("sample", "stage", "situation", "test", "seed", "peer", "index", "tre_mm", "ms")
    )
    for one in peers:
        case = one.test.case
        for name, frames in one.frames.items():
            for frame in frames:
                writer.writerow(
                    (case.sample, case.stage, case.situation, one.test.number, one.test.seed,
                     name, frame.index, frame.tre_mm, frame.ms)
                )  # fmt: skip
    return out.getvalue()


def _format(row: PeerRow) -> str:
    ms = "-" if row.p50_ms is None else f"{row.p50_ms:.0f}"
    cells = (
        row.stage, SITUATIONS[row.situation].title, row.tracker, f"{row.n_tests}",
        f"{row.n_frames}", _mm(row.tre_median_mm), _mm(row.tre_p95_mm),
        _share(row.n_within, row), _share(row.n_no_pose, row), ms,
    )  # fmt: skip
    return "| " + " | ".join(cells) + " |"


def _share(n_frames: int, row: PeerRow) -> str:
    return f"{100.0 * n_frames / max(row.n_frames, 1):.1f} %"


def _mm(value: float | None) -> str:
    return "-" if value is None else f"{value:.2f}"
