"""Rows of the stress matrix, and where an axis ends."""

import pytest

from navapp.evaluation.stress.axes import AXES
from navapp.evaluation.stress.bars import check_blur
from navapp.evaluation.stress.rows import list_counted, make_axis_rows
from tests.evaluation.scored import score
from tests.evaluation.stressed import stressed

LOST = score(None, "LOST", bound_mm=None)


def frames(tre_mm: float, n_ok: int = 10, n_lost: int = 0):
    return [score(tre_mm)] * n_ok + [LOST] * n_lost


def test_a_row_pools_the_knees_of_its_level() -> None:
    doubted = score(3.0, "DEGRADED", reasons=("dark", "blurred"))
    done = stressed(
        "light", {1.0: [[score(0.1), score(0.2), doubted], [score(0.6), doubted, LOST]]}
    )
    (row,) = make_axis_rows(AXES["light"], done).rows
    assert (row.level, row.n_knees, row.figures.n_frames, row.figures.n_ok) == (1.0, 2, 6, 3)
    assert row.ok_share == 0.5
    assert (row.tre_mm, row.worst_mm) == (0.2, 0.6)
    assert row.tre_any_mm == 0.6, "median of 0.1, 0.2, 0.6, 3 and 3"
    # The bound of these scores is 0.5 mm.
    assert row.figures.bound_coverage == pytest.approx(2.0 / 3.0)
    assert row.every.n_wrong == 0
    assert (row.reason, row.reason_share) == ("dark", pytest.approx(2.0 / 3.0))
    assert row.to_json()["ok_share"] == 0.5


def test_wrong_frames_count_where_pictures_can_show_them() -> None:
    levels = {0.0: [frames(0.1)], 2.0: [frames(1.2)], 5.0: [frames(1.3, 4)]}
    rows = make_axis_rows(AXES["scale"], stressed("scale", levels))
    assert [row.every.n_wrong for row in rows.rows] == [0, 10, 4]
    assert [row.is_hidden for row in rows.rows] == [False, True, False]
    assert (rows.n_wrong, rows.n_wrong_hidden) == (4, 10)


def test_a_level_without_a_pose_has_no_figures() -> None:
    (row,) = make_axis_rows(AXES["light"], stressed("light", {1.0: [[LOST]]})).rows
    assert (row.tre_mm, row.worst_mm, row.tre_any_mm, row.figures.bound_coverage) == (None,) * 4
    no_reason = score(None, "LOST", reasons=(), seen=None)
    (row,) = make_axis_rows(AXES["light"], stressed("light", {1.0: [[no_reason]]})).rows
    assert row.reason == "no pose"


def test_an_axis_ends_on_both_sides_of_the_usual_level() -> None:
    levels = {
        0.02: [frames(0.1, 2, 8)], 0.1: [frames(0.1, 6, 4)], 0.5: [frames(0.1)],
        1.0: [frames(0.1)], 2.0: [frames(0.1, 9, 1)], 4.0: [frames(0.1, 8, 2)],
        8.0: [frames(0.1)],
    }  # fmt: skip
    rows = make_axis_rows(AXES["light"], stressed("light", levels))
    assert rows.find_kept() == [0.5, 2.0], "what is OK again beyond a gap is not kept"
    assert rows.find_ends() == [0.02, None]
    assert rows.to_json()["ok_ends_at"] == [0.02, None]


def test_an_axis_of_one_side_has_one_end() -> None:
    levels = {0.0: [frames(0.1)], 0.3: [frames(0.1, 4, 6)], 0.6: [frames(0.1, 1, 9)]}
    rows = make_axis_rows(AXES["covered"], stressed("covered", levels))
    assert (rows.find_kept(), rows.find_ends()) == ([0.0], [0.3])


def test_where_a_millimetre_is_passed_is_between_two_levels() -> None:
    levels = {-2.0: [frames(0.6)], -0.5: [frames(0.2)], 0.0: [frames(0.1)], 1.0: [frames(0.4)],
              2.0: [frames(1.6)]}  # fmt: skip
    rows = make_axis_rows(AXES["scale"], stressed("scale", levels))
    below, above = rows.find_passed()
    assert below is None
    assert above == pytest.approx(1.5)
    wrong = make_axis_rows(AXES["scale"], stressed("scale", {0.0: [frames(1.5)], 1.0: [frames(2)]}))
    assert wrong.find_passed() == [0.0]


def test_only_frames_that_show_the_level_count() -> None:
    # At rest until 0.2 s, 30 frames a second.
    scores = [score(0.1 * index, index=index) for index in (1, 5, 9, 10, 11)]
    (done,) = stressed("blur", {1.5: [scores]})
    assert [frame.index for frame in list_counted(done)] == [9, 10, 11]
    (row,) = make_axis_rows(AXES["blur"], [done]).rows
    assert (row.figures.n_frames, row.tre_mm) == (3, pytest.approx(1.0))


def test_a_wrong_frame_counts_wherever_the_leg_is() -> None:
    # At rest until 0.2 s: nothing of the level is shown in the first.
    scores = [score(5.0, index=1), score(0.1, index=9), score(0.2, index=10)]
    (row,) = make_axis_rows(AXES["blur"], stressed("blur", {1.5: [scores]})).rows
    assert row.ok_share == row.figures.bound_coverage == 1.0
    assert (row.every.n_wrong, row.worst_mm) == (1, 5.0)


def moving(tre_mm: float, **changes):
    return [score(tre_mm, index=index, **changes) for index in (9, 10, 11)]


@pytest.mark.parametrize(
    ("scores", "missed"),
    [
        (moving(0.1), ()),
        (moving(0.2), ("TRE median 0.15 mm",)),
        ([*moving(0.1), score(0.45, index=12)], ("worst OK frame 0.4 mm",)),
        (moving(0.1, bound_mm=0.05), ("bound holds in 90%",)),
        ([*moving(0.1), score(0.1, "LOST", index=12)], ("OK in 90% of the frames",)),
        (moving(0.1, status="LOST"), ("no frame is OK",)),
    ],
)
def test_motion_blur_is_held_to_its_limits(scores, missed) -> None:
    axes = [
        make_axis_rows(AXES["blur"], stressed("blur", {1.5: [scores], 6.0: [moving(9.0)]})),
        make_axis_rows(AXES["shake"], stressed("shake", {1.0: [moving(9.0)]})),
    ]
    (held,) = check_blur(axes)
    assert held.missed == missed
    assert held.title == "motion blur, 1.5 px"
