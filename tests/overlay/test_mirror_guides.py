"""Crosses and cut lines of a followed knee, read from the picture that the eye sees in the mirror.

A short form of `tests.bench.mirror_accuracy`: one set-up, its display not calibrated but known.
"""

import numpy as np
import pytest

from navapp.devices.simulated_mirror import true_display
from navapp.geometry.display_model import DisplayModel
from navapp.geometry.transform import RigidTransform
from sim_devices.mirror_setups import draw_setup, look_at_site
from tests.bench.mirror_guides import (
    Crosses,
    ReadCut,
    choose_targets,
    find_cut,
    read_crosses,
    read_cut,
)
from tests.bench.mirror_knees import FollowedKnee, follow_knee
from tests.bench.mirror_reading import Sight
from tests.geometry.test_display_model_errors import seen_beside_mm

# A busy machine takes long to render and to read pictures.
pytestmark = [pytest.mark.release, pytest.mark.timeout(300)]

SEED = 3100


class ReadSetup:
    """A knee in a set-up, and what is read of guides that are drawn for it."""

    def __init__(self) -> None:
        rng = np.random.default_rng(SEED)
        self.knee: FollowedKnee = follow_knee(SEED)
        setup = draw_setup(rng, self.knee.middle_mm)
        self.display: DisplayModel = true_display(setup)
        self.sight = Sight(setup, look_at_site(setup))
        self.targets_mm = choose_targets(rng, self.knee, self.sight)
        self.cut = find_cut(self.knee, self.sight)

    def read(self, display: DisplayModel, pose: RigidTransform) -> tuple[Crosses, ReadCut]:
        knee, sight, view = self.knee, self.sight, display.view()
        crosses = read_crosses(knee, sight, view, pose, self.targets_mm)
        return crosses, read_cut(knee, sight, view, pose, self.cut)


@pytest.fixture(scope="module")
def setup() -> ReadSetup:
    return ReadSetup()


def test_what_is_drawn_by_the_truth_is_seen_where_it_belongs(setup: ReadSetup) -> None:
    crosses, cut = setup.read(setup.display, setup.knee.true)
    assert crosses.is_whole.sum() >= 1
    assert crosses.centroid_mm[crosses.is_whole].max() < 0.05
    assert np.isfinite(crosses.crossing_mm).sum() >= 4
    assert np.nanquantile(crosses.crossing_mm, 0.95) < 0.05
    assert np.isfinite(cut.off_mm).mean() > 0.7
    assert np.nanquantile(np.abs(cut.off_mm), 0.95) < 0.05


def test_what_is_drawn_for_the_tracked_pose_is_seen_near_there(setup: ReadSetup) -> None:
    crosses, cut = setup.read(setup.display, setup.knee.estimated)
    assert np.nanmedian(crosses.crossing_mm) < 0.35
    off_mm = np.abs(cut.off_mm[np.isfinite(cut.off_mm)])
    assert np.mean(off_mm <= 0.5) >= 0.95


def test_a_display_that_is_off_is_read_so(setup: ReadSetup) -> None:
    moved = setup.display.move(np.array([0, 0, 0, 0.5, -0.3, 0.2, 0, 0, 0, 0, 0, 0, 0, 0.0]))
    points_mm = setup.knee.true.apply(setup.targets_mm)
    expected = seen_beside_mm(moved, setup.display, points_mm, points_mm)
    crosses, cut = setup.read(moved, setup.knee.true)
    is_read = np.isfinite(crosses.crossing_mm)
    assert expected.min() > 0.4
    np.testing.assert_allclose(crosses.crossing_mm[is_read], expected[is_read], atol=0.06)
    assert np.nanmax(np.abs(cut.off_mm)) == pytest.approx(expected.mean(), abs=0.1)
