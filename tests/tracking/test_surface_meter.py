"""The measured surface on the model: which of it the fit may trust."""

import numpy as np

from navapp.geometry.masks import grow
from navapp.registration import RegistrationModel
from navapp.resection.remaining_bone import Cut, close_with_face, remove_cuts, remove_holes
from navapp.tracking.surface_meter import NEAR_BOX, NEAR_VIEW, SurfaceMeter, remove_gap_rims
from navapp.values import DisparityMap, DrillAxis, MeasuredFace
from tests.reference.both_eyes_reference import unclear
from tests.resection import cuts

SHAPE = (80, 120)
HOLE = DrillAxis("femur", np.array([0.0, 0.0, 12.0]), np.array([0.0, 0.0, -1.0]), 5.0, 6.0)
EVERYWHERE = np.ones(SHAPE, dtype=bool)


def found_beside(gap: np.ndarray) -> DisparityMap:
    known = ~gap
    disparity = np.where(known, 40.0, np.nan).astype(np.float32)
    sigma = np.where(known, 0.1, np.nan).astype(np.float32)
    return DisparityMap(disparity, sigma, known.astype(np.uint8), 5, 7)


def gap_of(height: int, width: int) -> np.ndarray:
    gap = np.zeros(SHAPE, dtype=bool)
    gap[30 : 30 + height, 40 : 40 + width] = True
    return gap


def test_the_rim_of_a_large_gap_is_not_trusted() -> None:
    found = found_beside(gap_of(25, 30))
    trusted = remove_gap_rims(found, EVERYWHERE)
    expected = np.ones(SHAPE, dtype=bool)
    expected[27:58, 37:73] = False
    np.testing.assert_array_equal(trusted.origin > 0, expected)
    np.testing.assert_array_equal(np.isfinite(trusted.disparity_px), expected)
    np.testing.assert_array_equal(np.isfinite(trusted.sigma_px), expected)
    assert (trusted.x, trusted.y) == (found.x, found.y)


def test_around_a_small_gap_everything_is_trusted() -> None:
    found = found_beside(gap_of(15, 20))
    np.testing.assert_array_equal(remove_gap_rims(found, EVERYWHERE).origin, found.origin)


def test_beside_the_model_is_no_gap() -> None:
    gap = gap_of(25, 30)
    found = found_beside(gap)
    np.testing.assert_array_equal(remove_gap_rims(found, ~gap).origin, found.origin)


def test_where_too_little_would_be_left_all_of_it_is_trusted() -> None:
    stripes = np.zeros(SHAPE, dtype=bool)
    stripes[:, 3:] = np.arange(3, SHAPE[1]) % 8 > 0
    found = found_beside(stripes)
    np.testing.assert_array_equal(remove_gap_rims(found, EVERYWHERE).origin, found.origin)


def test_what_is_measured_on_the_model_tells_the_shape_of_the_bone() -> None:
    meter = SurfaceMeter(cuts.rig(), RegistrationModel(cuts.bone()), (200.0, 900.0))
    pose = meter.geometry.rectified_from_left @ cuts.pose()
    pair = meter.rectify(*cuts.pictures(cuts.pose()), pose, NEAR_VIEW)
    expected = meter.render(pair, pose, NEAR_BOX)
    assert expected is not None
    assert meter.measure_on_model(expected).scene.tells_shape
    assert not meter.measure_freely(pair, pose, NEAR_BOX).scene.tells_shape


def test_what_an_outline_is_mixed_with_does_not_pull_what_is_measured() -> None:
    """At the true pose, of a cut ball before a wall; the right eye does not see its left flank."""
    bone = remove_cuts(cuts.bone(), [Cut(cuts.MADE, 0.3)])
    meter = SurfaceMeter(cuts.rig(), RegistrationModel(bone), (200.0, 900.0))
    pose = meter.geometry.rectified_from_left @ cuts.pose()
    pair = meter.rectify(*cuts.pictures(cuts.pose()), pose, NEAR_VIEW)
    expected = meter.render(pair, pose, NEAR_BOX)
    assert expected is not None
    is_seen, is_asked = expected.view.mask, np.isfinite(expected.support_px)
    whole = meter.model.render(pose, meter.geometry, expected.view.box, has_lid=True)
    whole_px = meter.geometry.disparity_map_px(whole.depth_mm)
    np.testing.assert_array_equal(is_asked, is_seen & ~unclear(whole_px, 1))
    assert 0.5 < is_asked.sum() / is_seen.sum() < 0.8
    # Where the face begins the bone goes on: that is no outline.
    assert (is_asked & grow(whole.mask & ~is_seen, 1)).sum() > 20
    found = meter.measure_on_model(expected).disparity
    offset_px = (found.disparity_px - whole_px)[found.is_matched]
    assert len(offset_px) > 400
    assert np.sqrt(np.mean(offset_px**2)) < 0.025


def test_whole_bones_and_tracked_faces_are_matched_up_to_their_outlines() -> None:
    whole = cuts.bone()
    face = MeasuredFace(cuts.PLANNED, np.zeros(3), 1e-3 * np.eye(3), 0.9)
    faced = close_with_face(whole, face)
    for bone in (whole, faced, remove_holes(faced, [HOLE], 0.5)):
        meter = SurfaceMeter(cuts.rig(), RegistrationModel(bone), (200.0, 900.0))
        pose = meter.geometry.rectified_from_left @ cuts.pose()
        expected = meter.render(
            meter.rectify(*cuts.pictures(cuts.pose()), pose, NEAR_VIEW), pose, NEAR_BOX
        )
        assert expected is not None
        np.testing.assert_array_equal(np.isfinite(expected.support_px), expected.view.mask)
