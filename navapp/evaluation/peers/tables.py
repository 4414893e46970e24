"""The peers beside ours: a section of `tables.md`, and every frame as CSV."""

from collections.abc import Iterator, Sequence

from navapp.evaluation.paper.cases import SITUATIONS
from navapp.evaluation.peers.rows import PeerRow
from navapp.evaluation.peers.scores import PeerTest
from navapp.evaluation.report_parts import format_number, format_table, make_csv

_ABOUT = (
    "Other people's trackers on the same frames, all samples of a stage and situation together. A"
    " peer has no registration of its own: it starts from our first pose that is OK (of the fifth"
    " search also a DEGRADED one), and is never helped again; one that has lost the bone goes on "
    "from its last pose. It gets the same rig, the same surface of the bone, and no truth. TRE: "
    "over the frames with a pose. Within 1 mm and no pose: of all counted frames. A peer has no "
    "judge: a pose that is far off counts like any other. ms: median time of a frame, taken while"
    " nothing else ran: of a peer until it has the pose, of ours with judge, foreground and "
    "overlay as well."
)


def format_peers(rows: Sequence[PeerRow]) -> list[str]:
    """Lines of the section; none without rows."""
    if not rows:
        return []
    head = (
        "stage", "situation", "tracker", "tests", "frames", "TRE median, mm", "TRE 95 %, mm",
        "within 1 mm", "no pose", "ms",
    )  # fmt: skip
    table = format_table(head, (_format(row) for row in rows))
    return ["## Peers on the same frames", "", _ABOUT, "", *table, ""]


def make_peer_csv(peers: Sequence[PeerTest]) -> str:
    """Every counted frame of every peer."""
    head = "sample", "stage", "situation", "test", "seed", "peer", "index", "tre_mm", "ms"
    return make_csv(head, _list_frames(peers))


def _list_frames(peers: Sequence[PeerTest]) -> Iterator[tuple[object, ...]]:
    for one in peers:
        test, case = one.test, one.test.case
        for name, frames in one.frames.items():
            for frame in frames:
                yield (
                    case.sample, case.stage, case.situation, test.number, test.seed, name,
                    frame.index, frame.tre_mm, frame.ms,
                )  # fmt: skip


def _format(row: PeerRow) -> tuple[str, ...]:
    return (
        row.stage, SITUATIONS[row.situation].title, row.tracker, str(row.n_tests),
        str(row.n_frames), format_number(row.tre_median_mm, 2), format_number(row.tre_p95_mm, 2),
        _share(row.n_within, row), _share(row.n_no_pose, row), format_number(row.p50_ms),
    )  # fmt: skip


def _share(n_frames: int, row: PeerRow) -> str:
    return f"{100.0 * n_frames / max(row.n_frames, 1):.1f} %"
