import numpy as np
import pytest

from navapp.tracking.box.detector import (
    MOST_COUNTEREXAMPLES,
    MOST_EXAMPLES,
    detect,
    learn,
    polish,
    rate,
)
from tests.tracking.box.pictures import BOX, box_at, empty, scene, texture


@pytest.fixture(scope="module")
def memory():
    return learn(None, scene(), BOX)


@pytest.mark.parametrize(
    ("shift", "scale", "gain"),
    [
        ((0.0, 0.0), 1.0, 1.0),
        ((-70.0, 20.0), 1.0, 0.6),
        ((60.0, -30.0), 1.12, 1.3),
        ((90.0, 10.0), 0.9, 1.0),
    ],
)
def test_a_thing_is_found_anywhere_in_any_light(memory, shift, scale, gain) -> None:
    best = detect(memory, scene(shift, scale, gain, seed=7))[0]
    assert best.box.overlap(box_at(shift, scale)) > 0.8
    assert best.similarity > 0.7
    assert best.relative > 0.54


@pytest.mark.parametrize("hidden_fraction", [0.2, 0.4])
def test_the_whole_box_of_a_thing_that_is_hidden_in_part(memory, hidden_fraction: float) -> None:
    shift = (-40.0, 12.0)
    best = detect(memory, scene(shift, hidden_fraction=hidden_fraction, seed=7))[0]
    assert best.box.overlap(box_at(shift)) > 0.7
    assert best.similarity > 0.5


@pytest.mark.parametrize("seed", range(4))
def test_nothing_else_is_like_it(memory, seed: int) -> None:
    clutter = 110.0 + texture((180, 320), 4.0, 25.0, 50 + seed)
    clutter = np.clip(clutter, 0.0, 255.0).astype(np.uint8)
    for picture in (clutter, empty(seed)):
        for one in detect(memory, picture):
            assert one.similarity < 0.5
    assert detect(memory, np.full((180, 320), 90, np.uint8)) == []


def test_a_part_that_is_lit_otherwise_does_not_count(memory) -> None:
    """The same pattern, its halves brighter and darker: no light does that."""
    picture = scene(seed=7).astype(float)
    picture[: int(BOX.centre[1])] *= 0.5
    picture = np.clip(picture, 0.0, 255.0).astype(np.uint8)
    assert rate(memory, scene(seed=7), BOX).similarity > 0.9
    assert rate(memory, picture, BOX).similarity < 0.6


def test_a_box_a_little_off_is_put_right(memory) -> None:
    picture = scene((3.0, 5.0), seed=7)
    off = box_at((6.0, 2.0))
    found = polish(memory, picture, off)
    assert found.box.overlap(box_at((3.0, 5.0))) > 0.92 > off.overlap(box_at((3.0, 5.0)))


def test_a_look_alike_becomes_a_counterexample(memory) -> None:
    """The upper half of the thing stands there twice."""
    double = scene(seed=7)
    y, x, half = int(BOX.y), int(BOX.x), int(0.6 * BOX.height)
    double[y + 20 : y + 20 + half, 10 : 10 + int(BOX.width)] = double[
        y : y + half, x : x + int(BOX.width)
    ]
    other = box_at((10.0 - BOX.x, 20.0))
    before = rate(memory, double, other)
    # The thing as it is seen now is new to the memory: half of it is hidden.
    after = rate(learn(memory, _half_hidden(double), BOX), double, other)
    assert before.relative > 0.54
    assert after.relative < before.relative - 0.05


def _half_hidden(picture: np.ndarray) -> np.ndarray:
    hidden = picture.copy()
    hidden[int(BOX.centre[1]) : 160, int(BOX.x) : int(BOX.x + BOX.width)] = 200
    return hidden


def test_the_memory_is_bounded_and_keeps_the_first(memory) -> None:
    grown, first = memory, memory.examples[0]
    for seed in range(2 * MOST_EXAMPLES):
        clutter = 110.0 + texture((180, 320), 3.0, 30.0, 100 + seed)
        picture = np.clip(clutter, 0.0, 255.0).astype(np.uint8)
        grown = learn(grown, picture, box_at((5.0 * (seed % 7), 0.0)))
        assert len(grown.examples) <= MOST_EXAMPLES
        assert len(grown.counterexamples) <= MOST_COUNTEREXAMPLES
    assert len(grown.examples) == MOST_EXAMPLES
    np.testing.assert_array_equal(grown.examples[0], first)
    assert rate(grown, scene(seed=7), BOX).similarity > 0.9


def test_what_is_known_is_not_kept_twice(memory) -> None:
    again = learn(memory, scene((2.0, 1.0), seed=9), box_at((2.0, 1.0)))
    assert len(again.examples) == 1
