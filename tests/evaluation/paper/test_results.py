"""The files of a campaign: the judge's part of them comes from our method's frames alone."""

import csv
import json

import pytest

from navapp.evaluation.campaign import CampaignFolder, Done
from navapp.evaluation.paper.cases import Case
from navapp.evaluation.paper.results import write_results
from navapp.evaluation.paper.settings import TableSettings
from navapp.evaluation.scores import ErrorBudget
from tests.evaluation.scored import followed, score

CLAIMED = (0.05, 0.1, 0.2, 0.4)
OURS = followed(
    score(0.15, claimed_mm=CLAIMED, bound_mm=0.2, budget=ErrorBudget(0.01, 0.02, 0.1, 0.12)),
    score(3.0, "LOST", claimed_mm=CLAIMED, bound_mm=5.0),
)
THEIRS = followed(score(9.0, "LOST", claimed_mm=CLAIMED), score(9.0))


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """A folder of two tests in two situations, and what a program gets of it."""
    cases = (Case("man", "opening", "overlay"), Case("man", "opening", "patient"))
    settings = TableSettings(cases, ("icp", "bimcc"), 1, 2, 7)
    folder = CampaignFolder(tmp_path_factory.mktemp("results") / "out", settings)
    for test in settings.tests:
        for is_timed in (False, True):
            folder.write(Done(test, {"icp": THEIRS, "bimcc": OURS}), is_timed=is_timed)
    return folder.path, write_results(folder, settings)


def test_programs_get_the_judge_and_the_limit(written) -> None:
    summary = json.loads(json.dumps(written[1]["summary"], allow_nan=False))
    rejector = summary["judge"]["rejector"]
    assert rejector["frames"] == 4, "of bimcc, not of icp"
    assert rejector["by"]["bound"]["auc"] == 1.0
    assert rejector["operating_point"]["n_wrong"] == 2
    assert [one["observed"] for one in summary["judge"]["reliability"]] == [0, 0, 1, 1]
    assert set(summary["noise_limit"]) == {"overlay", "patient"}
    assert summary["noise_limit"]["overlay"]["efficiency"] == pytest.approx(1.0 / 144.0)


def test_people_read_it_in_the_tables_and_in_the_report(written) -> None:
    folder, _ = written
    tables = (folder / "tables.md").read_text()
    places = [tables.index(f"## {name}") for name in (
        "The judge\n", "The judge as a rejector", "How often the bound holds", "Noise limit",
        "Where the paper contradicts itself",
    )]  # fmt: skip
    assert places == sorted(places)
    report = (folder / "report.html").read_text()
    for words in ("<h2>Noise limit</h2>", "<h2>Error against rejection</h2>"):
        assert words in report, words


def test_charts_are_files_of_their_own(written) -> None:
    stages, errors = ((written[0] / name).read_text() for name in ("stages.svg", "errors.svg"))
    for words in ("TRE of OK frames", "registration", "patient moves", "instrument moves"):
        assert words in stages, words
    assert "overlay error" in errors
    # Two situations of one stage were run: of four other stages and two situations there is none.
    assert stages.count(">none<") == 2 * (5 * 4 - 2)
    assert all(one.startswith("<svg") for one in (stages, errors))


def test_every_frame_has_its_bounds_and_its_budget(written) -> None:
    with (written[0] / "frames.csv").open() as file:
        rows = [row for row in csv.DictReader(file) if row["method"] == "bimcc"]
    assert len(rows) == 4
    first, second = rows[:2]
    names = ("claimed_50_mm", "claimed_80_mm", "claimed_95_mm", "claimed_99_mm")
    assert [float(first[name]) for name in names] == list(CLAIMED)
    told = [first[name] for name in ("limit_mm", "ideal_mm", "matched_mm", "reached_mm")]
    assert [float(one) for one in told] == [0.01, 0.02, 0.1, 0.12]
    assert second["limit_mm"] == ""
    assert second["reasons"] == "doubted"
