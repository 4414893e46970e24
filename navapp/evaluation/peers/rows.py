"""A row of the peers' table: what a tracker reached in a stage and situation, over all samples."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import product
from typing import Any

from navapp.evaluation.campaign import Done
from navapp.evaluation.frame_figures import find_percentile
from navapp.evaluation.methods import OURS
from navapp.evaluation.paper.cases import SITUATIONS, STAGE_NAMES, CaseTest, SituationName
from navapp.evaluation.peers.scores import PeerFrame, PeerTest
from navapp.evaluation.scores import WRONG_MM

_OK, _EVERY = "bimcc, OK frames", "bimcc, every pose"

# The frames of a test, by the name of the tracker.
_Frames = Mapping[str, tuple[PeerFrame, ...]]


@dataclass(frozen=True, slots=True)
class PeerRow:
    """The results of one tracker in one stage and situation."""

    stage: str
    situation: SituationName
    tracker: str
    n_tests: int
    n_frames: int  # counted ones
    tre_median_mm: float | None  # over frames with a pose; None without any
    tre_p95_mm: float | None
    n_within: int  # frames with a pose that is at most `WRONG_MM` off
    n_no_pose: int
    p50_ms: float | None  # of a frame; None: no time was taken

    def to_json(self) -> dict[str, Any]:
        """Named values."""
        return asdict(self)


def make_peer_rows(
    peers: Sequence[PeerTest], done: Sequence[Done[CaseTest]], timed: Sequence[Done[CaseTest]]
) -> list[PeerRow]:
    """Pool the tests of each stage and situation; our rows are of the peers' tests alone.

    Args:
        peers: tests that the peers have done.
        done: tests that our methods have done.
        timed: tests of the pass in which our times were taken.
    """
    ours = {one.test: _take_ours(one) for one in done}
    our_times = {one.test: _take_ours(one) for one in timed}
    rows = []
    for stage, situation in product(STAGE_NAMES, SITUATIONS):
        tests = [one for one in peers if one.test.case.place == (stage, situation)]
        frames = [{**ours.get(one.test, {}), **one.frames} for one in tests]
        times = [{**our_times.get(one.test, {}), **one.frames} for one in tests]
        names = dict.fromkeys(name for one in frames for name in one)
        rows += [
            _make_row(stage, situation, name, _select(name, frames), _select(name, times))
            for name in names
        ]
    return rows


def _select(name: str, tests: Sequence[_Frames]) -> list[tuple[PeerFrame, ...]]:
    """The frames of one tracker, of each test that it has followed."""
    return [one[name] for one in tests if name in one]


def _take_ours(done: Done[CaseTest]) -> dict[str, tuple[PeerFrame, ...]]:
    """Ours twice: with a pose only where the judge says OK, and with every pose."""
    scores = done.scores.get(OURS)
    if scores is None:
        return {}
    frames = [(one, one.total_ms if one.was_followed else None) for one in scores.frames]
    ok = tuple(PeerFrame(one.index, one.tre_mm if one.is_ok else None, ms) for one, ms in frames)
    every = tuple(PeerFrame(one.index, one.tre_mm, ms) for one, ms in frames)
    return {_OK: ok, _EVERY: every}


def _make_row(
    stage: str,
    situation: SituationName,
    tracker: str,
    tests: Sequence[tuple[PeerFrame, ...]],
    timed: Sequence[tuple[PeerFrame, ...]],
) -> PeerRow:
    frames = [frame for test in tests for frame in test]
    errors_mm = [frame.tre_mm for frame in frames if frame.tre_mm is not None]
    times_ms = [frame.ms for test in timed for frame in test if frame.ms is not None]
    return PeerRow(
        stage=stage,
        situation=situation,
        tracker=tracker,
        n_tests=len(tests),
        n_frames=len(frames),
        tre_median_mm=find_percentile(errors_mm, 50.0),
        tre_p95_mm=find_percentile(errors_mm, 95.0),
        n_within=sum(error_mm <= WRONG_MM for error_mm in errors_mm),
        n_no_pose=len(frames) - len(errors_mm),
        p50_ms=find_percentile(times_ms, 50.0),
    )
