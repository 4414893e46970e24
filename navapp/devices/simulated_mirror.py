"""A display in a simulated half-silvered mirror: its model, and what an eye sees there."""

from dataclasses import replace
from datetime import date, timedelta

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock
from navapp.geometry.display_model import DisplayModel, DisplayQuality
from navapp.geometry.display_model_errors import EYE_DISTANCE_MM
from navapp.geometry.display_model_optics import Glass, VirtualScreen
from navapp.geometry.transform import FloatArray
from navapp.values.pictures import Look
from sim_devices.camera import SimulatedCamera
from sim_devices.display import SimulatedDisplay
from sim_devices.mirror_optics import MirrorSetup
from sim_devices.mirror_setups import make_practice_setup
from sim_devices.rigs import make_default_rig
from sim_devices.simulated_eye import SimulatedEye
from sim_devices.world import World

# Standard deviations of the numbers of `DisplayModel.move`, of a careful calibration.
_DEVIATIONS = (
    *(0.0003, 0.0003, 0.0002), *(0.06, 0.06, 0.2), 0.0002, 0.03, 0.05, *(0.002, 0.002), *(0.5,) * 3
)  # fmt: skip
_VALID_DAYS = 30
_NEAR_MM = 40.0


def make_practice_display(today: date) -> DisplayModel:
    """The display of the built-in simulated mirror, as a calibration for the left eye tells it.

    Nothing is calibrated: its places are the true ones, its record is what a calibration reaches.

    Args:
        today: day of the record.
    """
    setup = make_practice_setup(make_default_rig())
    other_mm = setup.eye_mm + EYE_DISTANCE_MM * setup.right
    model = replace(
        true_display(setup), viewing_eye="left", other_eye_mm=other_mm, display_name="sim:display"
    )
    covariance: FloatArray = np.diag(np.square(_DEVIATIONS))
    quality = DisplayQuality(True, made_on=today, covariance=covariance)
    near = setup.site_mm + _NEAR_MM * np.vstack([np.zeros(3), np.eye(3), -np.eye(3)])
    error_mm = float(replace(model, quality=quality).predict_error(near).max())
    distance_mm = float(np.linalg.norm(setup.site_mm - setup.eye_mm))
    record = replace(
        quality,
        error_mm=error_mm,
        error_arcmin=float(np.degrees(error_mm / distance_mm)) * 60.0,
        expires_on=today + timedelta(days=_VALID_DAYS),
    )
    return replace(model, quality=record)


def true_display(setup: MirrorSetup) -> DisplayModel:
    """The monitor reflected at the front face, and the eye's reading of it."""
    plate, panel = setup.plate, setup.panel
    corners = panel.points_mm(np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]))
    above = (corners - plate.front_mm) @ plate.normal
    seen = corners - 2.0 * above[:, None] * plate.normal
    across, down = (seen[1:] - seen[0]) / panel.pitch_mm
    screen = VirtualScreen(
        seen[0], across / np.linalg.norm(across), down / np.linalg.norm(down), panel.pitch_mm,
        panel.width_px, panel.height_px,
    )  # fmt: skip
    ahead = setup.site_mm - setup.eye_mm
    below = np.cross(ahead, setup.right)
    return DisplayModel(
        screen,
        Glass(plate.thickness_mm, plate.normal, plate.refractive_index),
        setup.eye_mm,
        bool(across @ setup.right < 0.0),
        bool(down @ below < 0.0),
    )


def make_look(
    world: World, camera: SimulatedCamera, display: SimulatedDisplay, clock: Clock
) -> Look:
    """What the eye of the built-in mirror sees of the site and of a display, whenever it looks.

    Args:
        world: of the site.
        camera: whose pictures begin with the world's time.
        display: that is seen in the mirror.
        clock: of camera and display.
    """
    eye = SimulatedEye(world, make_practice_setup(world.rig))

    def look() -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
        shown = display.visible_image()
        site = eye.render_site(camera.world_time_ns(clock.now_ns()))
        return eye.expose(site, shown), eye.expose(site, None)

    return look
