"""Figures of an accuracy test against numbers by hand, and its report."""

import numpy as np
import pytest

from navapp.control.accuracy_test.states import TakenTip
from navapp.evaluation.accuracy_test.figures import (
    find_length_errors,
    measure_all,
    measure_lengths,
    measure_scatter,
)
from navapp.evaluation.accuracy_test.report import write_localisation_report
from navapp.geometry.transform import rotation_from_vector
from navapp.tools.accuracy_tasks import AXES, Task

DIVOTS = np.array([[0.0, 0, 0], [30.0, 0, 0], [0.0, 40.0, 0]])


def tips(kind, number: int, *places: tuple[float, float, float], place="centre") -> list[TakenTip]:
    task = Task(place, kind, number, number if kind == "distance" else 0)
    return [TakenTip(task, np.array(one), 0.2, 5) for one in places]


def test_scatter_of_four_corners() -> None:
    found = measure_scatter(np.array([[1.0, 1, 0], [-1.0, 1, 0], [1.0, -1, 0], [-1.0, -1, 0]]))
    assert found.n == 4
    assert found.mean_mm == found.rms_mm == found.max_mm == pytest.approx(2.0**0.5)
    assert found.span_mm == pytest.approx(8.0**0.5)
    assert measure_scatter(np.zeros((1, 3))) is None


def test_scatter_of_lengths_keeps_the_sign_of_the_mean() -> None:
    found = measure_lengths(np.array([-0.3, 0.1]))
    assert found.mean_mm == pytest.approx(-0.1)
    assert found.span_mm == pytest.approx(0.4)
    assert found.rms_mm == pytest.approx(0.05**0.5)
    assert found.max_mm == pytest.approx(0.3)
    assert measure_lengths(np.empty(0)) is None


def test_distances_do_not_depend_on_where_the_plate_lies() -> None:
    turn = rotation_from_vector((0.3, -0.2, 0.9))
    placed = DIVOTS @ turn.T + (10.0, 20.0, 400.0)
    taken = [one for k in range(3) for one in tips("distance", k, placed[k])]
    np.testing.assert_allclose(find_length_errors(taken, DIVOTS), 0.0, atol=1e-12)
    # 0 to 1 and 0 to 2 and 1 to 2; the second divot 0.3 mm further along x.
    taken[1] = tips("distance", 1, placed[1] + turn @ (0.3, 0.0, 0.0))[0]
    errors = find_length_errors(taken, DIVOTS)
    np.testing.assert_allclose(errors[:2], [0.3, 0.0], atol=1e-9)
    assert errors[2] == pytest.approx((30.3**2 + 40.0**2) ** 0.5 - 50.0)


def test_tips_of_one_divot_are_averaged_first() -> None:
    taken = [
        *tips("distance", 0, (0.0, 0.1, 0), (0.0, -0.1, 0)),
        *tips("distance", 1, (30.0, 0, 0)),
    ]
    np.testing.assert_allclose(find_length_errors(taken, DIVOTS), [0.0], atol=1e-12)


def test_orientations_and_rotations_are_told_apart() -> None:
    taken = [
        *tips("point", 0, (0.0, 0, 0), (0.0, 0, 0)),
        *tips("point", 1, (0.2, 0, 0)),
        *tips("rotation", 2, (0.0, 0, 0), (0.0, 0, 0.4)),
    ]
    figures, distances = measure_all(taken, DIVOTS)
    assert distances is None
    centre = figures["centre"]
    assert centre.point.span_mm == pytest.approx(0.2)
    assert centre.rotations[AXES[2]].max_mm == pytest.approx(0.2)
    assert centre.rotations[AXES[0]] is None


def test_the_report_says_what_was_not_taken_and_claims_nothing(tmp_path) -> None:
    taken = [
        *tips("distance", 0, (0.0, 0, 0)),
        *tips("distance", 1, (30.1, 0, 0)),
        *tips("point", 0, (0.0, 0, 0), place="<top>"),
    ]
    figures, distances = measure_all(taken, DIVOTS)
    path = tmp_path / "report.html"
    write_localisation_report(path, taken, figures, distances, DIVOTS, {"rig": "a & b"})
    page = path.read_text(encoding="utf-8")
    for words in ("conformity is not claimed", "not for clinical use", "0.100", "&lt;top&gt;",
                  "a &amp; b", "<td>-</td>", "<svg"):  # fmt: skip
        assert words in page, words
    assert "Against the truth" not in page
