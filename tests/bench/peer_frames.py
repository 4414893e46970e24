"""Other people's trackers on the tests of an evaluation: the program behind `--peers`.

usage: .venv-peers/bin/python -m tests.bench.peer_frames FOLDER
       .venv-peers/bin/python -m tests.bench.peer_frames --check

FOLDER is one of `navapp evaluate`. Its tests are rendered again from their seeds, and followed by
every peer from our first accepted pose. As soon as a test is done,
its file is written into `peers/`, and its name is printed. Started again, it follows only the tests
that lack a file or a peer in it, or were followed by other code of the peers. One test is run at a
time, so that the times are those of one tracker. `--check` only loads what the peers need.
"""

import hashlib
import json
import sys
import time
from dataclasses import dataclass, replace
from importlib.metadata import distributions
from pathlib import Path

from navapp.environment import source_hash
from navapp.evaluation.following import MOST_REGISTRATIONS, follow, is_accepted
from navapp.evaluation.paper.settings import TableSettings
from navapp.evaluation.peers.scores import PeerFrame, PeerTest, read_peers, write_peers
from navapp.evaluation.sequence import KnownSequence
from navapp.evaluation.truth import compute_mean_tre_mm
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import RigidTransform
from tests.bench.peer_trackers import Peer, make_peers


def main(argument: str) -> None:
    """Follow what is missing in a folder."""
    peers = make_peers()
    if argument == "--check":
        return
    folder = Path(argument)
    settings = TableSettings.from_json(json.loads((folder / "settings.json").read_text()))
    kept = read_peers(folder, settings.tests)
    code = find_code()
    done = {one.test for one in kept if one.code == code and peers.keys() <= one.frames.keys()}
    if len(done) < len(settings.tests):
        # What is compiled or loaded at first use belongs to no test's times.
        follow_with_all(settings.render(settings.tests[0], 2), peers)
    for test in settings.tests:
        if test not in done:
            frames = follow_with_all(settings.render(test), peers)
            write_peers(folder, PeerTest(test, frames, code))
        print(test.name, flush=True)


def find_code() -> str:
    """Hash of all that the peers' answers depend on: navapp, their files, the libraries."""
    here = Path(__file__).resolve().parent
    digest = hashlib.sha256(source_hash().encode())
    for path in [*sorted(here.glob("peer_*.py")), *sorted((here / "visp").iterdir())]:
        if path.is_file():
            digest.update(path.read_bytes())
    installed = sorted(f"{one.name} {one.version}" for one in distributions())
    digest.update("\n".join(installed).encode())
    return digest.hexdigest()[:12]


def follow_with_all(
    sequence: KnownSequence, peers: dict[str, Peer]
) -> dict[str, tuple[PeerFrame, ...]]:
    """Every peer, one after the other, from the same first pose."""
    start = find_start(sequence)
    return {name: score(sequence, start, peer) for name, peer in peers.items()}


@dataclass(frozen=True, slots=True, eq=False)
class Start:
    """What our own first registration has found."""

    place: int  # of its frame in the sequence
    pose: RigidTransform  # left camera from bone
    surface: TriangleMesh  # of what is left of the bone


def find_start(sequence: KnownSequence) -> Start | None:
    """In the first frame, or in one of the next; None: the bone was not found.

    As for our own method a pose must be OK; only the last search is taken if it is not lost.
    """
    n_searches = min(MOST_REGISTRATIONS, len(sequence.frames))
    for place in range(n_searches):
        part = slice(place, place + 1)
        here = replace(sequence, frames=sequence.frames[part], truth=sequence.truth[part])
        answers = follow(here, "bimcc")
        (found,) = answers.frames
        is_enough = is_accepted(found.status, is_last=place == n_searches - 1)
        if is_enough and found.pose is not None:
            return Start(place, found.pose, answers.surface)
    return None


def score(sequence: KnownSequence, start: Start | None, peer: Peer) -> tuple[PeerFrame, ...]:
    """Of all frames but the first one; those before the start count as without a pose."""
    n_frames = len(sequence.frames)
    if start is None:
        return tuple(PeerFrame(place, None, None) for place in range(1, n_frames))
    scores = [PeerFrame(place, None, None) for place in range(1, start.place)]
    tracker = peer(sequence.rig, start.surface, sequence.frames[start.place], start.pose)
    for place in range(max(1, start.place), n_frames):
        started_s = time.perf_counter()
        pose = tracker(sequence.frames[place])
        ms = 1e3 * (time.perf_counter() - started_s)
        scores.append(PeerFrame(place, measure_tre_mm(sequence, place, pose), ms))
    return tuple(scores)


def measure_tre_mm(
    sequence: KnownSequence, place: int, pose: RigidTransform | None
) -> float | None:
    """Over the stage's targets, as for our methods."""
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
    except KeyboardInterrupt:  # `navapp evaluate` is stopped by the same ctrl+c, and says so
        sys.exit(130)
