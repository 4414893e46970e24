"""Frames of peers by hand."""

from collections.abc import Sequence

from navapp.evaluation.paper.cases import CaseTest
from navapp.evaluation.peers.scores import PeerFrame, PeerTest


def peer_frames(
    errors_mm: Sequence[float | None], ms: float | None = 30.0
) -> tuple[PeerFrame, ...]:
    return tuple(PeerFrame(place, one, ms) for place, one in enumerate(errors_mm, start=1))


def peer_test(test: CaseTest, **errors_mm: Sequence[float | None]) -> PeerTest:
    """One test, by the names of peers."""
    frames = {name: peer_frames(one) for name, one in errors_mm.items()}
    return PeerTest(test, frames, "code")
