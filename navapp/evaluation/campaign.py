"""Runs the tests of all cases, two at a time, and keeps each in a folder as it is done."""

import json
import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from navapp import __version__
from navapp.errors import InputError, UsageError
from navapp.evaluation.cases import Case, CaseTest, list_tests
from navapp.evaluation.following import follow
from navapp.evaluation.scores import Followed
from navapp.evaluation.sequence import render_test
from navapp.evaluation.worst_frame import draw_worst_frame
from navapp.geometry.whole_files import write_whole
from navapp.tracking import Method

_SETTINGS, _TESTS, _TIMES, _PICTURES = "settings.json", "tests", "times", "pictures"


@dataclass(frozen=True, slots=True)
class CampaignSettings:
    """What is run; another campaign in the same folder must have the same."""

    cases: tuple[Case, ...]
    methods: tuple[Method, ...]
    n_tests: int  # of each case
    n_frames: int  # of each test, after the one that is registered in
    first_seed: int
    is_quick: bool = False

    def to_json(self) -> dict[str, Any]:
        """Named values, with the version that has them."""
        return {
            "navapp": __version__,
            "cases": [case.name for case in self.cases],
            **{key: value for key, value in asdict(self).items() if key != "cases"},
            "methods": list(self.methods),
        }

    @property
    def tests(self) -> tuple[CaseTest, ...]:
        """All tests."""
        return tuple(list_tests(self.cases, self.n_tests, self.first_seed))

    @property
    def timed_tests(self) -> tuple[CaseTest, ...]:
        """The first of each case; none for a quick look, whose times are those of its tests."""
        return () if self.is_quick else self.tests[:: self.n_tests]


@dataclass(frozen=True, slots=True)
class Done:
    """A test with what each method made of it."""

    test: CaseTest
    followed: dict[Method, Followed]


class CampaignFolder:
    """Where the results of a campaign are kept, a file a test.

    Args:
        folder: new, or of the same campaign.
        settings: of the campaign.

    Raises:
        UsageError: it holds something else, or another campaign.
    """

    def __init__(self, folder: str | Path, settings: CampaignSettings) -> None:
        self.path, self._settings = Path(folder), settings
        wanted, kept = settings.to_json(), self.path / _SETTINGS
        if kept.is_file():
            if json.loads(kept.read_text(encoding="utf-8")) != wanted:
                raise UsageError(
                    f"{folder} holds another evaluation",
                    subject=str(folder),
                    remedy="give the same options to go on with it, or choose another --out",
                )
            return
        if self.path.exists() and any(self.path.iterdir()):
            raise UsageError(
                f"{folder} holds something else",
                subject=str(folder),
                remedy="choose a new folder for --out",
            )
        for part in (_TESTS, _TIMES, _PICTURES):
            (self.path / part).mkdir(parents=True, exist_ok=True)
        write_whole(kept, (json.dumps(wanted, indent=1) + "\n").encode())

    def file_of(self, test: CaseTest, *, is_timed: bool) -> Path:
        """Of a test's results."""
        return self.path / (_TIMES if is_timed else _TESTS) / f"{test.name}.json"

    def picture_of(self, test: CaseTest) -> Path:
        """Of a test's worst frame."""
        return self.path / _PICTURES / f"{test.name}.jpg"

    def missing(self, tests: Sequence[CaseTest], *, is_timed: bool) -> list[CaseTest]:
        """Tests that are not done yet."""
        return [test for test in tests if not self.file_of(test, is_timed=is_timed).is_file()]

    def read(self, *, is_timed: bool) -> Iterator[Done]:
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
    folder: CampaignFolder,
    settings: CampaignSettings,
    n_processes: int,
    on_progress: Callable[[int, int, str], None],
) -> None:
    """Run what is missing; killed in the middle, it goes on where it was.

    Args:
        folder: takes the results.
        settings: what is run.
        n_processes: at a time; times are taken in a pass of their own, one at a time.
        on_progress: told how many of how many are done, and which was the last.
    """
    timed = settings.timed_tests
    missing = folder.missing(settings.tests, is_timed=False)
    slow = folder.missing(timed, is_timed=True)
    total = len(settings.tests) + len(timed)
    n_done = total - len(missing) - len(slow)
    for part, processes, is_timed in ((missing, n_processes, False), (slow, 1, True)):
        for test in _run_all(folder, settings, part, processes, is_timed=is_timed):
            n_done += 1
            on_progress(n_done, total, test.name)


def _run_all(
    folder: CampaignFolder,
    settings: CampaignSettings,
    tests: Sequence[CaseTest],
    n_processes: int,
    *,
    is_timed: bool,
) -> Iterator[CaseTest]:
    # Spawned: a process that was forked from one with threads may hang.
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(n_processes, mp_context=context) as pool:
        jobs = {
            pool.submit(run_test, folder, settings, test, is_timed=is_timed): test for test in tests
        }
        try:
            for job in as_completed(jobs):
                job.result()
                yield jobs[job]
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


def run_test(
    folder: CampaignFolder, settings: CampaignSettings, test: CaseTest, *, is_timed: bool
) -> None:
    """Render a test and follow it with every method; the file appears when all is done."""
    sequence = render_test(test, settings.n_frames + 1)
    answers = {method: follow(sequence, method) for method in settings.methods}
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
