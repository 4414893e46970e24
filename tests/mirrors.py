"""The display model that a simulated set-up truly is; nobody but tests and benches may know it."""

import numpy as np

from navapp.geometry.display_model import DisplayModel
from navapp.geometry.display_model_optics import Glass, VirtualScreen
from sim_devices.mirror_optics import MirrorSetup


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
