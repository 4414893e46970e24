"""The axes of the stress matrix: a table that can be run, with knees of its own."""

import re

import pytest

from navapp.config import SimulationSection
from navapp.devices.simulated_room import make_sensor, make_world
from navapp.evaluation.paper.cases import ALL_CASES, FIRST_SEED, MOST_TESTS
from navapp.evaluation.stress.axes import (
    AXES,
    FIRST_STRESS_SEED,
    MOST_KNEES,
    find_seed,
    is_moving_fully,
)
from navapp.evaluation.stress.matrix import StressTest
from sim_devices.drift import compute_drift_mm

EACH = [pytest.param(axis, id=name) for name, axis in AXES.items()]


def test_what_is_asked_for_is_there() -> None:
    causes = {name for name, axis in AXES.items() if axis.is_cause}
    named = {"turn-sideways", "baseline-length", "time-offset", "thickness", "scale", "shift"}
    # Other names of a sideways turn and of the baseline's length.
    alike = {"left-cx", "right-cx", "left-fx", "right-fx", "focal"}
    assert causes == named | alike
    pictures = ("light", "noise", "defocus", "blur", "shutter", "shake", "highlights", "blood",
                "covered", "distance", "baseline")  # fmt: skip
    numbers = [f"{eye}-{number}" for eye in ("left", "right") for number in
               ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3")]  # fmt: skip
    rest = ("turn-upwards", "roll", "place-y", "place-z", "shift", "cartilage", "skew")
    assert {*pictures, *numbers, *rest} <= set(AXES)


@pytest.mark.parametrize("axis", EACH)
def test_an_axis_has_rising_levels_and_the_usual_one_among_them(axis) -> None:
    assert list(axis.levels) == sorted(set(axis.levels))
    assert axis.usual in axis.levels
    assert len(axis.levels) >= 4
    assert AXES[axis.name] is axis
    assert re.fullmatch(r"[a-z0-9-]+", axis.name)
    names = [StressTest(axis.name, level, 0, 1).name for level in axis.levels]
    assert len(set(names)) == len(names)
    assert axis.title
    assert axis.found_by


@pytest.mark.parametrize("axis", EACH)
def test_every_level_is_a_room_that_can_be_simulated(axis) -> None:
    for level in axis.levels:
        configuration = StressTest(axis.name, level, 1, 1).configure()
        simulated = configuration.camera.simulated
        assert (simulated.motion, simulated.stepped, simulated.side) == ("breathing", True, "left")
        make_sensor(simulated)
    # The rolling shutter is what a rate may not allow; the room is slow to make.
    if simulated.shutter_ms:
        make_world(simulated, configuration.camera.rate_hz)


@pytest.mark.parametrize(
    "axis", [one for one in EACH if not (one.values[0].rig or one.values[0].plan)]
)
def test_a_level_of_the_pictures_changes_one_key_and_the_usual_one_none(axis) -> None:
    usual = StressTest(axis.name, axis.usual, 0, 1).configure().camera.simulated
    for level in axis.levels:
        simulated = StressTest(axis.name, level, 0, 1).configure().camera.simulated
        changed = {
            key for key, value in simulated.model_dump().items() if value != getattr(usual, key)
        }
        assert len(changed) == (level != axis.usual), (level, changed)
        if level != axis.usual:
            (key,) = changed
            assert getattr(usual, key) == getattr(SimulationSection(), key)


def test_only_levels_beyond_the_usual_one_are_hidden_and_no_further_than_told() -> None:
    hidden = [level for level in AXES["scale"].levels if AXES["scale"].is_hidden(level)]
    assert hidden == [-2.0, -1.0, -0.5, 0.5, 1.0, 2.0]
    assert not any(AXES["light"].is_hidden(level) for level in AXES["light"].levels)
    sideways = AXES["turn-sideways"]
    assert [sideways.is_hidden(level) for level in sideways.levels] == [False, *[True] * 5]


def test_the_matrix_has_seeds_of_its_own() -> None:
    seeds = [
        find_seed(axis, knee, FIRST_STRESS_SEED)
        for axis in AXES.values()
        for knee in range(MOST_KNEES)
    ]
    assert len(set(seeds)) == len(seeds)
    assert min(seeds) == FIRST_STRESS_SEED == FIRST_SEED + len(ALL_CASES) * MOST_TESTS


def test_motion_blur_is_what_the_level_says_where_frames_count() -> None:
    for level in (1.5, 3.0, 6.0):
        axis = AXES["blur"]
        test = StressTest("blur", level, 0, 1)
        speed_mm_s = axis.drift_mm_s(level)
        # Speed, exposure, focal length over depth.
        assert speed_mm_s * 0.008 * 1403.0 / 450.0 == pytest.approx(level, rel=0.01)
        counted = [index for index in range(60) if test.counts(index)]
        assert 10 < len(counted) < 55
        for index in counted:
            time_s = index / axis.rate_hz
            way_mm = compute_drift_mm(speed_mm_s, time_s + 0.004)
            way_mm -= compute_drift_mm(speed_mm_s, time_s - 0.004)
            assert abs(way_mm) > 0.85 * speed_mm_s * 0.008
    assert not is_moving_fully(AXES["blur"], 3.0, 0.1)
    assert is_moving_fully(AXES["blur"], 0.0, 0.1)
    assert is_moving_fully(AXES["light"], 0.5, 0.0)
