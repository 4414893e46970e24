from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from navapp.geometry import Box, RectifiedPair
from navapp.geometry.directions import ViewCone, make_view_rotation
from navapp.geometry.transform import (
    RigidTransform,
    read_only,
    rotation_angle_deg,
    rotation_from_vector,
)
from navapp.geometry.zbuffer import render_rectified
from navapp.preop import build_aspects
from navapp.registration import DepthMap, RegistrationModel, Scene, find_initial
from navapp.registration.edge_tables import make_edge_tables, quantise_gradients, spread_responses
from navapp.registration.hypotheses import (
    compute_poses,
    keep_best,
    make_views,
    sample_scene,
    spread_hypotheses,
    thin_views,
    vary_hypotheses,
)
from navapp.registration.score_kernels import (
    EdgeTables,
    Hypotheses,
    Optics,
    scale_optics,
    score_edges,
    score_surface,
)
from navapp.values import AspectGraph
from tests.bones import femur_model
from tests.many import few_of
from tests.reference import initial_reference as reference
from tests.registration.shapes import GEOMETRY

AXIS = np.array([0.0, -0.5, -0.866])
CONE = ViewCone(AXIS, 30.0)
TRUE = RigidTransform.from_parts(
    "left_rect",
    "femur",
    rotation_from_vector((0.0, 0.0, 0.5)) @ make_view_rotation(AXIS + np.array([0.2, 0.1, 0.0])),
    (20.0, 5.0, 430.0),
)


@lru_cache(maxsize=1)
def model() -> RegistrationModel:
    return RegistrationModel(femur_model())


@lru_cache(maxsize=1)
def aspects() -> AspectGraph:
    return build_aspects(femur_model(), AXIS, 30.0)


@lru_cache(maxsize=1)
def seen() -> tuple[RectifiedPair, Scene]:
    """A bright bone before a dark wall, in both pictures; and its surface with the wall's."""
    whole = Box(0, 0, GEOMETRY.width, GEOMETRY.height)
    shift = RigidTransform.from_parts(
        "left_rect", "left_rect", np.eye(3), (-GEOMETRY.baseline_mm, 0.0, 0.0)
    )
    mesh, rng = femur_model().mesh, np.random.default_rng(8)
    pictures, depth = [], None
    for pose in (TRUE, shift @ TRUE):
        view = render_rectified(mesh, pose, GEOMETRY, whole)
        depth = view.depth_mm if depth is None else depth
        grey = np.where(view.mask, 170.0, 60.0) + rng.normal(0.0, 3.0, view.mask.shape)
        pictures.append(np.clip(grey, 0, 255).astype(np.uint8))
    rows, columns = np.mgrid[0 : GEOMETRY.height : 4, 0 : GEOMETRY.width : 4].reshape(2, -1)
    z = np.nan_to_num(depth[rows, columns], nan=520.0).astype(float)
    z += rng.normal(0.0, 0.2, z.shape)
    x = (columns - GEOMETRY.centre_x_px) / GEOMETRY.focal_px * z
    y = (rows - GEOMETRY.centre_y_px) / GEOMETRY.focal_px * z
    points = np.column_stack([x, y, z])
    scene = Scene(points, np.zeros(3), np.full(len(z), 0.2), 9.0)
    return RectifiedPair(*pictures, GEOMETRY, whole), scene


def error_mm(pose: RigidTransform) -> float:
    points = model().points_mm
    return float(np.linalg.norm(pose.apply(points) - TRUE.apply(points), axis=1).mean())


def poses_of(some: Hypotheses) -> list[RigidTransform]:
    parts = zip(*compute_poses(some), strict=True)
    return [RigidTransform.from_parts("left_rect", "femur", *each) for each in parts]


def is_right(pose: RigidTransform) -> bool:
    return error_mm(pose) < 3.0


@pytest.mark.parametrize("has_aspects", few_of([True, False]))
def test_a_bone_is_found_in_the_whole_view_without_a_pose(has_aspects: bool) -> None:
    pair, scene = seen()
    told: list[float] = []
    found = find_initial(
        pair, scene, model(), CONE, aspects() if has_aspects else None, on_progress=told.append
    )
    assert is_right(found[0].scene_from_bone)
    assert found[0].scene_from_bone.name == "left_rect_from_femur"
    assert told == sorted(told)
    assert told[-1] == 1.0
    scores = [one.score for one in found]
    assert scores == sorted(scores, reverse=True)
    assert sum(is_right(one.scene_from_bone) for one in found) == 1


@pytest.mark.release
def test_the_search_twice_gives_the_same() -> None:
    pair, scene = seen()
    first, second = (find_initial(pair, scene, model(), CONE, aspects()) for _ in range(2))
    assert [a.score for a in first] == [b.score for b in second]


def test_too_small_a_surface_has_no_candidates() -> None:
    pair, scene = seen()
    few = replace(scene, points_mm=scene.points_mm[:20], sigma_ray_mm=scene.sigma_ray_mm[:20])
    assert find_initial(pair, few, model(), CONE, aspects()) == []


def test_a_search_can_be_stopped() -> None:
    class StoppedError(Exception):
        pass

    def stop(share: float) -> None:
        if share > 0.55:
            raise StoppedError

    with pytest.raises(StoppedError):
        find_initial(*seen(), model(), CONE, aspects(), on_progress=stop)


def test_pictures_decide_between_poses_that_the_surface_allows() -> None:
    """Equation 3 is highest at the true pose, and thanks to the gate low beside the bone."""
    pair, _ = seen()
    near = int(np.argmax(aspects().directions @ (TRUE.rotation.T @ [0, 0, -1.0])))
    tables = make_edge_tables(pair, 4, 2, 250.0)
    turns = [0.0, 20.0, 40.0]
    poses = [
        TRUE.move((0, 0, 0, 0, 0, np.radians(turn)), TRUE.apply(model().centre_mm))
        for turn in turns
    ]
    poses.append(TRUE.move((70.0, 0, 0, 0, 0, 0), (0, 0, 0)))
    some = Hypotheses(
        np.arange(4, dtype=np.int32), np.arange(4, dtype=np.int32), np.full(4, near, np.int32),
        np.array([pose.rotation for pose in poses]), np.zeros((4, 3)), np.array([np.eye(3)] * 4),
        np.array([pose.translation_mm for pose in poses]),
    )  # fmt: skip
    edges = aspects().starts, aspects().points_mm, aspects().tangents
    score = np.zeros(4, dtype=np.float32)
    score_edges(some, *edges, 120, tables, score, (0, 4))
    assert score[0] > 0.7
    assert score[0] > score[1] + 0.1
    assert score[0] > score[2] + 0.2
    assert score[3] < 0.5 * score[0]


def test_places_lie_on_the_surface_and_the_map_holds_its_depth() -> None:
    _pair, scene = seen()
    (depth, _), places = sample_scene(scene, GEOMETRY, 8, 500)
    assert 300 < len(places) < 900
    wall = depth[2, 2]
    assert wall == pytest.approx(520.0, abs=0.5)
    pixels = GEOMETRY.project(places)
    cell = np.floor((pixels + 0.5) / 8).astype(int)
    np.testing.assert_allclose(depth[cell[:, 1], cell[:, 0]], places[:, 2], rtol=1e-6)


def test_hypotheses_put_their_anchor_at_their_place_and_face_the_camera() -> None:
    views = make_views(model(), CONE, None)
    places = np.array([(10.0, -20.0, 400.0), (-60.0, 30.0, 500.0)])
    some = spread_hypotheses(views, thin_views(views, 16.0), 90.0, places)
    assert len(some.orientation) == 2 * len(some.rotation)
    for h, pose in enumerate(poses_of(some)):
        o, place = some.orientation[h], places[some.place[h]]
        np.testing.assert_allclose(pose.apply(some.anchor_mm[o]), place, atol=1e-9)
        sight = pose.rotate(views.directions[some.view_index[o]])
        np.testing.assert_allclose(sight, -place / np.linalg.norm(place), atol=1e-9)


def selected(some: Hypotheses, which: np.ndarray) -> Hypotheses:
    return some._replace(orientation=some.orientation[which], place=some.place[which])


def test_the_best_are_kept_in_the_order_of_their_scores_and_ties_in_their_own() -> None:
    some = random_hypotheses(6)
    score = np.array([0.2, 0.7, 0.1, 0.7, 0.9, 0.2], dtype=np.float32)
    for n in (0, 1, 2, 4, 6, 9):
        which = np.array([4, 1, 3, 0, 5, 2], dtype=np.intp)[:n]
        kept, expected = keep_best(some, score, n), selected(some, which)
        np.testing.assert_array_equal(kept.orientation, expected.orientation)
        np.testing.assert_array_equal(kept.place, expected.place)


def test_neighbours_keep_the_anchor_near_and_hold_the_hypothesis_itself() -> None:
    views = make_views(model(), CONE, None)
    some = spread_hypotheses(views, thin_views(views, 16.0), 90.0, np.array([(10.0, -20.0, 400.0)]))
    one = selected(some, np.array([5]))
    (pose,) = poses_of(one)
    beside = poses_of(vary_hypotheses(one, views.directions, 12.0, 6.0, 2.0))
    angles = np.array([rotation_angle_deg(pose, other) for other in beside])
    assert angles.min() < 1e-3
    assert angles.max() < 20.0
    anchor = one.anchor_mm[one.orientation[0]]
    moved = [np.linalg.norm(other.apply(anchor) - (10.0, -20.0, 400.0)) for other in beside]
    assert max(moved) < 2.1


def test_the_views_of_aspects_have_their_edges() -> None:
    views = make_views(model(), CONE, aspects())
    assert np.array_equal(views.directions, aspects().directions)
    assert len(views.surface_mm) == len(views.aspects.starts) - 1 == len(aspects())


def test_a_cone_needs_an_axis_with_a_length() -> None:
    with pytest.raises(ValueError, match="length"):
        ViewCone(np.zeros(3), 20.0)


@pytest.mark.kernel
def test_gradients_and_responses_are_those_of_the_reference() -> None:
    picture = np.random.default_rng(2).normal(0.0, 20.0, (40, 50)).astype(np.float32)
    gy, gx = np.gradient(picture)
    bins = quantise_gradients(gx, gy, 12.0)
    np.testing.assert_array_equal(bins, reference.quantised(picture.astype(np.float64), 12.0))
    assert 0.1 < (bins > 0).mean() < 0.9
    for reach in (0, 2):
        np.testing.assert_array_equal(
            spread_responses(bins, reach), reference.responses(bins, reach)
        )


def random_hypotheses(n: int) -> Hypotheses:
    rng = np.random.default_rng(4)
    views = make_views(model(), CONE, None)
    places = rng.uniform((-40, -30, 380), (40, 30, 480), (5, 3))
    some = spread_hypotheses(views, thin_views(views, 16.0), 45.0, places)
    return selected(some, rng.choice(len(some.orientation), n, replace=False))


@pytest.mark.kernel
def test_scores_are_those_of_the_reference() -> None:
    rng = np.random.default_rng(6)
    some, n = random_hypotheses(12), 25
    n_views = int(some.view_index.max()) + 1
    points = rng.uniform(-30, 30, (n_views * n, 3)) + model().centre_mm
    tangents = rng.normal(size=points.shape)
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    starts = np.arange(n_views + 1, dtype=np.int64) * n
    edges = [read_only(array, array.dtype) for array in (starts, points, tangents)]
    optics = Optics(175.0, 79.3, 44.8, 80.0)
    left, right = rng.integers(0, 256, (2, 90, 160, 8)).astype(np.uint8)
    depth = np.where(rng.random((90, 160)) < 0.8, rng.uniform(380, 480, (90, 160)), 0.0)
    depth = depth.astype(np.float32)
    on_edges, surface = np.zeros((2, 12), dtype=np.float32)
    for span in ((0, 5), (5, 12)):
        score_edges(some, *edges, 20, EdgeTables(left, right, optics), on_edges, span)
        score_surface(some, points.reshape(-1, n, 3), DepthMap(depth, optics), 30.0, surface, span)
    for h, pose in enumerate(poses_of(some)):
        first = starts[some.view_index[some.orientation[h]]]
        mine = np.s_[first : first + 20]
        rotation, shift = pose.rotation, pose.translation_mm
        expected = reference.edge_score(
            rotation, shift, points[mine], tangents[mine], (left, right), optics
        )
        assert on_edges[h] == pytest.approx(expected, abs=0.02)
        expected = reference.surface_score(
            rotation, shift, points[first : first + n], depth, optics, 30.0
        )
        assert surface[h] == pytest.approx(expected, abs=1e-6)
    assert np.ptp(on_edges) > 0.0
    assert np.ptp(surface) > 0.0


def test_smaller_pictures_keep_their_places() -> None:
    optics = scale_optics(GEOMETRY, 8)
    point = np.array([[30.0, -20.0, 450.0]])
    u, v = GEOMETRY.project(point)[0]
    assert optics.focal_px * 30.0 / 450.0 + optics.centre_x_px == pytest.approx((u + 0.5) / 8 - 0.5)
    assert optics.focal_px * -20.0 / 450.0 + optics.centre_y_px == pytest.approx(
        (v + 0.5) / 8 - 0.5
    )


@pytest.mark.parametrize("beside", ["above", "below"])
def test_what_is_flat_is_learned_in_the_box_of_each_picture(beside: str) -> None:
    """Strong gradients above or below the box must not raise what counts as flat inside it."""
    rng = np.random.default_rng(3)
    given = rng.integers(90, 110, (240, 320), dtype=np.uint8)
    box = Box(160, 80, 120, 80)
    rough = given.copy()
    rows = slice(0, 60) if beside == "above" else slice(180, 240)
    rough[rows] = rng.integers(0, 255, rough[rows].shape, dtype=np.uint8)
    left, right = (
        make_edge_tables(RectifiedPair(given, picture, GEOMETRY, box), 1, 1, 40.0)
        for picture in (given, rough)
    )
    inside = np.s_[box.y : box.y + box.height, box.x - 40 : box.x + box.width]
    np.testing.assert_array_equal(left.right[inside], right.right[inside])


def test_a_bone_is_found_in_its_box() -> None:
    pair, scene = seen()
    pixels = GEOMETRY.project(scene.points_mm)
    around_bone = Box.around(GEOMETRY.project(TRUE.apply(model().points_mm)))
    box = around_bone.grow(20).clip(GEOMETRY.width, GEOMETRY.height)
    inside = ((pixels >= (box.x, box.y)) & (pixels < (box.x + box.width, box.y + box.height))).all(
        axis=1
    )
    part = replace(
        scene, points_mm=scene.points_mm[inside], sigma_ray_mm=scene.sigma_ray_mm[inside]
    )
    found = find_initial(replace(pair, box=box), part, model(), CONE, aspects())
    assert is_right(found[0].scene_from_bone)
