"""What an accuracy test asks for, and the file of a divot plate."""

import json

import numpy as np
import pytest

from navapp.errors import InputError
from navapp.tools.accuracy_tasks import PLACES, find_middle_divot, make_tasks, read_divots

DIVOTS = np.array([[0.0, 0, 0], [20.0, 0, 0], [0.0, 20, 0], [20.0, 20, 0], [11.0, 9, 0]])


def test_every_place_has_three_orientations_three_axes_and_all_divots() -> None:
    tasks = make_tasks(DIVOTS)
    assert len(tasks) == len(set(tasks)) == len(PLACES) * (3 + 3 + len(DIVOTS))
    middle = [one for one in tasks if one.kind != "distance"]
    assert {one.divot for one in middle} == {4}
    assert [one.divot for one in tasks if one.place == "top" and one.kind == "distance"] == [
        0, 1, 2, 3, 4,
    ]  # fmt: skip


def test_the_middle_divot_is_the_nearest_to_the_middle() -> None:
    assert find_middle_divot(DIVOTS) == 4


def test_instructions_differ_and_name_place_and_divot() -> None:
    told = {one.instruction for one in make_tasks(DIVOTS)}
    assert len(told) == len(make_tasks(DIVOTS))
    assert "divot plate at the bottom: tip in divot 2; hold still" in told


def test_a_divot_plates_file_is_read(tmp_path) -> None:
    path = tmp_path / "plate.json"
    path.write_text(json.dumps({"points_mm": DIVOTS.tolist()}), encoding="utf-8")
    np.testing.assert_array_equal(read_divots(path), DIVOTS)


@pytest.mark.parametrize(
    "content",
    [
        "no json",
        "{}",
        '{"points_mm": [[0, 0, 0], [9, 0, 0]]}',
        '{"points_mm": [[0, 0], [9, 0], [0, 9]]}',
        '{"points_mm": [[0, 0, 0], [1, 0, 0], [0, 9, 0]]}',
        '{"points_mm": [[0, 0, 0], [NaN, 0, 0], [0, 9, 0]]}',
        "[[0, 0, 0]]",
    ],
)
def test_a_file_that_is_no_divot_plate_is_refused(tmp_path, content) -> None:
    path = tmp_path / "plate.json"
    path.write_text(content, encoding="utf-8")
    with pytest.raises(InputError, match=r"plate\.json"):
        read_divots(path)


def test_a_missing_file_is_refused() -> None:
    with pytest.raises(InputError, match="cannot be read"):
        read_divots("nowhere.json")
