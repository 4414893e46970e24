from dataclasses import replace

import numpy as np
import pytest

from navapp.geometry.camera import Camera
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import RigidTransform, rotation_from_vector
from sim_devices.anatomy import KneeSpec, make_knee
from sim_devices.materials import MaterialId, make_material_table
from sim_devices.renderer import Part, Renderer, Surfaces
from sim_devices.rigs import make_default_rig
from sim_devices.textures import make_noise_tile
from tests.reference import shading_reference

LAMPS = np.array([[-0.3, -0.4, -0.9, 0.6], [0.5, -0.1, -0.8, 0.4]])
NO_LAMPS = RigidTransform.identity("camera", "table")
POSE = RigidTransform.from_parts(
    "camera", "femur", rotation_from_vector((-1.0, 0.1, 0.2)), (5.0, -3.0, 430.0)
)


class WithoutCrevices(Renderer):
    """A renderer that darkens no crevices."""

    def _find_surroundings(self, *given, **options):
        surroundings = super()._find_surroundings(*given, **options)
        return replace(surroundings, depth_mm=np.full_like(surroundings.depth_mm, 1e6))


def surfaces(**changes):
    values = {
        "materials": make_material_table(0.05, 0.0),
        "tile": make_noise_tile(1, size=64),
        "lamps": LAMPS,
    }
    return Surfaces(**(values | changes))


@pytest.fixture(scope="module")
def femur():
    return make_knee(KneeSpec(1)).bones["femur"]


@pytest.fixture(scope="module")
def pinhole():
    return Camera(
        np.array([[700.0, 0, 321.3], [0, 702.0, 178.8], [0, 0, 1]]), np.zeros(5), 640, 360
    )


def without_rim(mask):
    """Of a mask (H, W) what has no pixel of something else, nor the picture's edge, beside it."""
    padded = np.pad(mask, 1)
    h, w = mask.shape
    return np.all([padded[y : y + h, x : x + w] for y in range(3) for x in range(3)], axis=0)


def disc(centre, radius):
    angle = np.linspace(0, 2 * np.pi, 96, endpoint=False)
    ring = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(96)]) * radius + centre
    index = np.arange(96)
    faces = np.column_stack([np.roll(index, -1), index, np.full(96, 96)])
    return TriangleMesh(np.vstack([ring, centre]), faces.astype(np.int32))


def projected_centroid(camera, centre, radius):
    """Centroid of the picture of a disc, from its projected outline (shoelace formula)."""
    angle = np.linspace(0, 2 * np.pi, 721)
    rim = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(721)]) * radius + centre
    x, y = camera.project(rim).T
    cross = x[:-1] * y[1:] - x[1:] * y[:-1]
    return np.array([((p[:-1] + p[1:]) * cross).sum() for p in (x, y)]) / (3.0 * cross.sum())


def test_depth_and_coverage_agree_with_ray_casting(femur, pinhole):
    o3d = pytest.importorskip("open3d")
    renderer = Renderer(pinhole, [Part("femur", femur, MaterialId.BONE)], surfaces())
    picture = renderer.depth({"femur": POSE}, NO_LAMPS)
    scene = o3d.t.geometry.RaycastingScene(nthreads=1)
    scene.add_triangles(
        o3d.core.Tensor(np.array(femur.vertices_mm, dtype=np.float32)),
        o3d.core.Tensor(np.array(femur.faces, dtype=np.uint32)),
    )
    matrix = np.array(pinhole.matrix)
    matrix[:2, 2] += 0.5
    rays = o3d.t.geometry.RaycastingScene.create_rays_pinhole(matrix, POSE.matrix, 640, 360)
    expected = scene.cast_rays(rays)["t_hit"].numpy()
    hit = np.isfinite(expected)
    seen = picture.depth_mm > 0.0
    assert hit.sum() > 10000
    assert (hit != seen).sum() <= 5
    error = np.abs(picture.depth_mm - expected)[hit & seen]
    assert np.median(error) < 1e-4
    assert np.percentile(error, 99) < 1e-3
    assert ((picture.body == 0) == seen).all()


@pytest.mark.release
def test_a_pattern_of_dots_lands_where_the_distorted_camera_projects_it():
    rig = make_default_rig()
    places = [(x, y, 450.0) for x in (-170.0, -60.0, 70.0, 175.0) for y in (-85.0, 5.0, 90.0)]
    parts = [
        Part(f"dot{k}", disc(np.array(p), 14.0), MaterialId.STEEL) for k, p in enumerate(places)
    ]
    poses = {part.body: RigidTransform.identity("camera", part.body) for part in parts}
    for native in (rig.left, rig.right):
        # Twice as many pixels: counting them finds the middle of a dot twice as well.
        camera = native.scale(2.0)
        picture = Renderer(camera, parts, surfaces()).depth(poses, NO_LAMPS)
        expected = np.array([projected_centroid(camera, p, 14.0) for p in places])
        pinhole = Camera(camera.matrix, np.zeros(5), camera.width, camera.height)
        assert np.abs(expected - pinhole.project(np.array(places))).max() > 5.0
        for k, pixel in enumerate(expected):
            v, u = np.nonzero(picture.body == k)
            assert len(u) > 5000
            assert np.hypot(u.mean() - pixel[0], v.mean() - pixel[1]) / 2.0 < 0.05


def test_texture_sticks_to_the_body_in_both_views(femur):
    rig = make_default_rig()
    plain = surfaces(lamps=LAMPS * (1, 1, 1, 0), ambient=1.0, vignetting=0.0)
    parts = [Part("femur", femur, MaterialId.BONE)]
    moved = POSE.move((3.0, -2.0, 8.0, 0.05, -0.08, 0.1), POSE.translation_mm)
    views = []
    for camera, pose in (
        (rig.left, POSE),
        (rig.right, rig.right_from_left.rename("camera", "camera") @ POSE),
        (rig.left, moved),
    ):
        renderer = WithoutCrevices(camera, parts, plain)
        image = renderer.render({"femur": pose}, NO_LAMPS)
        views.append((camera, pose, image, renderer.depth({"femur": pose}, NO_LAMPS)))
    camera, pose, image, depth = views[0]
    v, u = (index[::37] for index in np.nonzero(depth.body == 0))
    points = pose.inverse().apply(
        camera.rays(np.column_stack([u, v])) * depth.depth_mm[v, u][:, None].astype(float)
    )
    first = image[v, u, 1]
    assert first.std() / first.mean() > 0.05
    for camera, pose, image, depth in views[1:]:
        seen = pose.apply(points)
        pixel = camera.project(seen)
        column, row = np.rint(pixel).astype(int).T
        visible = np.abs(depth.depth_mm[row, column] - seen[:, 2]) < 0.3
        assert visible.mean() > 0.6
        second = bilinear(image[..., 1], pixel[visible])
        relative = np.abs(second / first[visible] - 1.0)
        assert np.median(relative) < 0.01
        assert np.percentile(relative, 90) < 0.05


def bilinear(image, pixels):
    low = np.floor(pixels).astype(int)
    x, y = (pixels - low).T
    c, r = low.T
    top = image[r, c] * (1 - x) + image[r, c + 1] * x
    bottom = image[r + 1, c] * (1 - x) + image[r + 1, c + 1] * x
    return top * (1 - y) + bottom * y


@pytest.mark.kernel
def test_a_small_picture_agrees_with_the_reference():
    camera = Camera(np.array([[40.0, 0, 11.3], [0, 41.0, 7.6], [0, 0, 1]]), np.zeros(5), 24, 16)
    mesh = disc(np.array([0.0, 0.0, 0.1]), 90.0)
    mark = np.linspace(0.0, 1.0, len(mesh.vertices_mm))
    part = Part("plate", mesh, MaterialId.TISSUE, mark, 1.0 - 0.5 * mark)
    pose = RigidTransform.from_parts(
        "camera", "plate", rotation_from_vector((0.3, -0.4, 0.1)), (2.0, -3.0, 400.0)
    )
    look = surfaces(materials=make_material_table(0.05, 0.6))
    renderer = WithoutCrevices(camera, [part], look)
    picture = renderer.render({"plate": pose}, NO_LAMPS)
    depth = renderer.depth({"plate": pose}, NO_LAMPS)
    seen = np.argwhere(without_rim(depth.body == 0))
    assert len(seen) > 100
    lamps = np.array(LAMPS)
    lamps[:, :3] /= np.linalg.norm(lamps[:, :3], axis=1, keepdims=True)
    lamps[:, :3] = pose.inverse().rotate(lamps[:, :3])
    for v, u in seen[::5]:
        ray = camera.rays(np.array([[u, v]]))[0]
        point = pose.inverse().apply(ray * float(depth.depth_mm[v, u]))
        corners = mesh.vertices_mm[mesh.faces]
        flat = np.concatenate([corners[..., :2], np.ones((*corners.shape[:2], 1))], axis=2)
        weights = np.linalg.solve(flat.transpose(0, 2, 1), np.append(point[:2], 1.0)[None, :, None])
        face = int(weights[..., 0].min(axis=1).argmax())
        corner_mark = mark[mesh.faces[face]] @ weights[face, :, 0]
        expected = shading_reference.pixel(
            look, MaterialId.TISSUE, lamps, point, pose.inverse().translation_mm, corner_mark
        )
        middle = np.array([u - 11.5, v - 7.5])
        dim = 1.0 - look.vignetting * (middle @ middle) / (0.25 * (24**2 + 16**2))
        expected = expected * (1.0 - 0.5 * corner_mark) * dim
        np.testing.assert_allclose(picture[v, u], expected, rtol=5e-3, atol=1e-3)


@pytest.mark.parametrize("turn_deg", [60.0, 75.0, 82.0])
def test_a_flank_looks_as_the_mean_of_a_finer_picture(turn_deg):
    """A pixel has an area: pictures of nine times as many pixels, averaged, show the same."""
    wide = Camera(
        np.array([[1400.0, 0, 79.5], [0, 1400.0, 59.5], [0, 0, 1]]), np.zeros(5), 160, 120
    )
    # One triangle: on a border between two, nine places would do.
    corners = np.array([[-100.0, -100, 0], [-100, 300, 0], [300, -100, 0]])
    part = Part("plate", TriangleMesh(corners, np.array([[0, 1, 2]], np.int32)), MaterialId.BONE)
    axis = np.array([0.8, 0.6, 0.0])
    poses = {
        "plate": RigidTransform.from_parts(
            "camera", "plate", rotation_from_vector(np.radians(turn_deg) * axis), (0, 0, 450)
        )
    }
    matt = surfaces(lamps=LAMPS * (1, 1, 1, 0), ambient=1.0, vignetting=0.0)
    n = 9
    matrix = np.diag([n, n, 1.0]) @ wide.matrix
    matrix[:2, 2] += (n - 1) / 2
    fine = Camera(matrix, np.zeros(5), n * wide.width, n * wide.height)
    picture, finer = (
        WithoutCrevices(camera, [part], matt).render(poses, NO_LAMPS)[..., 1]
        for camera in (wide, fine)
    )
    mean = finer.reshape(wide.height, n, wide.width, n).mean(axis=(1, 3))
    inside = slice(50, 70), slice(65, 95)
    assert mean[inside].min() > 0.05
    error = picture[inside] - mean[inside]
    assert error.std() < 0.2 * mean[inside].std()


@pytest.mark.parametrize("centre_mm", [(0.0, 0.0, 480.0), (25.0, 10.0, 370.0)])
def test_an_edge_looks_as_the_mean_of_a_finer_picture(femur, pinhole, centre_mm):
    """Of a bone before or behind what does not move, and before nothing."""
    n, half = 5, pinhole.scale(0.5)
    wall = disc(np.array(centre_mm), 100.0 if centre_mm[2] > 400.0 else 20.0)
    parts = [Part("femur", femur, MaterialId.BONE), Part("drape", wall, MaterialId.BONE)]
    poses = {"femur": POSE, "drape": RigidTransform.identity("camera", "drape")}
    matrix = np.diag([n, n, 1.0]) @ half.matrix
    matrix[:2, 2] += (n - 1) / 2
    fine = Camera(matrix, np.zeros(5), n * half.width, n * half.height)
    matt = surfaces(lamps=LAMPS * (1, 1, 1, 0), ambient=1.0, vignetting=0.0)
    picture, finer = (
        WithoutCrevices(camera, parts, matt, frozenset({"drape"})).render(poses, NO_LAMPS)[..., 1]
        for camera in (half, fine)
    )
    mean = finer.reshape(half.height, n, half.width, n).mean(axis=(1, 3))
    body = Renderer(half, parts, matt).depth(poses, NO_LAMPS).body
    rims = [~without_rim(body == k) & ~without_rim(body != k) for k in (0, 1)]
    for rim in rims:
        assert rim.sum() > 100
        assert np.abs(picture - mean)[rim].mean() < 0.023 * mean[rim].std()


def test_a_crevice_is_as_dark_to_one_eye_as_to_the_other(femur):
    rig = make_default_rig()
    plain = surfaces(lamps=LAMPS * (1, 1, 1, 0), ambient=1.0, vignetting=0.0)
    wall = disc(np.array([0.0, 0.0, 470.0]), 200.0)
    parts = [Part("femur", femur, MaterialId.BONE), Part("drape", wall, MaterialId.BONE)]
    right_from_left = rig.right_from_left.rename("camera", "camera")
    light = []
    for camera, seen_from in ((rig.left, NO_LAMPS), (rig.right, right_from_left)):
        poses = {"femur": POSE, "drape": RigidTransform.identity("camera", "drape")}
        poses = {
            body: right_from_left @ pose if camera is rig.right else pose
            for body, pose in poses.items()
        }
        lit, unlit = (
            kind(camera, parts, plain).render(poses, seen_from)[..., 1]
            for kind in (Renderer, WithoutCrevices)
        )
        depth = Renderer(camera, parts, plain).depth(poses, seen_from)
        light.append((lit / np.maximum(unlit, 1e-6), depth.depth_mm, without_rim(depth.body == 0)))
    left, depth_mm, is_bone = light[0]
    v, u = (index[::37] for index in np.nonzero(is_bone))
    points = rig.left.rays(np.column_stack([u, v])) * depth_mm[v, u][:, None].astype(float)
    seen = right_from_left.apply(points)
    pixel = rig.right.project(seen)
    column, row = np.rint(pixel).astype(int).T
    right, right_mm, is_bone = light[1]
    visible = is_bone[row, column] & (np.abs(right_mm[row, column] - seen[:, 2]) < 0.3)
    assert visible.sum() > 500
    assert left[v, u].min() < 0.8
    apart = np.abs(bilinear(right, pixel[visible]) - left[v, u][visible])
    assert np.percentile(apart, 95) < 0.01


def test_what_is_kept_gives_the_same_picture(femur, pinhole):
    wall = disc(np.array([0.0, 0.0, 480.0]), 300.0)
    parts = [Part("femur", femur, MaterialId.BONE), Part("drape", wall, MaterialId.DRAPE)]
    poses = {"femur": POSE, "drape": RigidTransform.identity("camera", "drape")}
    kept = Renderer(pinhole, parts, surfaces(), frozenset({"drape"}))
    fresh = Renderer(pinhole, parts, surfaces())
    aside = poses | {"femur": POSE.move((60.0, 20.0, 0, 0, 0, 0), POSE.translation_mm)}
    kept.render(aside, NO_LAMPS)
    bone = fresh.depth(poses, NO_LAMPS).body == 0
    outside = without_rim(~bone)
    picture, at_once = kept.render(poses, NO_LAMPS), fresh.render(poses, NO_LAMPS)
    np.testing.assert_array_equal(picture[bone], at_once[bone])
    np.testing.assert_array_equal(
        kept.depth(poses, NO_LAMPS).depth_mm, fresh.depth(poses, NO_LAMPS).depth_mm
    )
    # Nothing of the earlier position is left.
    empty = kept.render(
        {
            "femur": RigidTransform.from_parts("camera", "femur", np.eye(3), (0.0, 0.0, -500.0)),
            "drape": poses["drape"],
        },
        NO_LAMPS,
    )
    np.testing.assert_array_equal(picture[outside], empty[outside])
