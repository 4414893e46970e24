"""Tables of poses."""

import numpy as np
import pytest

from navapp.geometry.pose_tables import parse_pose_table

MATRIX = ",".join(str(number) for number in range(16))


def test_what_stands_before_a_matrix_is_kept_and_a_heading_is_not() -> None:
    rows = parse_pose_table(f"index,body,m00\n\n 3, femur,{MATRIX}\n4,tibia,{MATRIX}\n")
    assert [words for words, _ in rows] == [["3", "femur"], ["4", "tibia"]]
    assert np.array_equal(rows[0][1], np.arange(16.0).reshape(4, 4))


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("time_ns\n", "it holds no poses"),
        ("1,2,3\n", "pose 0 has 3 columns"),
        (f"1,{MATRIX}\n2,femur,{MATRIX}\n", "pose 1 has 18 columns, the first has 17"),
        (f"1,x{MATRIX}\n", "could not convert"),
    ],
)
def test_what_is_no_table_says_why(text: str, why: str) -> None:
    with pytest.raises(ValueError, match=why):
        parse_pose_table(text)
