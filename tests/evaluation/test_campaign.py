"""Campaigns: what is kept, what is run again, what is refused."""

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import pytest

from navapp.config import Configuration
from navapp.errors import InputError, UsageError
from navapp.evaluation import campaign
from navapp.evaluation.campaign import CampaignFolder, Done, run_campaign
from navapp.evaluation.paper.cases import ALL_CASES, CaseTest
from navapp.evaluation.paper.results import write_results
from navapp.evaluation.paper.settings import TableSettings
from navapp.evaluation.scores import ErrorBudget
from tests.evaluation.scored import followed, score

pytestmark = pytest.mark.usefixtures("empty_plots")

SETTINGS = TableSettings(ALL_CASES[:2], ("paper", "bimcc"), 2, 3, 1)
NAMES = [test.name for test in SETTINGS.tests]


@dataclass(frozen=True)
class Pictures:
    """Stands for a rendered sequence."""

    test: CaseTest
    truth: Sequence[object | None]


class Line:
    """Stands for renderer and methods: answers that a test's seed tells, and how long they took."""

    def __init__(self) -> None:
        self.done: list[tuple[int, str]] = []  # seed and method
        self.is_scored: list[bool] = []  # of each of them: its truth was there
        self.is_killed_at: int | None = None  # so many methods were followed
        self.total_ms = 10.0
        self.has_picture = True

    def render(self, test, n_frames: int):
        assert n_frames in (4, 3), "one frame more than are counted, or those of a warm-up"
        return Pictures(test, [object()] * n_frames)

    def follow(self, sequence, method, leaves_out):
        assert not leaves_out
        if self.is_killed_at == len(self.done):
            raise KeyboardInterrupt
        self.done.append((sequence.test.seed, method))
        self.is_scored.append(all(sequence.truth))
        self.total_ms += 1.0
        value = 1e-3 * sequence.test.seed + (0.5 if method == "paper" else 0.0)
        frames = [score(value, index=n, total_ms=self.total_ms) for n in (1, 2, 3)]
        return followed(*frames, registration_s=1e-3 * self.total_ms)

    def draw(self, sequence, _answers, _scores) -> bytes | None:
        return f"picture of {sequence.test.seed}".encode() if self.has_picture else None


@pytest.fixture
def line(monkeypatch) -> Iterator[Line]:
    line = Line()

    def run_here(do, items, n_processes) -> Iterator[object]:
        assert n_processes >= 1
        for item in items:
            do(item)
            yield item

    for name, value in (
        ("run_in_processes", run_here),
        ("draw_worst_frame", line.draw),
        ("follow", line.follow),
        ("score_answers", lambda _sequence, answers, *, has_budget: answers),
    ):
        monkeypatch.setattr(campaign, name, value)
    monkeypatch.setattr(CaseTest, "render", lambda test, n_frames: line.render(test, n_frames))
    campaign._warm_up.cache_clear()
    yield line
    campaign._warm_up.cache_clear()


def run(path, settings=SETTINGS, told=None) -> CampaignFolder:
    folder = CampaignFolder(path, settings)
    run_campaign(folder, settings, 2, lambda *news: None if told is None else told.append(news))
    return folder


def test_a_group_is_run_as_a_whole_and_gone_on_within(line: Line, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(CaseTest, "configure", lambda test: Configuration())
    told = []
    line.is_killed_at = 5  # in the third test of four
    with pytest.raises(KeyboardInterrupt):
        run(tmp_path)
    done = len(list((tmp_path / "tests").iterdir()))
    assert done == 2
    line.is_killed_at = None
    run(tmp_path, told=told)
    assert len(list((tmp_path / "tests").iterdir())) == 4
    # What was done before, and both groups at their ends: two that were left, those for times.
    n_timed = len(SETTINGS.timed_tests)
    assert [n for n, _, _ in told] == [2, 4, 4 + n_timed]
    assert {of for _, of, _ in told} == {4 + n_timed}
    n_followed = sum(method == "bimcc" for _, method in line.done)
    assert n_followed == 4 + 1 + n_timed, "each test once, one to warm up, those for times"


def files_of(path) -> dict[str, bytes]:
    return {
        one.relative_to(path).as_posix(): one.read_bytes() for one in path.rglob("*")
        if one.is_file()
    }  # fmt: skip


def without_times(value):
    if isinstance(value, dict):
        timed = ("total_ms", "registration_s", "fps", "latency_ms")
        return {key: without_times(one) for key, one in value.items() if key not in timed}
    return [without_times(one) for one in value] if isinstance(value, list) else value


def test_every_test_has_a_file_and_the_first_of_each_case_its_times(line, tmp_path) -> None:
    told = []
    folder = run(tmp_path / "a", told=told)
    assert sorted(files_of(tmp_path / "a")) == sorted(
        [
            "settings.json",
            *(f"tests/{name}.json" for name in NAMES),
            *(f"pictures/{name}.jpg" for name in NAMES),
            "times/man-opening-registration-0.json",
            "times/man-opening-overlay-0.json",
        ]
    )
    assert [news[:2] for news in told] == [(n, 6) for n in range(7)]
    assert [one.test.name for one in folder.read(is_timed=False)] == NAMES
    assert list(next(folder.read(is_timed=True)).scores) == ["paper", "bimcc"]


def test_times_are_taken_when_everything_is_loaded(line, tmp_path) -> None:
    run(tmp_path / "a")
    # Four tests, a warm-up of the process that takes times, and two tests in it.
    seeds = [seed for seed, method in line.done if method == "bimcc"]
    assert seeds == [1, 2, 101, 102, 1, 1, 101]


def test_errors_are_measured_in_the_tests_alone_not_where_times_are_taken(line, tmp_path) -> None:
    run(tmp_path / "a")
    assert line.is_scored[:8] == [True] * 8, "four tests, two methods"
    assert line.is_scored[-4:] == [False] * 4, "two tests"


@pytest.mark.parametrize("n_followed", [0, 1, 3, 8, 11, 12, 13])
def test_killed_in_the_middle_it_goes_on_where_it_was(line, tmp_path, n_followed) -> None:
    run(tmp_path / "whole")
    line.done.clear()
    campaign._warm_up.cache_clear()
    line.is_killed_at = n_followed
    with pytest.raises(KeyboardInterrupt):
        run(tmp_path / "killed")
    before = files_of(tmp_path / "killed")
    done = {name for name in before if name.startswith(("tests/", "times/"))}
    assert all(json.loads(before[name])["methods"].keys() == {"paper", "bimcc"} for name in done)
    # Two methods a test, and two of the warm-up between the passes.
    assert len(done) == min(n_followed // 2, 4) + max(0, (n_followed - 10) // 2)

    line.is_killed_at, told = None, []
    line.done.clear()
    campaign._warm_up.cache_clear()
    run(tmp_path / "killed", told=told)
    assert [n for n, _, _ in told] == list(range(len(done), 7))
    after = files_of(tmp_path / "killed")
    assert {name: after[name] for name in done} == {name: before[name] for name in done}
    whole = files_of(tmp_path / "whole")
    assert after.keys() == whole.keys()
    for name in after:
        if name.endswith(".json"):
            one, other = json.loads(after[name]), json.loads(whole[name])
            assert without_times(one) == without_times(other)
        else:
            assert after[name] == whole[name]

    line.done.clear()
    run(tmp_path / "killed")
    assert line.done == [], "what is done is not run again"


@pytest.mark.parametrize(
    "other",
    [
        {"n_tests": 3}, {"n_frames": 4}, {"first_seed": 2}, {"is_quick": True},
        {"methods": ("bimcc",)}, {"cases": ALL_CASES[:1]}, {"cases": ALL_CASES[1::-1]},
    ],
    ids=lambda other: next(iter(other)),
)  # fmt: skip
def test_other_settings_are_refused_and_change_nothing(line, tmp_path, other) -> None:
    run(tmp_path)
    before = files_of(tmp_path)
    with pytest.raises(UsageError, match="holds another evaluation: give the same options") as told:
        CampaignFolder(tmp_path, replace(SETTINGS, **other))
    assert told.value.exit_code == 2
    assert files_of(tmp_path) == before


def test_other_code_does_not_go_on(line, tmp_path, monkeypatch) -> None:
    run(tmp_path)
    monkeypatch.setattr(campaign, "source_hash", lambda: "99")
    with pytest.raises(UsageError, match="begun with other code of navapp: go on with these"):
        CampaignFolder(tmp_path, SETTINGS)


def test_code_that_changes_during_a_run_ends_it(line, tmp_path, monkeypatch) -> None:
    folder = CampaignFolder(tmp_path, SETTINGS)
    monkeypatch.setattr(campaign, "source_hash", lambda: "99")
    with pytest.raises(UsageError, match="changed during the run: go on with the code that began"):
        run_campaign(folder, SETTINGS, 2, lambda *_: None)
    assert list((tmp_path / "tests").iterdir()) == []


def test_other_libraries_do_not_go_on(line, tmp_path, monkeypatch) -> None:
    run(tmp_path)
    monkeypatch.setattr(campaign, "list_libraries", lambda: {"numpy": "0.1"})
    with pytest.raises(UsageError, match="other libraries"):
        CampaignFolder(tmp_path, SETTINGS)


def test_a_result_that_cannot_be_written_is_told(line, tmp_path, monkeypatch) -> None:
    folder = CampaignFolder(tmp_path, SETTINGS)

    def refuse(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(campaign, "write_whole", refuse)
    with pytest.raises(InputError, match=r"written \(No space left on device\): make room"):
        run_campaign(folder, SETTINGS, 2, lambda *_: None)


def test_times_of_another_machine_are_told(line, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(campaign, "name_processor", lambda: "an abacus")
    write_results(run(tmp_path), SETTINGS)
    assert "times were taken on: an abacus" in (tmp_path / "tables.md").read_text()


def test_what_is_not_its_own_is_left_alone(tmp_path) -> None:
    (tmp_path / "thesis.txt").write_text("years")
    with pytest.raises(UsageError, match="holds something else: choose a new folder"):
        CampaignFolder(tmp_path, SETTINGS)
    assert list(files_of(tmp_path)) == ["thesis.txt"]
    with pytest.raises(UsageError, match="is no folder: choose a new folder"):
        CampaignFolder(tmp_path / "thesis.txt", SETTINGS)
    with pytest.raises(InputError, match="cannot be written: choose another place"):
        CampaignFolder(tmp_path / "thesis.txt" / "a", SETTINGS)


def test_an_empty_folder_and_one_that_is_not_there_are_used(tmp_path) -> None:
    (tmp_path / "empty").mkdir()
    for path in (tmp_path / "empty", tmp_path / "new" / "deep"):
        CampaignFolder(path, SETTINGS)
        assert (path / "settings.json").is_file()
        CampaignFolder(path, SETTINGS)


@pytest.mark.parametrize("damage", ["", "{", "[]", "{}", '{"methods": {}}', '{"methods": 3}'])
def test_a_damaged_file_is_told_before_anything_is_run(line, tmp_path, damage) -> None:
    folder = run(tmp_path)
    folder.file_of(SETTINGS.tests[1], is_timed=False).write_text(damage)
    folder.file_of(SETTINGS.tests[3], is_timed=False).unlink()
    line.done.clear()
    with pytest.raises(InputError, match=rf"{NAMES[1]}.json is damaged: delete it, and run again"):
        run(tmp_path)
    assert line.done == []
    folder.file_of(SETTINGS.tests[1], is_timed=False).unlink()
    run(tmp_path)
    assert len(line.done) == 2 * 2


def test_a_test_is_read_as_it_was_kept(tmp_path) -> None:
    folder = CampaignFolder(tmp_path, SETTINGS)
    one = followed(
        score(0.3, budget=ErrorBudget(0.01, 0.02, 0.03, 0.3), claimed_mm=(0.1, 0.2, 0.3, 0.4)),
        score(None, "LOST", reasons=("a", "b"), seen=None),
    )
    test = SETTINGS.tests[0]
    folder.write(Done(test, {"paper": one, "bimcc": one}, "a computer"), is_timed=False)
    (kept,) = folder.read(is_timed=False)
    assert kept == Done(test, {"paper": one, "bimcc": one}, "a computer")


def test_a_number_that_is_none_is_not_kept_as_unknown(tmp_path) -> None:
    folder = CampaignFolder(tmp_path, SETTINGS)
    bad = followed(score(float("nan")))
    with pytest.raises(ValueError, match="not JSON compliant"):
        folder.write(Done(SETTINGS.tests[0], {"paper": bad, "bimcc": bad}), is_timed=False)
    assert list((tmp_path / "tests").iterdir()) == []


def test_damaged_settings_are_told(tmp_path) -> None:
    CampaignFolder(tmp_path, SETTINGS)
    (tmp_path / "settings.json").write_text("{")
    with pytest.raises(InputError, match=r"settings\.json is damaged: choose a new folder"):
        CampaignFolder(tmp_path, SETTINGS)


def test_a_quick_look_takes_its_times_from_its_tests(line, tmp_path) -> None:
    settings = replace(SETTINGS, n_tests=1, is_quick=True)
    folder = run(tmp_path, settings)
    assert list(folder.read(is_timed=True)) == []
    assert [seed for seed, _ in line.done] == [1, 1, 101, 101]
    row = write_results(folder, settings)["rows"][0]
    assert row["fps"] > 0.0
    assert "no results" in (tmp_path / "tables.md").read_text().replace("\n", " ")


def test_results_are_those_of_the_kept_files(line, tmp_path) -> None:
    content = write_results(run(tmp_path), SETTINGS)
    assert [(row["situation"], row["method"]) for row in content["rows"]] == [
        ("registration", "paper"), ("registration", "bimcc"), ("overlay", "paper"),
        ("overlay", "bimcc"),
    ]  # fmt: skip
    ours = content["rows"][3]
    assert ours["tre_mm"] == pytest.approx(0.1015)
    assert (ours["seeds"], ours["frames"]) == ([101, 102], 6)
    assert content["summary"]["tests"] == content["summary"]["of"] == 4
    assert "tests with an instrument have 90 frames" in (tmp_path / "tables.md").read_text()
    lines = (tmp_path / "frames.csv").read_text().splitlines()
    assert len(lines) == 1 + 4 * 2 * 3
    first = dict(zip(lines[0].split(","), lines[1].split(","), strict=True))
    assert (first["sample"], first["test"], first["seed"], first["method"]) == (
        "man", "0", "1", "paper",
    )  # fmt: skip
    assert float(first["tre_mm"]) == pytest.approx(0.501)
    page = (tmp_path / "report.html").read_text()
    assert page.count("data:image/jpeg") == 2, "one of each case"


def test_results_of_the_half_say_that_they_are(line, tmp_path) -> None:
    line.is_killed_at = 2
    with pytest.raises(KeyboardInterrupt):
        run(tmp_path)
    content = write_results(CampaignFolder(tmp_path, SETTINGS), SETTINGS)
    assert {row["situation"] for row in content["rows"]} == {"registration"}
    assert "1 of 4 tests" in (tmp_path / "tables.md").read_text()


def test_a_test_without_a_picture_leaves_none(line, tmp_path) -> None:
    line.has_picture = False
    write_results(run(tmp_path), SETTINGS)
    assert list((tmp_path / "pictures").iterdir()) == []
    assert "data:image/jpeg" not in (tmp_path / "report.html").read_text()
