"""Pictures of a simulated set-up as a person would take them for its calibration."""

import numpy as np

from calibration.mirror.seen_views import Scene
from calibration.mirror.view_detection import ViewPictures
from navapp.devices.simulated_board import print_board
from navapp.geometry.camera import Camera
from navapp.geometry.rectification import luma
from sim_devices.mirror_optics import MirrorSetup
from sim_devices.mirror_view import MirrorView, expose
from sim_devices.sensor import SensorModel
from sim_devices.sheet import PrintedSheet, SheetScene
from tests.calibration.mirror.simulated_views import board_pose, eye_pose

SHEETS: dict[str, PrintedSheet] = {}


def take_view(
    rng: np.random.Generator, setup: MirrorSetup, scene: Scene, camera: Camera, number: int
) -> tuple[ViewPictures, np.ndarray]:
    """The four pictures of one view, and (3,) where the camera stood."""
    sheet = SHEETS.setdefault(str(scene.board), print_board(scene.board))
    view = MirrorView(setup, camera, eye_pose(rng, setup, number))
    pose = board_pose(rng, setup, scene.board)
    plate, panel = setup.plate, setup.panel
    site = view.render(None, view.see_sheet(sheet, pose))
    screen = view.render(scene.pattern.draw(), n_samples=3)
    # Exposed for the paper, and for the display.
    site_white = 1.2 * plate.transmission * setup.site_lx / np.pi
    screen_white = 1.2 * plate.front_reflection * panel.white_cd_m2
    room, sensor = SheetScene(sheet, lambda _: pose, scene.rig), SensorModel(seed=number)
    stereo = [luma(sensor.picture(room.render(eye, 0), eye, number)) for eye in ("left", "right")]
    seeds = rng.integers(0, 2**31, 2)
    return ViewPictures(
        number,
        expose(site, site_white, seed=int(seeds[0]))[:, :, 0],
        expose(screen, screen_white, seed=int(seeds[1]))[:, :, 0],
        *stereo,
        is_eye=number % 2 == 0,
    ), view.eye_from_left.inverse().translation_mm
