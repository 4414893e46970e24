"""The paper's figures, read again from its tables 1 to 3."""

import numpy as np
import pytest

from navapp.evaluation.paper.cases import ALL_CASES, SAMPLES, Case
from navapp.evaluation.paper.published import CONTRADICTIONS, Published, find_published

# Of its state of the art mm, fps; of its proposal mm, fps.
ROWS = {
    ("man", "opening", "registration"): (0.65, 7, 0.52, 15),
    ("man", "drilling", "patient"): (0.60, 10, 0.37, 11),
    ("man", "implant", "instrument"): (0.79, 15, 0.58, 19),
    ("man", "patella", "registration"): (0.58, 4, 0.51, 5),
    ("man", "spacer", "instrument"): (0.71, 12, 0.58, 16),
    ("woman", "opening", "registration"): (0.69, 8, 0.49, 10),
    ("woman", "drilling", "patient"): (0.69, 10, 0.68, 11),
    ("woman", "implant", "instrument"): (0.80, 16, 0.68, 19),
    ("woman", "patella", "overlay"): (0.72, 13, 0.66, 12),
    ("woman", "spacer", "registration"): (0.94, 6, 0.73, 8),
    ("adult", "opening", "overlay"): (0.44, 10, 0.42, 11),
    ("adult", "implant", "patient"): (0.84, 11, 0.79, 15),
    ("adult", "patella", "patient"): (0.64, 7, 0.61, 8),
    ("adult", "spacer", "registration"): (0.93, 7, 0.82, 8),
    ("adult", "spacer", "instrument"): (0.76, 11, 0.53, 15),
}
# Sums of the four columns of each table.
SUMS = {
    "man": (13.62, 189, 11.25, 225),
    "woman": (13.69, 192, 12.06, 219),
    "adult": (13.80, 191, 11.96, 233),
}


@pytest.mark.parametrize("names", ROWS)
def test_rows_are_as_printed(names) -> None:
    assert find_published(Case(*names)) == Published(*ROWS[names])


@pytest.mark.parametrize("sample", SAMPLES)
def test_columns_have_the_sums_of_the_printed_ones(sample) -> None:
    told = [find_published(case) for case in ALL_CASES if case.sample == sample]
    columns = np.sum([(a.icp_mm, a.icp_fps, a.paper_mm, a.paper_fps) for a in told], axis=0)
    assert len(told) == 20
    assert columns == pytest.approx(SUMS[sample])


def test_the_proposal_is_the_faster_one_in_most_rows_as_is_said() -> None:
    told = [find_published(case) for case in ALL_CASES]
    assert sum(row.paper_fps > row.icp_fps for row in told) == 48
    assert sum(row.paper_fps < row.icp_fps for row in told) == 7
    assert all(row.paper_mm < row.icp_mm for row in told)
    (words,) = [one for one in CONTRADICTIONS if "faster in 48 of 60 rows and slower in 7" in one]
    assert "7.4 to 11.74" in words
    assert "9.4 to 13.94" in words


def test_the_other_contradictions_hold_against_the_tables() -> None:
    patients = {(case.sample, case.stage) for case in ALL_CASES}
    assert len(patients) == 15
    assert any("list 15" in one and "17 patients" in one for one in CONTRADICTIONS)
    for words in ("table 6", "'Sample 1'", "no formula", "0.56 to 0.67 mm"):
        assert any(words in one for one in CONTRADICTIONS), words
