"""Tests of the stress matrix: what they show, and what the session is given."""

from dataclasses import replace
from itertools import groupby

import numpy as np
import pytest

from navapp.evaluation.stress import matrix as stress_matrix
from navapp.evaluation.stress.axes import AXES
from navapp.evaluation.stress.matrix import StressSettings, StressTest

SETTINGS = StressSettings(("shift", "blood"), 2, 3, 1)


def test_every_level_has_the_same_knees() -> None:
    tests = SETTINGS.tests
    assert len(tests) == 2 * (5 + 4)
    assert len({test.name for test in tests}) == len(tests)
    for name in SETTINGS.axes:
        of_axis = [test for test in tests if test.axis_name == name]
        assert {test.level for test in of_axis} == set(AXES[name].levels)
        knees = {(test.knee, test.seed) for test in of_axis}
        assert len(knees) == 2
        assert len({seed for _, seed in knees}) == 2


def test_an_axis_keeps_its_knees_whatever_else_is_run() -> None:
    alone = replace(SETTINGS, axes=("blood",), n_knees=4).tests
    seeds = {test.name: test.seed for test in alone}
    assert all(seeds[test.name] == test.seed for test in SETTINGS.tests if test.name in seeds)


def test_knees_are_left_and_right_of_women_and_men() -> None:
    simulated = [StressTest("light", 1.0, n, n).configure().camera.simulated for n in range(4)]
    assert [one.side for one in simulated] == ["right", "left", "right", "left"]
    assert [one.sex for one in simulated] == ["male", "male", "female", "female"]


def test_levels_that_are_seen_in_the_same_pictures_stand_together() -> None:
    configured = [test.configure() for test in SETTINGS.tests]
    # A plan is shifted five times before each of two knees; blood is on the bone itself.
    assert [len(list(some)) for _, some in groupby(configured)] == [5, 5] + 8 * [1]


def test_other_levels_are_another_matrix(monkeypatch) -> None:
    before = SETTINGS.to_json()
    changed = replace(AXES["blood"], levels=(0.0, 0.3))
    monkeypatch.setitem(AXES, "blood", changed)
    assert SETTINGS.to_json() != before
    assert before["stress"] == {"shift": [0.0, 0.25, 0.5, 1.0, 2.0], "blood": [0.0, 0.3, 0.6, 1.0]}


@pytest.fixture(autouse=True)
def _forget_pictures():
    stress_matrix._render.cache_clear()
    yield
    stress_matrix._render.cache_clear()


@pytest.fixture
def rendered(monkeypatch) -> list[int]:
    """How many pictures were made each time."""
    made = []
    render = stress_matrix.render_room

    def count(configuration, stage, n_frames):
        made.append(n_frames)
        return render(configuration, stage, n_frames)

    monkeypatch.setattr(stress_matrix, "render_room", count)
    return made


def test_levels_of_a_plan_share_their_pictures_and_nothing_else(rendered) -> None:
    usual, shifted = (StressTest("shift", level, 0, 1).render(1) for level in (0.0, 1.0))
    assert rendered == [2]
    assert shifted.frames is usual.frames
    assert shifted.rig is usual.rig
    before, after = (one.plan.bones["femur"].mesh.vertices_mm for one in (usual, shifted))
    np.testing.assert_allclose(np.linalg.norm(after - before, axis=1), 1.0)
    np.testing.assert_array_equal(shifted.true_targets_mm, usual.true_targets_mm)
    assert len(shifted.true_targets_mm) == 3


def test_a_rig_that_is_given_wrongly_did_not_take_the_pictures() -> None:
    usual, turned = (StressTest("turn-sideways", level, 0, 1).render(1) for level in (0.0, 0.03))
    assert turned.frames is usual.frames
    assert turned.rig.rig_id != usual.rig.rig_id
    assert turned.plan.digest == usual.plan.digest
    np.testing.assert_array_equal(turned.truth[1].matrix, usual.truth[1].matrix)


def test_the_plan_of_a_misjudged_thickness_knows_where_cartilage_is() -> None:
    planned = StressTest("thickness", 0.4, 0, 1).render(1).plan.bones["femur"]
    covered = planned.cartilage_mm > 0.0
    assert 0.05 < covered.mean() < 0.8
    assert planned.cartilage_mm[covered].mean() == pytest.approx(2.2, abs=0.4)
    assert set(planned.cartilage_sd_mm) == {0.0, 0.4}
    unknown = StressTest("cartilage", 2.0, 0, 1)
    assert unknown.configure().camera.simulated.cartilage_mm == 2.0
    assert unknown.axis.plan is None


def test_pictures_are_taken_until_enough_of_them_count(rendered, monkeypatch) -> None:
    monkeypatch.setattr(stress_matrix, "find_cartilage_mm", lambda *_: np.zeros(1))
    monkeypatch.setattr(stress_matrix, "render_room", lambda *given: rendered.append(given[2]))
    test = StressTest("blur", 3.0, 0, 1)
    with pytest.raises(AttributeError):
        test.render(4)
    (n_frames,) = rendered
    assert sum(test.counts(index) for index in range(n_frames)) == 4
    assert test.counts(n_frames - 1)
    assert not StressTest("light", 1.0, 0, 1).counts(0), "the bone is registered in it"
