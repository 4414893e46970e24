"""The model's outline in both pictures, as a residual block."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from navapp.geometry.box import Box
from navapp.geometry.rectification import RectifiedPair
from navapp.geometry.transform import RigidTransform
from navapp.geometry.zbuffer import render_rectified
from navapp.tracking.frame import Fit
from navapp.tracking.outline import OutlineMeter
from navapp.tracking.surface_meter import NEAR_BOX, WIDE_VIEW, Measurement
from navapp.values import DisparityMap, Origin, PoseEstimate, Reason, SurfaceCloud
from tests.registration.shapes import GEOMETRY, TRUE, femur, femur_for_registration
from tests.tracking.rooms import blank_pair, measured_map, room
from tests.views import project_box

FINE = 4
SIGMAS = np.array([0.1, 0.1, 0.1, 0.002, 0.002, 0.002])
NO_CLOUD = SurfaceCloud(np.empty((0, 3)), np.empty(0), np.empty(0), np.empty((0, 3)))


def picture(pose: RigidTransform) -> np.ndarray:
    """A bright bone on dark ground, area sampled, a little blurred."""
    fine = replace(
        GEOMETRY,
        focal_px=FINE * GEOMETRY.focal_px,
        centre_x_px=FINE * GEOMETRY.centre_x_px + 0.5 * (FINE - 1),
        centre_y_px=FINE * GEOMETRY.centre_y_px + 0.5 * (FINE - 1),
        width=FINE * GEOMETRY.width,
        height=FINE * GEOMETRY.height,
    )
    whole = Box(0, 0, fine.width, fine.height)
    mask = render_rectified(femur().mesh, pose, fine, whole).mask
    share = mask.reshape(GEOMETRY.height, FINE, GEOMETRY.width, FINE).mean(axis=(1, 3))
    return np.round(15.0 + 165.0 * gaussian_filter(share, 0.5)).astype(np.uint8)


@cache
def pair() -> RectifiedPair:
    """Of the bone at `TRUE`; what the right camera sees is the bone further left."""
    shift = np.array([-GEOMETRY.baseline_mm, 0.0, 0.0, 0.0, 0.0, 0.0])
    box = project_box(femur().mesh, TRUE, GEOMETRY)
    return RectifiedPair(picture(TRUE), picture(TRUE.move(shift, np.zeros(3))), GEOMETRY, box)


@cache
def meter() -> OutlineMeter:
    return OutlineMeter(femur_for_registration(), GEOMETRY)


def centre_mm(pose: RigidTransform) -> np.ndarray:
    return pose.apply(femur_for_registration().centre_mm)


def fit_at(pose: RigidTransform, is_measured: bool = True) -> Fit:
    """The bone matched on the model at a pose, everywhere or nowhere."""
    box = project_box(femur().mesh, pose, GEOMETRY).grow(16)
    view = render_rectified(femur().mesh, pose, GEOMETRY, box)
    origin = np.where(view.mask & is_measured, Origin.MATCHED, Origin.UNKNOWN).astype(np.uint8)
    disparity = GEOMETRY.disparity_map_px(view.depth_mm)
    found = DisparityMap(disparity, np.full_like(disparity, 0.1), origin, box.x, box.y)
    measurement = Measurement(found, lambda: NO_CLOUD, 1.0, 11.0, view)
    estimate = PoseEstimate(pose, np.diag(SIGMAS**2), 2000, 1.0, 0.1, 0.1, 5, True)
    return Fit(estimate, measurement)


def block_at(fit: Fit, coarse_px: np.ndarray | None = None):
    view = fit.measured.rendered
    return meter().block(pair(), fit.pose, view, fit.measured.disparity, coarse_px)


def error_mm(pose: RigidTransform) -> float:
    points = femur_for_registration().points_mm
    return float(np.linalg.norm(pose.apply(points) - TRUE.apply(points), axis=1).mean())


TWIST = np.array([0.12, -0.1, 0.05, 0.0015, -0.002, 0.002])
OFF = TRUE.move(TWIST, centre_mm(TRUE))


def test_at_the_true_pose_edges_are_where_the_model_has_them() -> None:
    block = block_at(fit_at(TRUE))
    assert len(block.residual) > 100
    assert np.median(np.abs(block.residual)) < 0.1
    assert abs(np.median(block.residual)) < 0.05


def test_the_jacobian_tells_what_a_motion_does_to_the_residuals() -> None:
    block = block_at(fit_at(OFF))
    expected = block.jacobian @ -TWIST
    assert np.abs(expected).max() > 0.5
    assert np.median(np.abs(block.residual - expected)) < 0.1
    assert np.corrcoef(block.residual, expected)[0, 1] > 0.8


def test_joined_with_a_vague_surface_the_pose_is_drawn_to_the_truth() -> None:
    fit = fit_at(OFF)
    joined = meter().join(pair(), fit, None)
    assert error_mm(joined.pose) < 0.5 * error_mm(OFF)
    assert np.trace(joined.estimate.covariance) < np.trace(fit.estimate.covariance)
    assert joined.measured is fit.measured


def test_a_direction_that_the_surface_leaves_free_and_the_outline_fixes_is_not_free() -> None:
    fit = fit_at(OFF)
    seen = SurfaceCloud(
        OFF.apply(femur_for_registration().points_mm), np.empty(0), np.empty(0), np.empty((0, 3))
    )
    # Along the bone the surface says a fiftieth of what it says across.
    sigmas = SIGMAS * [1.0, 50.0, 1.0, 1.0, 1.0, 1.0]
    estimate = replace(fit.estimate, covariance=np.diag(sigmas**2)).with_reason(Reason.DEGENERATE)
    free = Fit(estimate, replace(fit.measured, make_cloud=lambda: seen))
    assert meter().join(pair(), free, None).estimate.reasons == ()
    dark = replace(pair(), left=0 * pair().left, right=0 * pair().right)
    assert meter().join(dark, free, None).estimate.reasons == (Reason.DEGENERATE,)


def test_without_bone_inside_or_with_something_nearer_beside_nothing_counts() -> None:
    fit = fit_at(TRUE)
    assert len(block_at(fit_at(TRUE, is_measured=False)).residual) == 0
    near = np.full(fit.measured.rendered.mask.shape, 400.0, dtype=np.float32)
    assert len(block_at(fit, near).residual) == 0
    far = np.full(fit.measured.rendered.mask.shape, 100.0, dtype=np.float32)
    assert len(block_at(fit, far).residual) == len(block_at(fit).residual)


def test_edges_without_bone_inside_count_when_asked_for_unless_something_nearer_is_there() -> None:
    fit, unmeasured = fit_at(OFF), fit_at(OFF, is_measured=False)
    view = fit.measured.rendered
    far = np.full(view.mask.shape, 100.0, dtype=np.float32)
    on_it = np.where(view.mask, GEOMETRY.disparity_map_px(view.depth_mm), far)
    hand_px = np.where(view.mask, on_it + np.float32(1.5), far)

    def joined(coarse_px: np.ndarray | None) -> RigidTransform:
        return meter().join(pair(), unmeasured, coarse_px, counts_unmeasured=True).pose

    everywhere = meter().join(pair(), fit, None).pose.matrix
    unknown = np.full(view.mask.shape, np.nan, dtype=np.float32)
    for free_px in (far, on_it + np.float32(0.5), unknown):
        np.testing.assert_array_equal(joined(free_px).matrix, everywhere)
    for covered_px in (hand_px, None):
        assert joined(covered_px) is unmeasured.pose


def test_dark_pictures_leave_the_fit_alone() -> None:
    fit, dark = fit_at(OFF), replace(pair(), left=0 * pair().left, right=0 * pair().right)
    left_alone = meter().join(dark, fit, None)
    assert left_alone.pose is fit.pose
    np.testing.assert_array_equal(left_alone.estimate.covariance, fit.estimate.covariance)


def test_a_free_fit_and_one_without_covariance_stay() -> None:
    fit = fit_at(OFF)
    free = replace(fit, measured=replace(fit.measured, rendered=None))
    assert meter().join(pair(), free, None) is free
    endless = replace(fit.estimate, covariance=np.diag([np.inf] * 6))
    loose = replace(fit, estimate=endless)
    assert meter().join(pair(), loose, None) is loose


def test_an_outline_of_cartilage_whose_thickness_is_not_known_tells_nothing() -> None:
    """Errors of a thickness go together along it: it would move the pose as one."""
    sd_mm = np.where(femur().mesh.vertices_mm[:, 0] > 0.0, 0.5, 0.0)
    bone = replace(femur(), cartilage_sd_mm=sd_mm)
    unsure = OutlineMeter(type(femur_for_registration())(bone), GEOMETRY)
    fit = fit_at(TRUE)
    found = unsure.block(
        pair(), TRUE, fit.measured.rendered, fit.measured.disparity, is_bare_only=True
    )
    block = block_at(fit)
    assert 0 < len(found.residual) < len(block.residual)
    bare = (block.arm_mm @ TRUE.rotation + femur().mesh.centroid_mm)[:, 0] <= 0.0
    assert len(found.residual) == pytest.approx(int(bare.sum()), abs=3)
    assert found.variance.max() <= block.variance.max()


@pytest.mark.parametrize("thickness_ratio", [None, 0.5])
def test_the_outline_of_cartilage_is_left_out_where_its_thickness_was_fitted(
    monkeypatch, thickness_ratio
) -> None:
    meter, fit, asked = OutlineMeter(femur_for_registration(), GEOMETRY), fit_at(TRUE), []
    block = meter.block

    def spy(*given, is_bare_only: bool):
        asked.append(is_bare_only)
        return block(*given, is_bare_only=is_bare_only)

    monkeypatch.setattr(meter, "block", spy)
    estimate = replace(fit.estimate, thickness_ratio=thickness_ratio)
    meter.join(pair(), replace(fit, estimate=estimate), None)
    assert asked == [thickness_ratio is not None]


@pytest.mark.parametrize("eye", [0, 1])
def test_each_picture_tells_something_of_its_own(eye: int) -> None:
    blank = np.zeros_like(pair().left)
    one = replace(pair(), right=blank) if eye == 0 else replace(pair(), left=blank)
    fit = fit_at(TRUE)
    found = meter().block(one, TRUE, fit.measured.rendered, fit.measured.disparity)
    both = block_at(fit)
    assert 0.3 * len(both.residual) < len(found.residual) < 0.7 * len(both.residual)


def test_the_outline_moves_onto_the_edges_of_both_pictures() -> None:
    """Equation (4): the mean of the squared distances, in px, becomes smaller."""
    a = room()
    frame, model, meter = a.frames[0], a.tracker.model, a.tracker.meter
    begun = a.tracker.begin(frame, a.truth(frame), WIDE_VIEW)
    measured = meter.measure_freely(begun.pair, begun.start, NEAR_BOX).disparity
    outline = OutlineMeter(model, meter.geometry)

    def mean_square_px2(pose) -> float:
        view = model.render(pose, meter.geometry, measured.box)
        return float(np.mean(outline.block(begun.pair, pose, view, measured).residual ** 2))

    for shift_mm in ((0.4, 0.0, 0.0), (0.0, 0.4, 0.0), (-0.3, 0.3, 0.0)):
        start = begun.start.move((*shift_mm, 0.0, 0.0, 0.0), np.zeros(3))
        found = outline.refine(begun.pair, start, measured)
        assert mean_square_px2(found) < 0.5 * mean_square_px2(start)


def test_without_edges_a_pose_stays() -> None:
    model = room().tracker.model
    outline = OutlineMeter(model, GEOMETRY)
    assert outline.refine(blank_pair(), TRUE, measured_map(model.bone)) is TRUE
