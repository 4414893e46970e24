"""Tables, report and files of the stress matrix."""

import csv

import pytest

from navapp.evaluation.campaign import CampaignFolder, Done
from navapp.evaluation.stress.matrix import StressSettings
from navapp.evaluation.stress.results import write_stress
from tests.evaluation.scored import followed, score

SETTINGS = StressSettings(("scale", "light"), 1, 2, 1)
WRONG = [score(1.5, index=1), score(1.6, index=2)]
GOOD = [score(0.1, index=1), score(0.2, index=2)]
DARK = [score(0.1, "LOST", index=1, reasons=("one picture is dark",)), score(0.3, index=2)]


def keep(folder: CampaignFolder, frames_of) -> None:
    for test in SETTINGS.tests:
        frames = frames_of(test)
        if frames is not None:
            folder.write(Done(test, {"bimcc": followed(*frames)}), is_timed=False)


def frames_of(test):
    if test.axis_name == "scale":
        return WRONG if abs(test.level) >= 2.0 else GOOD
    return DARK if test.level <= 0.1 else WRONG if test.level == 8.0 else GOOD


@pytest.fixture
def written(tmp_path):
    folder = CampaignFolder(tmp_path, SETTINGS)
    keep(folder, frames_of)
    return tmp_path, write_stress(folder, SETTINGS)


def test_the_causes_stand_first_and_their_hidden_levels_do_not_count(written) -> None:
    path, content = written
    assert [one["axis"] for one in content["axes"]] == ["scale", "light"]
    scale, light = content["axes"]
    assert scale["is_cause"]
    assert not light["is_cause"]
    # -2 and 2 % are hidden, -5 and 5 % are not.
    assert (scale["wrong_and_ok"], light["wrong_and_ok"]) == (4, 2)
    assert scale["wrong_and_ok_hidden"] == 4
    assert content["summary"]["judged"]["wrong_and_ok"] == 6
    assert content["summary"]["wrong_and_ok_on"] == ["scale", "light"]
    assert scale["one_mm_passed_at"] == [
        pytest.approx(-1.607, abs=0.01),
        pytest.approx(1.607, abs=0.01),
    ]
    text = (path / "stress.md").read_text()
    headings = [line for line in text.splitlines() if line.startswith("#")]
    assert headings == [
        "# Stress matrix on simulated knees", "## What it cannot notice", "### scale of the plan",
        "## Where OK ends", "## OK and wrong", "### light on the sensors",
    ]  # fmt: skip
    assert "| scale of the plan, % | 1.55 at -5; 1.55 at -2; 0.15 at -1; " in text
    assert "; 1.55 at 5 | -1.61 % and 1.61 % | - | the check on the patient |" in text
    assert "| 2 (hidden) | 100 % | 1.55 | 1.60 | 1.55 | 2 | 0 % | - |" in text


def test_where_ok_ends_stands_with_its_reason(written) -> None:
    path, content = written
    light = content["axes"][1]
    assert light["ok_kept_up_to"] == [0.2, 8.0]
    assert light["ok_ends_at"] == [None, None], "half of the frames are OK"
    text = (path / "stress.md").read_text()
    assert "| 0.1 | 50 % | 0.30 | 0.30 | 0.20 | 0 | 100 % | one picture is dark (100 %) |" in text
    assert "- light on the sensors: 2, at 8 times; found by the judge, in the pictures" in text
    assert "- at levels that pictures cannot show, not counted above: scale 4" in text


def test_every_frame_is_in_the_csv_and_the_report_needs_nothing_else(written) -> None:
    path, _ = written
    rows = list(csv.DictReader((path / "frames.csv").read_text().splitlines()))
    assert len(rows) == 2 * len(SETTINGS.tests)
    first = rows[0]
    assert (first["axis"], first["level"], first["seed"], first["counts"]) == (
        "scale", "-5", str(SETTINGS.tests[0].seed), "True",
    )  # fmt: skip
    page = (path / "report.html").read_text()
    assert page.count("<svg") == 2
    assert "http://" not in page.replace("http://www.w3.org", "")


def test_what_is_missing_is_left_out_and_told(tmp_path) -> None:
    folder = CampaignFolder(tmp_path, SETTINGS)
    keep(folder, lambda test: GOOD if test.axis_name == "light" and test.level == 1.0 else None)
    content = write_stress(folder, SETTINGS)
    (light,) = content["axes"]
    assert [row["level"] for row in light["levels"]] == [1.0]
    text = (tmp_path / "stress.md").read_text()
    assert "1 of 18 sequences" in text
    assert "What it cannot notice" not in text


def test_a_quick_look_says_so(tmp_path) -> None:
    quick = StressSettings(("light",), 1, 3, 1, is_quick=True)
    content = write_stress(CampaignFolder(tmp_path, quick), quick)
    assert content["summary"]["quick"]
    assert "no results" in (tmp_path / "stress.md").read_text()


def test_a_large_level_is_told_without_an_exponent(tmp_path) -> None:
    settings = StressSettings(("noise",), 1, 2, 1)
    folder = CampaignFolder(tmp_path, settings)
    for test in settings.tests:
        folder.write(Done(test, {"bimcc": followed(*GOOD)}), is_timed=False)
    write_stress(folder, settings)
    assert "| 20000 e | 100 e | - |" in (tmp_path / "stress.md").read_text()
