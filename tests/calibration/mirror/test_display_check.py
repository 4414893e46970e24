"""A display in a mirror on views that it was not solved with."""

import dataclasses

import numpy as np
import pytest

from calibration.mirror.display_check import check_display
from navapp.devices.simulated_mirror import true_display
from navapp.errors import ResultError
from sim_devices.mirror_setups import draw_setup
from tests.calibration.mirror.simulated_views import drawn_views, scene

RNG = np.random.default_rng(41)
SETUP = draw_setup(RNG)
VIEWS, _ = drawn_views(RNG, SETUP, 4, every=4)


def test_the_true_display_passes_and_a_moved_one_does_not() -> None:
    model = true_display(SETUP)
    good = check_display(scene(), VIEWS, model)
    assert good.reasons == ()
    assert good.error_mm < 0.15
    change = np.zeros(14)
    change[3:6] = 0.6 * model.screen.across
    moved = check_display(scene(), VIEWS, model.move(change))
    assert moved.error_mm > 0.4
    assert "mirror, monitor or cameras have moved" in moved.reasons[0]


def test_without_glass_in_the_file_the_glass_is_missed() -> None:
    """What the plate does to the site is then not in the model, and shows."""
    bare = dataclasses.replace(true_display(SETUP), glass=None)
    assert check_display(scene(), VIEWS, bare).error_mm > 0.4


def test_a_flip_that_was_changed_is_told() -> None:
    turned = [dataclasses.replace(view, is_mirrored=not view.is_mirrored) for view in VIEWS]
    assert "a flip was changed" in check_display(scene(), turned, true_display(SETUP)).reasons[0]


def test_two_views_are_too_few() -> None:
    with pytest.raises(ResultError, match="only 2 views"):
        check_display(scene(), VIEWS[:2], true_display(SETUP))
