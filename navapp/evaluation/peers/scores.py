"""Results of other people's trackers, and the files that keep them."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

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


def file_of(folder: Path, test: CaseTest) -> Path:
    """Where the results of a test are kept, in the folder of an evaluation."""
    return folder / _FOLDER / f"{test.name}.json"


def write_peers(folder: Path, done: PeerTest) -> None:
    """Keep the results of a test; the file appears when it is whole."""
    path = file_of(folder, done.test)
    path.parent.mkdir(exist_ok=True)
    content: dict[str, Any] = {
        "test": done.test.name,
        "seed": done.test.seed,
        "peers": {name: [asdict(one) for one in frames] for name, frames in done.frames.items()},
    }
    write_whole(path, (json.dumps(content, allow_nan=False) + "\n").encode())


def read_peers(folder: Path, tests: Sequence[CaseTest]) -> list[PeerTest]:
    """All tests that the peers have done, in their order.

    Raises:
        InputError: a file is damaged.
    """
    return [_read(folder, test) for test in tests if file_of(folder, test).is_file()]


def _read(folder: Path, test: CaseTest) -> PeerTest:
    path = file_of(folder, test)
    try:
        peers = json.loads(path.read_text(encoding="utf-8"))["peers"]
        frames = {
            name: tuple(PeerFrame(one["index"], one["tre_mm"], one["ms"]) for one in kept)
            for name, kept in peers.items()
        }
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise InputError(
            f"{path} is damaged", subject=str(path), remedy="delete it, and run again"
        ) from error
    return PeerTest(test, frames)
