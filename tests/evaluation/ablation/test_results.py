"""Tables, report and files of an ablation."""

import csv

import pytest

from navapp.evaluation.ablation.results import write_ablation
from navapp.evaluation.campaign import CampaignFolder, Done
from navapp.evaluation.methods import VARIANTS
from navapp.evaluation.paper.cases import Case
from navapp.evaluation.paper.settings import TableSettings
from tests.evaluation.scored import followed, score

CASES = (Case("man", "opening", "overlay"), Case("man", "patella", "instrument"))
SETTINGS = TableSettings(CASES, tuple(VARIANTS), 1, 2, 1)
GOOD = followed(score(0.1, index=1), score(0.2, index=2))


def keep(folder: CampaignFolder, n_tests: int = 2) -> None:
    for test in SETTINGS.tests[:n_tests]:
        for is_timed in (False, True):
            folder.write(Done(test, dict.fromkeys(VARIANTS, GOOD)), is_timed=is_timed)


@pytest.fixture
def written(tmp_path):
    folder = CampaignFolder(tmp_path, SETTINGS)
    keep(folder)
    return tmp_path, write_ablation(folder, SETTINGS)


def test_every_stage_and_situation_has_a_row_and_a_table_of_all_variants(written) -> None:
    path, content = written
    assert len(content["rows"]) == 2 * len(VARIANTS)
    assert [row["variant"] for row in content["summary"]["variants"]] == list(VARIANTS)
    assert (content["summary"]["tests"], content["summary"]["of"]) == (2, 2)
    text = (path / "ablation.md").read_text()
    headings = [line for line in text.splitlines() if line.startswith("#")]
    assert headings == [
        "# What each part is worth, on simulated knees", "## All stages and situations",
        "## Stage opening, image overlay: the leg breathes",
        "## Stage patella, an instrument moves, the leg breathes",
    ]  # fmt: skip


def test_every_frame_is_in_the_csv_and_the_report_needs_nothing_else(written) -> None:
    path, _ = written
    rows = list(csv.DictReader((path / "frames.csv").read_text().splitlines()))
    assert len(rows) == 2 * len(VARIANTS) * 2
    assert (rows[0]["stage"], rows[0]["seed"], rows[0]["variant"], rows[0]["tre_mm"]) == (
        "opening", str(SETTINGS.tests[0].seed), "bimcc", "0.1",
    )  # fmt: skip
    page = (path / "report.html").read_text()
    assert page.count("<svg") == 1
    assert "http://" not in page.replace("http://www.w3.org", "")


def test_tests_that_are_not_done_are_left_out_and_counted(tmp_path) -> None:
    folder = CampaignFolder(tmp_path, SETTINGS)
    assert write_ablation(folder, SETTINGS)["rows"] == []
    assert "0 of 2 tests" in (tmp_path / "ablation.md").read_text()
    keep(folder, 1)
    content = write_ablation(folder, SETTINGS)
    assert {row["stage"] for row in content["rows"]} == {"opening"}
    text = (tmp_path / "ablation.md").read_text()
    assert "1 of 2 tests" in text
    assert "2 frames each after the registration (with an instrument at least 90, but" in text


def test_a_quick_look_says_so_and_has_the_times_of_its_tests(tmp_path) -> None:
    quick = TableSettings(CASES, tuple(VARIANTS), 1, 2, 1, is_quick=True)
    folder = CampaignFolder(tmp_path, quick)
    keep(folder)
    for test in quick.tests:
        folder.file_of(test, is_timed=True).unlink()
    content = write_ablation(folder, quick)
    assert content["summary"]["quick"]
    assert content["rows"][0]["median_ms"] == 20.0
    text = (tmp_path / "ablation.md").read_text()
    assert "no results" in text
