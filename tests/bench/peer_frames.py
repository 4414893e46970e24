"""Other people's trackers on the tests of an evaluation: the program behind `--peers`.

usage: .venv-peers/bin/python -m tests.bench.peer_frames FOLDER
       .venv-peers/bin/python -m tests.bench.peer_frames --check

FOLDER is one of `navapp evaluate`. Its tests are rendered again from their seeds, and followed by
every peer from the pose that our registration finds in the first frame. `peers/` gets a file a test
as it is done. Started again, it goes on with what is missing, be it a test or a peer. The name of
each test is printed as soon as its file is there. One test at a time, so that the times are those
of one tracker. `--check` only loads what the peers need.
"""

import json
import sys
import time
from dataclasses import replace
from pathlib import Path

from navapp.evaluation.following import follow
from navapp.evaluation.paper.cases import CaseTest
from navapp.evaluation.paper.settings import TableSettings
from navapp.evaluation.peers.scores import PeerFrame, PeerTest, read_peers, write_peers
from navapp.evaluation.sequence import KnownSequence
from navapp.evaluation.truth import compute_mean_tre_mm
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import RigidTransform
from tests.bench.peer_trackers import Peer, make_peers

# So many frames are searched for the bone, as by the operator of our own tests.
_MOST_REGISTRATIONS = 5


def main(argument: str) -> None:
    """Follow what is missing in a folder."""
    peers = make_peers()
    if argument == "--check":
        return
    folder = Path(argument)
    settings = TableSettings.from_json(json.loads((folder / "settings.json").read_text()))
    kept = read_peers(folder, settings.tests)
    done = {one.test for one in kept if peers.keys() <= one.frames.keys()}
    if len(done) < len(settings.tests):
        # What is compiled or loaded at first use belongs to no test's times.
        follow_with_all(settings.tests[0], settings.render(settings.tests[0], 2), peers)
    for test in settings.tests:
        if test not in done:
            sequence = settings.render(test, settings.count_frames(test))
            write_peers(folder, follow_with_all(test, sequence, peers))
        print(test.name, flush=True)


def follow_with_all(test: CaseTest, sequence: KnownSequence, peers: dict[str, Peer]) -> PeerTest:
    """Every peer, one after the other, from the same first pose."""
    begun = find_start(sequence)
    return PeerTest(test, {name: score(sequence, begun, peer) for name, peer in peers.items()})


def find_start(sequence: KnownSequence) -> tuple[int, RigidTransform, TriangleMesh] | None:
    """Frame and pose of our own first registration, and the bone's surface; None: there is none."""
    for place in range(min(_MOST_REGISTRATIONS, len(sequence.frames))):
        part = slice(place, place + 1)
        here = replace(sequence, frames=sequence.frames[part], truth=sequence.truth[part])
        answers = follow(here, "bimcc")
        (pose,) = answers.poses
        if answers.followed.registration_s is not None and pose is not None:
            return place, pose, answers.surface
    return None


def score(
    sequence: KnownSequence, begun: tuple[int, RigidTransform, TriangleMesh] | None, peer: Peer
) -> tuple[PeerFrame, ...]:
    """Of all frames but the first one; without a pose before the bone was found."""
    start, first, surface = begun or (len(sequence.frames), None, None)
    tracker = None if first is None else peer(sequence.rig, surface, sequence.frames[start], first)
    scores = []
    for place in range(1, len(sequence.frames)):
        if tracker is None or place < start:
            scores.append(PeerFrame(place, None, None))
            continue
        started_s = time.perf_counter()
        pose = tracker(sequence.frames[place])
        ms = 1e3 * (time.perf_counter() - started_s)
        scores.append(PeerFrame(place, measure(sequence, place, pose), ms))
    return tuple(scores)


def measure(sequence: KnownSequence, place: int, pose: RigidTransform | None) -> float | None:
    """TRE over the stage's targets, as of our methods, mm."""
    true, stage = sequence.truth[place], sequence.stage
    if pose is None or true is None:
        return None
    return compute_mean_tre_mm(
        pose,
        true,
        sequence.plan.bones[stage.bone],
        sequence.plan.targets_of(stage.targets),
        sequence.true_targets_mm,
    )


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit((__doc__ or "").strip())
    try:
        main(sys.argv[1])
    except KeyboardInterrupt:  # who began it has been stopped as well, and says so
        sys.exit(130)
