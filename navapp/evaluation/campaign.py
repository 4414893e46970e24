"""Runs the tests of all cases, some at a time, and keeps each in a folder as it is done."""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from itertools import groupby
from pathlib import Path
from typing import Any, Generic, Protocol, TypeVar

from pydantic import TypeAdapter

from navapp.config import Configuration
from navapp.environment import source_hash
from navapp.errors import InputError, UsageError
from navapp.evaluation.following import follow
from navapp.evaluation.methods import OURS, find_method
from navapp.evaluation.provenance import list_libraries, name_processor
from navapp.evaluation.scores import SequenceScore
from navapp.evaluation.scoring import score_answers
from navapp.evaluation.sequence import KnownSequence
from navapp.evaluation.workers import run_in_processes
from navapp.evaluation.worst_frame import draw_worst_frame
from navapp.geometry.whole_files import write_whole

_SETTINGS, _TESTS, _TIMES, _PICTURES = "settings.json", "tests", "times", "pictures"
# Keys that tell which code made the results: results of different code are not mixed.
_SOURCE = "source"
_LIBRARIES = "libraries"


class KnownTest(Protocol):
    """One simulated knee and what happens to it."""

    @property
    def name(self) -> str:
        """Name of the test's result files."""
        ...

    @property
    def seed(self) -> int:
        """Random seed of the knee, its room and its pictures."""
        ...

    def configure(self) -> Configuration:
        """The simulated camera: tests with the same one show the same pictures."""
        ...


T = TypeVar("T", bound=KnownTest)


class Campaign(Protocol[T]):
    """What is run; it is sent to other processes."""

    @property
    def methods(self) -> tuple[str, ...]:
        """Names of those that follow every test (`methods.find_method`)."""
        ...

    @property
    def tests(self) -> tuple[T, ...]:
        """All of them; those with the same pictures stand beside each other."""
        ...

    @property
    def timed_tests(self) -> tuple[T, ...]:
        """Those that are run once more, one after the other, for their times."""
        ...

    @property
    def has_details(self) -> bool:
        """Whether our worst frames are drawn, and error budgets are measured: that takes time."""
        ...

    def render(self, test: T, n_frames: int | None = None) -> KnownSequence:
        """The pictures of a test, or only so many frames after the one that is registered in."""
        ...

    def to_json(self) -> dict[str, Any]:
        """Named values; a folder is of one campaign only."""
        ...

    def __hash__(self) -> int:
        """Settings are immutable: `_warm_up` is cached by them."""
        ...


@dataclass(frozen=True, slots=True)
class Done(Generic[T]):
    """A test with what each method made of it."""

    test: T
    scores: dict[str, SequenceScore]  # by the method's name
    machine: str = ""  # that it was run on


@dataclass(frozen=True, slots=True)
class _TestFile:
    """What is kept of a test."""

    test: str
    seed: int
    machine: str
    methods: dict[str, SequenceScore]


_TEST_FILE = TypeAdapter(_TestFile)


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
        self._source = source_hash()
        wanted = {
            _SOURCE: self._source, _LIBRARIES: list_libraries(), **settings.to_json()
        }  # fmt: skip
        kept = self.path / _SETTINGS
        if kept.is_file():
            _check_same(folder, _read_settings(kept), wanted)
        elif self.path.exists() and not self.path.is_dir():
            raise UsageError(
                f"{folder} is no folder", subject=str(folder),
                remedy="choose a new folder for --out",
            )  # fmt: skip
        elif self.path.is_dir() and any(self.path.iterdir()):
            raise UsageError(
                f"{folder} holds something else", subject=str(folder),
                remedy="choose a new folder for --out",
            )  # fmt: skip
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            # Also where they are kept already: better told now than after the first test.
            write_whole(kept, (json.dumps(wanted, indent=1) + "\n").encode())
            for part in (_TESTS, _TIMES, _PICTURES):
                (self.path / part).mkdir(exist_ok=True)
        except OSError as error:
            raise InputError(
                f"folder {folder} cannot be written",
                subject=str(folder),
                remedy="choose another place for --out",
            ) from error

    def check_code(self) -> None:
        """Check that the code is still the one that the folder was opened with.

        Raises:
            UsageError: the code of navapp was changed while it ran.
        """
        if source_hash() != self._source:
            raise UsageError(
                "the code of navapp was changed during the run",
                subject=str(self.path),
                remedy="go on with the code that began it, or choose another --out",
            )

    def file_of(self, test: T, *, is_timed: bool) -> Path:
        """Path of a test's results."""
        return self.path / (_TIMES if is_timed else _TESTS) / f"{test.name}.json"

    def picture_of(self, test: T) -> Path:
        """Path of the picture of a test's worst frame."""
        return self.path / _PICTURES / f"{test.name}.jpg"

    def write(self, done: Done[T], *, is_timed: bool, picture: bytes | None = None) -> None:
        """Keep a test; its file appears when all of it is there.

        Raises:
            UsageError: the code of navapp was changed since the folder was opened.
            InputError: it cannot be written.
        """
        self.check_code()
        test = done.test
        kept = _TestFile(test.name, test.seed, done.machine, done.scores)
        # A number that is none must not be read as "not known" later: it raises here.
        content = _TEST_FILE.dump_python(kept)
        path = self.file_of(test, is_timed=is_timed)
        try:
            if picture is not None:
                write_whole(self.picture_of(test), picture)
            write_whole(path, (json.dumps(content, allow_nan=False) + "\n").encode())
        except OSError as error:
            raise InputError(
                f"{path} cannot be written ({error.strerror})",
                subject=str(path),
                remedy="make room or give access there, and run again",
            ) from error

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
                kept = _TEST_FILE.validate_json(path.read_bytes())
                scores = {method: kept.methods[method] for method in self._settings.methods}
            except (ValueError, KeyError) as error:
                raise InputError(
                    f"{path} is damaged", subject=str(path), remedy="delete it, and run again"
                ) from error
            yield Done(test, scores, kept.machine)


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
        # Levels of a rig or a plan are seen in the same pictures.
        groups = [tuple(tests) for _, tests in groupby(part, key=lambda test: test.configure())]
        for tests in run_in_processes(run, groups, processes):
            n_done += len(tests)
            on_progress(n_done, total, tests[-1].name)


def run_tests(
    folder: CampaignFolder[T], settings: Campaign[T], tests: Sequence[T], *, is_timed: bool
) -> None:
    """Run tests one after the other."""
    for test in tests:
        run_test(folder, settings, test, is_timed=is_timed)


def run_test(folder: CampaignFolder[T], settings: Campaign[T], test: T, *, is_timed: bool) -> None:
    """Render a test, follow it with every method, and keep what came of it."""
    sequence = settings.render(test)
    if is_timed:
        _warm_up(settings)
        # Its errors are those of the other pass: without truth none is measured again.
        sequence = replace(sequence, truth=[None] * len(sequence.truth))
    answers = {name: follow(sequence, *find_method(name)) for name in settings.methods}
    scored = {
        name: score_answers(sequence, one, has_budget=settings.has_details and name == OURS)
        for name, one in answers.items()
    }  # fmt: skip
    picture = None
    if settings.has_details and OURS in answers and not is_timed:
        picture = draw_worst_frame(sequence, answers[OURS], scored[OURS].frames)
    folder.write(Done(test, scored, name_processor()), is_timed=is_timed, picture=picture)


@cache
def _warm_up(settings: Campaign[Any]) -> None:
    """Load what a process compiles or reads at its first frames: it belongs to no test's times."""
    sequence = settings.render(settings.tests[0], 2)
    for name in settings.methods:
        follow(sequence, *find_method(name))


def _check_same(folder: str | Path, kept: Any, wanted: Mapping[str, Any]) -> None:
    """Refuse to go on with another evaluation, or with other code."""
    if kept == wanted:
        return
    of_code = {key: wanted[key] for key in (_SOURCE, _LIBRARIES)}
    if isinstance(kept, dict) and {**kept, **of_code} == wanted:
        other = "code of navapp" if kept.get(_SOURCE) != wanted[_SOURCE] else "libraries"
        raise UsageError(
            f"{folder} was begun with other {other}",
            subject=str(folder),
            remedy="go on with these, or choose another --out",
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
