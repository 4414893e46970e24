"""An eye that looks into a half-silvered mirror above the simulated site."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.camera import Camera
from navapp.geometry.transform import RigidTransform
from sim_devices.mirror_optics import MirrorSetup
from sim_devices.mirror_setups import look_at_site, make_eye_camera
from sim_devices.mirror_view import MirrorView
from sim_devices.sensor import make_tone_table

# Of the picture: its size, and how much wider than the panel's image it is.
EYE_WIDTH, EYE_HEIGHT, _MARGIN = 480, 300, 1.02
# Luminance that is white to the eye.
_WHITE_CD_M2 = 80.0
# No thin line of the panel falls between two rays.
_N_SAMPLES = 2


class RendersForCameras(Protocol):
    """The part of a world that an eye sees."""

    def render_for(
        self, camera: Camera, seen_from: RigidTransform, time_ns: int
    ) -> NDArray[np.float32]:
        """(H, W, 3) BGR linear radiance as a camera sees it that stands somewhere."""
        ...


class SimulatedEye:
    """What an eye sees in a mirror: the site through the plate, and the monitor's light.

    Args:
        world: behind the plate.
        setup: of eye, plate, and monitor.
        width: of the pictures, px.
        height: likewise.
        n_samples: rays along each side of a pixel that go to the monitor.
    """

    def __init__(
        self,
        world: RendersForCameras,
        setup: MirrorSetup,
        width: int = EYE_WIDTH,
        height: int = EYE_HEIGHT,
        n_samples: int = _N_SAMPLES,
    ) -> None:
        self._world, self._n_samples = world, n_samples
        panel = setup.panel
        distance_mm = float(np.linalg.norm(setup.site_mm - setup.eye_mm))
        focal_px = width * distance_mm / (_MARGIN * panel.width_px * panel.pitch_mm)
        self.view = MirrorView(setup, make_eye_camera(width, height, focal_px), look_at_site(setup))
        moved = RigidTransform.from_parts("left", "left", np.eye(3), setup.shift_of_site_mm())
        self._seen_from = self.view.eye_from_left @ moved

    def render_site(self, time_ns: int) -> NDArray[np.float32]:
        """(H, W, 3) BGR reflected light of the site, before the plate takes its share.

        The site is moved by what the plate shifts its middle: elsewhere that is a part of a pixel
        off.
        """
        return self._world.render_for(self.view.camera, self._seen_from, time_ns)

    def expose(
        self, site: NDArray[np.float32], screen_image_bgr: NDArray[np.uint8] | None
    ) -> NDArray[np.uint8]:
        """(H, W, 3) BGR picture of a site, as `render_site` gives it, and a monitor's picture.

        Args:
            site: (H, W, 3), of this eye.
            screen_image_bgr: (h, w, 3) that the monitor is handed; None: it is off.
        """
        light = self.view.render(screen_image_bgr, site, self._n_samples)
        table = make_tone_table(1.0)
        steps = np.minimum(light * np.float32((len(table) - 1) / _WHITE_CD_M2), len(table) - 1)
        picture: NDArray[np.uint8] = table[steps.astype(np.int16)]
        return picture
