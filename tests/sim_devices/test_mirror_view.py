"""The simulated mirror: light's laws, and that forward and backward rays agree."""

import dataclasses

import numpy as np
import pytest

from navapp.geometry.transform import RigidTransform, rotation_from_vector
from sim_devices.mirror_optics import MirrorSetup
from sim_devices.mirror_setups import HEIGHT_PX, WIDTH_PX, draw_setup, look_at_site, make_eye_camera
from sim_devices.mirror_view import MirrorView, expose
from sim_devices.sheet import PrintedSheet
from tests.many import few_of

pytestmark = pytest.mark.kernel


def view_of(setup: MirrorSetup, size: int = 240, focal_px: float = 2600.0) -> MirrorView:
    return MirrorView(setup, make_eye_camera(size, size, focal_px), look_at_site(setup))


def spot_on(columns: int, rows: int) -> np.ndarray:
    image = np.zeros((HEIGHT_PX, WIDTH_PX), np.uint8)
    image[rows - 3 : rows + 4, columns - 3 : columns + 4] = 255
    return image


def looked_at(view: MirrorView) -> tuple[int, int]:
    """The monitor's pixel in the middle of the view: a straight map is near enough."""
    first = np.array([[0.5 * WIDTH_PX, 0.5 * HEIGHT_PX]])
    seen = view.screen_px(first)
    steps = np.vstack([view.screen_px(first + step) - seen for step in np.eye(2)]).T
    middle = 0.5 * (view.camera.width - 1)
    u, v = np.rint(first[0] + np.linalg.solve(steps, middle - seen[0])).astype(int)
    return int(u), int(v)


def centroid(picture: np.ndarray) -> np.ndarray:
    v, u = np.mgrid[: picture.shape[0], : picture.shape[1]]
    weights = picture / picture.sum()
    return np.array([(u * weights).sum(), (v * weights).sum()])


@pytest.mark.parametrize("seed", few_of(range(6), 2))
def test_a_lit_pixel_is_seen_where_its_ray_arrives(seed: int) -> None:
    setup = draw_setup(np.random.default_rng(seed))
    panel = dataclasses.replace(setup.panel, black_share=0.0)
    plate = dataclasses.replace(setup.plate, back_reflection=0.0)
    view = view_of(dataclasses.replace(setup, panel=panel, plate=plate))
    u, v = looked_at(view)
    picture = view.render(spot_on(u, v), n_samples=12)[:, :, 0]
    np.testing.assert_allclose(centroid(picture), view.screen_px(np.array([[u, v]]))[0], atol=0.02)


@pytest.mark.parametrize("seed", few_of(range(6), 2))
def test_a_mark_of_the_site_is_seen_where_its_ray_arrives(seed: int) -> None:
    setup = draw_setup(np.random.default_rng(seed))
    view = view_of(setup)
    white = np.zeros((400, 400), np.uint8)
    white[180:220, 180:220] = 255
    sheet = PrintedSheet(white, 20.0, -10.0, -10.0)
    pose = look_at_site(setup).inverse()
    # Turned, so that its edges cross the grid of samples everywhere.
    turn = pose.rotation @ rotation_from_vector((0.0, 0.0, 0.3))
    left_from_sheet = RigidTransform.from_parts("left", "sheet", turn, setup.site_mm)
    picture = view.see_sheet(sheet, left_from_sheet)
    seen = centroid(np.maximum(picture - 0.12, 0.0))
    np.testing.assert_allclose(seen, view.site_px(setup.site_mm[None])[0], atol=0.02)


def test_rays_to_the_site_obey_snell() -> None:
    setup = draw_setup(np.random.default_rng(3))
    points = setup.site_mm + np.random.default_rng(4).uniform(-60.0, 60.0, (20, 3))
    directions = setup.directions_to_site(points, setup.eye_mm)
    plate = setup.plate
    n = plate.normal
    for point, direction in zip(points, directions, strict=True):
        cosine = direction @ n
        entry = setup.eye_mm + direction * ((plate.front_mm - setup.eye_mm) @ n) / cosine
        aside = (direction - cosine * n) / plate.refractive_index
        inside = aside + n * np.sqrt(1.0 - aside @ aside)
        leaving = entry + inside * plate.thickness_mm / (inside @ n)
        off = np.cross(point - leaving, direction)
        assert np.linalg.norm(off) < 1e-9


def test_rays_to_the_monitor_are_reflected() -> None:
    setup = draw_setup(np.random.default_rng(5))
    pixels = np.random.default_rng(6).uniform(0.0, 1000.0, (20, 2))
    directions = setup.directions_to_pixels(pixels, setup.eye_mm)
    n = setup.plate.normal
    entry = setup.eye_mm + directions * (
        ((setup.plate.front_mm - setup.eye_mm) @ n) / (directions @ n)
    )[:, None]  # fmt: skip
    mirrored = directions - 2.0 * (directions @ n)[:, None] * n
    lit = setup.panel.points_mm(pixels)
    assert np.abs(np.cross(lit - entry, mirrored)).max() < 1e-9
    # The monitor is on the eye's side of the plate, and shows its front.
    assert (((setup.plate.front_mm - lit) @ n) > 0.0).all()
    assert (mirrored @ np.cross(setup.panel.across, setup.panel.down) > 0.0).all()


def test_light_adds_up_and_the_back_face_sends_a_ghost() -> None:
    setup = draw_setup(np.random.default_rng(7))
    view = view_of(setup, 64, 600.0)
    plate, panel = setup.plate, setup.panel
    white = np.full((HEIGHT_PX, WIDTH_PX), 255, np.uint8)
    site = np.full((64, 64), 0.5, np.float32)
    screen = view.render(white)
    share = plate.front_reflection + plate.back_reflection
    np.testing.assert_allclose(screen[32, 32, 0], share * panel.white_cd_m2, rtol=1e-5)
    both = view.render(white, site)
    added = plate.transmission * setup.site_lx / np.pi * 0.5
    np.testing.assert_allclose(both - screen, added, rtol=1e-4)


def test_the_ghost_lies_beside_the_picture() -> None:
    setup = draw_setup(np.random.default_rng(8))
    plate = dataclasses.replace(setup.plate, thickness_mm=3.0, back_reflection=0.1)
    setup = dataclasses.replace(
        setup, plate=plate, panel=dataclasses.replace(setup.panel, black_share=0.0)
    )
    view = view_of(setup, 700, 1500.0)
    picture = view.render(spot_on(960, 540), n_samples=2)[:, :, 0]
    lit = np.argwhere(picture > 0.0)
    main = view.screen_px(np.array([[960.0, 540.0]]))[0]
    far = np.linalg.norm(lit[:, ::-1] - main, axis=1)
    ghost = picture[tuple(lit[far > 8.0].T)]
    # 2 t tan b cos a, some 2 mm at 45 degrees: 5 to 9 px here.
    assert 5.0 < far.max() < 16.0
    assert picture[tuple(lit[far < 2.0].T)].max() > 3.0 * (ghost.max() if len(ghost) else 0.0)


def test_a_picture_of_another_size_is_refused() -> None:
    view = view_of(draw_setup(np.random.default_rng(9)), 16)
    with pytest.raises(ValueError, match="1920x1080"):
        view.render(np.zeros((10, 10), np.uint8))


def test_exposure_scales_and_clips() -> None:
    light = np.array([[[50.0], [500.0]]], np.float32)
    np.testing.assert_array_equal(expose(light, 100.0, noise=0.0), [[[128], [255]]])
