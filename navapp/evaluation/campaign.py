"""Runs the tests of all cases, some at a time, and keeps each in a folder as it is done."""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path
from typing import Any, Generic, Protocol, TypeVar

from navapp.environment import source_hash
from navapp.errors import InputError, UsageError
from navapp.evaluation.following import Answers
from navapp.evaluation.scores import Followed
from navapp.evaluation.sequence import KnownSequence
from navapp.evaluation.workers import run_in_processes
from navapp.evaluation.worst_frame import draw_worst_frame
from navapp.geometry.whole_files import write_whole

_SETTINGS, _TESTS, _TIMES, _PICTURES = "settings.json", "tests", "times", "pictures"
# Setting that tells the code: results of two kinds of code do not belong into one table.
_SOURCE = "source"


class KnownTest(Protocol):
    """One simulated knee and what happens to it."""

    @property
    def name(self) -> str:
        """For files."""
        ...

    @property
    def seed(self) -> int:
        """Of the knee, its room and its pictures."""
        ...


T = TypeVar("T", bound=KnownTest)


class Campaign(Protocol[T]):
    """What is run; it is sent to other processes."""

    @property
    def methods(self) -> tuple[str, ...]:
        """Names of those that follow every test."""
        ...

    def count_frames(self, test: T) -> int:
        """How many count, of a test."""
        ...

    @property
    def tests(self) -> tuple[T, ...]:
        """All of them."""
        ...

    @property
    def timed_tests(self) -> tuple[T, ...]:
        """Those that are run once more, one after the other, for their times."""
        ...

    def group(self, tests: Sequence[T]) -> list[tuple[T, ...]]:
        """The tests in their order; those that share pictures are run in one process."""
        ...

    def render(self, test: T, n_frames: int) -> KnownSequence:
        """The pictures of a test: so many that count, after the one that is registered in."""
        ...

    def follow(self, sequence: KnownSequence, method: str) -> Answers:
        """What a method of these says of a sequence."""
        ...

    def __hash__(self) -> int:
        """The same campaign is warmed up for once."""
        ...

    def to_json(self) -> dict[str, Any]:
        """Named values; a folder is of one campaign only."""
        ...


@dataclass(frozen=True, slots=True)
class Done(Generic[T]):
    """A test with what each method made of it."""

    test: T
    followed: dict[str, Followed]


class CampaignFolder(Generic[T]):
    """Where the results of a campaign are kept, a file a test.

    Args:
        folder: new, or of the same campaign.
        settings: of the campaign.

    Raises:
        UsageError: it holds something else, or another campaign.
        InputError: it cannot be made, or its settings are damaged.
    """

    def __init__(self, folder: str | Path, settings: Campaign[T]) -> None:
        self.path, self._settings = Path(folder), settings
        wanted = {_SOURCE: source_hash(), **settings.to_json()}
        kept = self.path / _SETTINGS
        if kept.is_file():
            _check_same(folder, _read_settings(kept), wanted)
            return
        is_folder = self.path.is_dir()
        if self.path.exists() and (not is_folder or any(self.path.iterdir())):
            raise UsageError(
                f"{folder} holds something else" if is_folder else f"{folder} is no folder",
                subject=str(folder),
                remedy="choose a new folder for --out",
            )
        try:
            for part in (_TESTS, _TIMES, _PICTURES):
                (self.path / part).mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(
                f"folder {folder} cannot be made",
                subject=str(folder),
                remedy="choose another place for --out",
            ) from error
        write_whole(kept, (json.dumps(wanted, indent=1) + "\n").encode())

    def file_of(self, test: T, *, is_timed: bool) -> Path:
        """Of a test's results."""
        return self.path / (_TIMES if is_timed else _TESTS) / f"{test.name}.json"

    def picture_of(self, test: T) -> Path:
        """Of a test's worst frame."""
        return self.path / _PICTURES / f"{test.name}.jpg"

    def missing(self, tests: Sequence[T], *, is_timed: bool) -> list[T]:
        """Tests that are not done yet.

        Raises:
            InputError: a file is damaged; better told now than after hours.
        """
        done = {one.test for one in self.read(is_timed=is_timed)}
        return [test for test in tests if test not in done]

    def read(self, *, is_timed: bool) -> Iterator[Done[T]]:
        """All that is done, in the order of the tests.

        Raises:
            InputError: a file is damaged.
        """
        for test in self._settings.tests:
            path = self.file_of(test, is_timed=is_timed)
            if not path.is_file():
                continue
            try:
                content = json.loads(path.read_text(encoding="utf-8"))
                followed = {
                    method: Followed.from_json(content["methods"][method])
                    for method in self._settings.methods
                }
            except (ValueError, KeyError, TypeError) as error:
                raise InputError(
                    f"{path} is damaged", subject=str(path), remedy="delete it, and run again"
                ) from error
            yield Done(test, followed)


def run_campaign(
    folder: CampaignFolder[T],
    settings: Campaign[T],
    n_processes: int,
    on_progress: Callable[[int, int, str], None],
) -> None:
    """Run what is missing; killed in the middle, it goes on where it was.

    Args:
        folder: takes the results.
        settings: what is run.
        n_processes: at a time; times are taken in a pass of their own, one at a time.
        on_progress: told how many of how many are done, and which was the last: before anything is
            run (none), and after each group.
    """
    timed = settings.timed_tests
    missing = folder.missing(settings.tests, is_timed=False)
    slow = folder.missing(timed, is_timed=True)
    total = len(settings.tests) + len(timed)
    n_done = total - len(missing) - len(slow)
    on_progress(n_done, total, "")
    for part, processes, is_timed in ((missing, n_processes, False), (slow, 1, True)):
        run = partial(run_tests, folder, settings, is_timed=is_timed)
        for tests in run_in_processes(run, settings.group(part), processes):
            n_done += len(tests)
            on_progress(n_done, total, tests[-1].name)


def run_tests(
    folder: CampaignFolder[T], settings: Campaign[T], tests: Sequence[T], *, is_timed: bool
) -> None:
    """Run tests one after the other."""
    for test in tests:
        run_test(folder, settings, test, is_timed=is_timed)


def run_test(folder: CampaignFolder[T], settings: Campaign[T], test: T, *, is_timed: bool) -> None:
    """Render a test and follow it with every method; the file appears when all is done."""
    sequence = settings.render(test, settings.count_frames(test))
    if is_timed:
        _warm_up(settings)
        # Its errors are those of the other pass: without truth none is measured again.
        sequence = replace(sequence, truth=[None] * len(sequence.truth))
    answers = {method: settings.follow(sequence, method) for method in settings.methods}
    if not is_timed and "bimcc" in answers:
        picture = draw_worst_frame(sequence, answers["bimcc"])
        if picture is not None:
            write_whole(folder.picture_of(test), picture)
    content = {
        "test": test.name,
        "seed": test.seed,
        "methods": {method: one.followed.to_json() for method, one in answers.items()},
    }
    path = folder.file_of(test, is_timed=is_timed)
    write_whole(path, (json.dumps(content, allow_nan=False) + "\n").encode())


@cache
def _warm_up(settings: Campaign[Any]) -> None:
    """Load what a process compiles or reads at its first frames: it belongs to no test's times."""
    sequence = settings.render(settings.tests[0], 2)
    for method in settings.methods:
        settings.follow(sequence, method)


def _check_same(folder: str | Path, kept: Any, wanted: Mapping[str, Any]) -> None:
    """Refuse to go on with another evaluation, or with other code."""
    if kept == wanted:
        return
    if isinstance(kept, dict) and {**kept, _SOURCE: wanted[_SOURCE]} == wanted:
        raise UsageError(
            f"{folder} was begun with other code of navapp",
            subject=str(folder),
            remedy="go on with that code, or choose another --out",
        )
    raise UsageError(
        f"{folder} holds another evaluation",
        subject=str(folder),
        remedy="give the same options to go on with it, or choose another --out",
    )


def _read_settings(path: Path) -> Any:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise InputError(
            f"{path} is damaged", subject=str(path), remedy="choose a new folder for --out"
        ) from error
