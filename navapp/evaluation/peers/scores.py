"""Results of other people's trackers, and the files that keep them."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from pydantic import TypeAdapter

from navapp.errors import InputError
from navapp.evaluation.paper.cases import CaseTest
from navapp.geometry.whole_files import write_whole

_FOLDER = "peers"


@dataclass(frozen=True, slots=True)
class PeerFrame:
    """What a peer said of one frame, beside where the bone really was."""

    index: int  # of the frame in its sequence
    tre_mm: float | None  # mean over the stage's targets; None without a pose
    ms: float | None  # from the two pictures to the pose; None before the peer has started


@dataclass(frozen=True, slots=True)
class PeerTest:
    """One test with the counted frames of every peer, by the peer's name."""

    test: CaseTest
    frames: Mapping[str, tuple[PeerFrame, ...]]
    code: str  # of the peers, their settings and libraries (`tests.bench.peer_frames`)


@dataclass(frozen=True, slots=True)
class _PeerFile:
    """What is kept of a test."""

    test: str
    seed: int
    code: str
    peers: Mapping[str, tuple[PeerFrame, ...]]


_PEER_FILE = TypeAdapter(_PeerFile)


def file_of(folder: Path, test: CaseTest) -> Path:
    """Where the results of a test are kept, in the folder of an evaluation."""
    return folder / _FOLDER / f"{test.name}.json"


def write_peers(folder: Path, done: PeerTest) -> None:
    """Keep the results of a test; the file appears when it is whole."""
    path = file_of(folder, done.test)
    path.parent.mkdir(exist_ok=True)
    kept = _PeerFile(done.test.name, done.test.seed, done.code, done.frames)
    content = json.dumps(_PEER_FILE.dump_python(kept), allow_nan=False)
    write_whole(path, (content + "\n").encode())


def read_peers(folder: Path, tests: Sequence[CaseTest]) -> list[PeerTest]:
    """All tests that the peers have done, in their order.

    Raises:
        InputError: a file is damaged.
    """
    return [_read(folder, test) for test in tests if file_of(folder, test).is_file()]


def _read(folder: Path, test: CaseTest) -> PeerTest:
    path = file_of(folder, test)
    try:
        kept = _PEER_FILE.validate_json(path.read_bytes())
    except ValueError as error:
        raise InputError(
            f"{path} is damaged", subject=str(path), remedy="delete it, and run again"
        ) from error
    return PeerTest(test, kept.peers, kept.code)
