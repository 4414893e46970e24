import numpy as np
import pytest

from navapp.tracking.box.median_flow import median_flow
from tests.tracking.box.pictures import BOX, box_at, empty, scene


@pytest.mark.parametrize(
    ("shift", "scale"), [((0.0, 0.0), 1.0), ((6.5, -3.25), 1.0), ((-4.0, 5.0), 1.06)]
)
def test_a_box_moves_and_grows_with_its_points(shift, scale: float) -> None:
    found = median_flow(scene(), scene(shift, scale, seed=1), BOX)
    true = box_at(shift, scale)
    np.testing.assert_allclose(found.centre, true.centre, atol=0.4)
    assert found.width == pytest.approx(true.width, rel=0.015)


def test_brighter_light_moves_nothing() -> None:
    found = median_flow(scene(), scene((3.0, 2.0), gain=1.4, seed=1), BOX)
    np.testing.assert_allclose(found.centre, box_at((3.0, 2.0)).centre, atol=0.4)


def test_a_third_that_is_hidden_does_not_carry_the_box_away() -> None:
    found = median_flow(scene(), scene((4.0, -3.0), hidden_fraction=0.3, seed=1), BOX)
    np.testing.assert_allclose(found.centre, box_at((4.0, -3.0)).centre, atol=0.6)


def test_a_box_that_reaches_out_of_the_picture_is_followed() -> None:
    there = (-150.0, 0.0)
    found = median_flow(scene(there), scene((-146.0, 2.0), seed=1), box_at(there))
    np.testing.assert_allclose(found.centre, box_at((-146.0, 2.0)).centre, atol=0.8)


@pytest.mark.parametrize("after", [empty(1), np.zeros_like(empty())])
def test_a_thing_that_has_gone_is_not_followed(after: np.ndarray) -> None:
    assert median_flow(scene(), after, BOX) is None


def test_a_box_outside_the_picture_is_not_followed() -> None:
    assert median_flow(scene(), scene(seed=1), box_at((-400.0, 0.0))) is None
    assert median_flow(scene(), scene(seed=1), box_at((0.0, 300.0))) is None
