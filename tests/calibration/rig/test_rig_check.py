"""A rig as it was, and one whose cameras have moved since."""

from dataclasses import replace

import numpy as np
import pytest

from calibration.rig.rig_check import check_rig
from calibration.targets.seen_pairs import SeenPair
from navapp.errors import ResultError
from tests.calibration.marks import BOARD, drawn_pairs, drawn_rig

# 0.4 mm at 450 mm.
WORST_LENGTH = 0.4 / 450.0


@pytest.fixture(scope="module")
def world():
    rng = np.random.default_rng(31)
    rig = drawn_rig(rng)
    return rig, drawn_pairs(rig, rng, 6, noise_px=0.02)


def shifted(pairs: list[SeenPair], x_px: float, y_px: float) -> list[SeenPair]:
    """The right picture is elsewhere."""
    step = np.array([x_px, y_px])
    return [
        replace(pair, right=replace(pair.right, pixels=pair.right.pixels + step)) for pair in pairs
    ]


def test_a_rig_that_has_not_moved_passes(world) -> None:
    found = check_rig(BOARD, *world, WORST_LENGTH)
    assert found.reasons == ()
    assert found.length_mean == pytest.approx(1.0, abs=2e-4)
    assert found.rms_px < 0.04


def test_a_turn_up_or_down_is_told_by_the_rows(world) -> None:
    rig, pairs = world
    found = check_rig(BOARD, rig, shifted(pairs, 0.0, 0.4), WORST_LENGTH)
    assert found.epipolar_offset_px == pytest.approx(0.4, abs=0.05)
    assert any("too low" in reason for reason in found.reasons)


@pytest.mark.parametrize("x_px", [-0.4, 0.4])
def test_a_turn_sideways_is_told_by_the_lengths(world, x_px: float) -> None:
    """No row and hardly a residual shows it; it costs more than may be wrong."""
    rig, pairs = world
    found = check_rig(BOARD, rig, shifted(pairs, x_px, 0.0), WORST_LENGTH)
    assert abs(found.epipolar_offset_px) < 0.05
    assert any("100 mm" in reason for reason in found.reasons)


def test_what_cannot_be_told_is_no_pass(world) -> None:
    rig, pairs = world
    assert any("only 2 pairs" in r for r in check_rig(BOARD, rig, pairs[:2], WORST_LENGTH).reasons)
    told = check_rig(BOARD, rig, pairs, WORST_LENGTH)
    strict = abs(told.length_mean - 1.0) + told.length_error
    assert any("more pairs" in r for r in check_rig(BOARD, rig, pairs, strict).reasons)
    apart = [
        SeenPair(p.index, _part(p.left, slice(0, 30)), _part(p.right, slice(40, None)))
        for p in pairs
    ]
    reasons = check_rig(BOARD, rig, apart, WORST_LENGTH).reasons
    assert any("no length" in reason for reason in reasons)
    with pytest.raises(ResultError, match="not seen"):
        check_rig(BOARD, rig, [], WORST_LENGTH)


def _part(seen, places: slice):
    return replace(
        seen, ids=seen.ids[places], pixels=seen.pixels[places], sigma_px=seen.sigma_px[places]
    )
