import numpy as np
import pytest

from sim_devices.drift import REST_S, START_S, STRAIGHT_MM, TURN_S, compute_drift_mm

STEP_S = 1e-3
TIMES_S = np.arange(0.0, 4.0, STEP_S)


def places_mm(speed_mm_s):
    return np.array([compute_drift_mm(speed_mm_s, t) for t in TIMES_S])


def test_it_lies_still_at_first_and_without_a_speed_always():
    assert compute_drift_mm(120.0, REST_S) == 0.0
    assert not places_mm(0.0).any()
    assert compute_drift_mm(120.0, -0.1) == 0.0


@pytest.mark.parametrize("speed_mm_s", [5.0, 60.0, 240.0, 300.0])
def test_it_has_its_speed_but_where_it_starts_and_turns(speed_mm_s):
    places = places_mm(speed_mm_s)
    speeds = np.abs(np.diff(places)) / STEP_S
    assert speeds.max() == pytest.approx(speed_mm_s)
    middle_mm = np.abs(0.5 * (places[1:] + places[:-1]))
    is_straight = (TIMES_S[:-1] > REST_S + START_S) & (middle_mm < STRAIGHT_MM - 1.0)
    assert is_straight.any()
    np.testing.assert_allclose(speeds[is_straight], speed_mm_s, rtol=1e-6)


@pytest.mark.parametrize("speed_mm_s", [60.0, 240.0])
def test_it_goes_to_both_sides_and_turns_smoothly(speed_mm_s):
    places = places_mm(speed_mm_s)
    farthest_mm = STRAIGHT_MM + speed_mm_s * TURN_S / 4.0
    assert places.max() == pytest.approx(farthest_mm, abs=0.1)
    assert places.min() == pytest.approx(-farthest_mm, abs=0.1)
    # The speed turns round within TURN_S: nothing jumps.
    changes = np.abs(np.diff(places, 2)) / STEP_S**2
    assert changes.max() <= 1.01 * 2.0 * speed_mm_s / min(TURN_S, 2.0 * START_S)
