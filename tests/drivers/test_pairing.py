import itertools

import numpy as np
import pytest

from drivers.pairing import PairMatcher, TimedPicture
from tests.many import few_of

MS = 10**6
PICTURE = np.zeros((2, 2), np.uint8)


def at(ms: float) -> TimedPicture:
    return TimedPicture(PICTURE, round(ms * MS))


def fed(matcher: PairMatcher, order: list[tuple[int, float]]) -> list[tuple[float, float]]:
    """Pairs made when pictures (eye, ms) come in this order."""
    pairs = [matcher.add(eye, at(ms)) for eye, ms in order]
    return [(p[0].captured_ns / MS, p[1].captured_ns / MS) for p in pairs if p is not None]


def test_pictures_of_one_instant_are_paired_whoever_comes_first():
    matcher = PairMatcher(5 * MS)
    assert fed(matcher, [(0, 100), (1, 103), (1, 131), (0, 133)]) == [(100, 103), (133, 131)]
    assert matcher.n_unpaired == 0


def test_a_picture_without_a_partner_is_dropped_and_counted():
    matcher = PairMatcher(5 * MS)
    assert fed(matcher, [(0, 100), (0, 133), (1, 134), (1, 167), (0, 166)]) == [
        (133, 134),
        (166, 167),
    ]
    assert matcher.n_unpaired == 1


def test_cameras_that_never_expose_together_give_no_pair_and_say_by_how_much():
    matcher = PairMatcher(5 * MS)
    order = [(eye, 33.0 * n + 12.0 * eye) for n in range(10) for eye in (0, 1)]
    assert fed(matcher, order) == []
    assert matcher.n_unpaired == 19
    assert matcher.last_miss_ns == 12 * MS


def test_a_stalled_eye_does_not_fill_the_memory():
    matcher = PairMatcher(5 * MS)
    assert fed(matcher, [(0, 33.0 * n) for n in range(1000)]) == []
    assert matcher.n_unpaired == 996


@pytest.mark.parametrize("seed", few_of(range(20), 3))
def test_every_pair_is_that_of_the_nearest_pictures_and_none_is_used_twice(seed):
    """Against all pairs tried; threads deliver with any delay, pictures vanish, clocks jitter."""
    random = np.random.default_rng(seed)
    period, limit = 33.0, 12.0
    eyes = []
    for eye in (0, 1):
        ms = np.arange(60) * period + random.uniform(-2.0, 2.0, 60) + eye * random.uniform(0, 10)
        eyes.append(ms[random.uniform(size=60) > 0.2])
    order = sorted(
        ((eye, float(ms)) for eye in (0, 1) for ms in eyes[eye]),
        key=lambda item: item[1] + (random.uniform(0, 20) if item[0] else 0.0),
    )
    matcher = PairMatcher(round(limit * MS))
    pairs = fed(matcher, order)
    expected = {
        (round(a, 6), round(b, 6))
        for a, b in itertools.product(*eyes)
        if abs(a - b) <= limit and b == min(eyes[1], key=lambda other: abs(other - a))
    }
    assert {(round(a, 6), round(b, 6)) for a, b in pairs} == expected
    assert len(pairs) == len(expected) > 20
