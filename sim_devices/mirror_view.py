"""What a camera at the eye's place sees: the site through the plate, the monitor by its faces."""

import math

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.camera import Camera
from navapp.geometry.transform import FloatArray, RigidTransform
from sim_devices.mirror_kernels import reflect_screen, see_sheet
from sim_devices.mirror_optics import MirrorSetup
from sim_devices.pixel_rays import corner_rays
from sim_devices.sheet import PrintedSheet

_INK, _PAPER, _TABLE = 0.05, 0.8, 0.1
_N_SCREEN_SAMPLES, _N_SHEET_SAMPLES = 4, 3


class MirrorView:
    """A camera that looks into the mirror.

    Args:
        setup: of plate, monitor and site.
        camera: pinhole, distortion as it likes.
        eye_from_left: where it stands.
    """

    def __init__(self, setup: MirrorSetup, camera: Camera, eye_from_left: RigidTransform) -> None:
        self.setup, self.camera, self.eye_from_left = setup, camera, eye_from_left
        turn, self._eye_mm = eye_from_left.inverse_parts()
        self._turn = np.ascontiguousarray(turn)

    def render(
        self,
        screen_image_bgr: NDArray[np.uint8] | None,
        site_reflectance: NDArray[np.float32] | None = None,
        n_samples: int = _N_SCREEN_SAMPLES,
    ) -> NDArray[np.float32]:
        """(H, W, C) luminance in cd/m^2: the light of both, added.

        Args:
            screen_image_bgr: (h, w) or (h, w, C) that the monitor is handed; None: it is off.
            site_reflectance: (H, W) or (H, W, C) as seen from this camera through the plate; None:
                dark.
            n_samples: rays along each side of a pixel that go to the monitor.
        """
        plate, panel = self.setup.plate, self.setup.panel
        seen = (screen_image_bgr, site_reflectance)
        n_channels = max(1 if one is None or one.ndim == 2 else one.shape[2] for one in seen)
        shape = (self.camera.height, self.camera.width, n_channels)
        picture = np.zeros(shape, np.float32)
        if screen_image_bgr is not None:
            place = np.vstack(
                [
                    panel.origin_mm,
                    panel.across / panel.pitch_mm,
                    panel.down / panel.pitch_mm,
                    np.cross(panel.across, panel.down),
                ]
            )
            reflect_screen(
                corner_rays(self.camera), self._turn, self._eye_mm, self._plate_rows(), place,
                self._luminance(screen_image_bgr, n_channels), n_samples, picture,
            )  # fmt: skip
        if site_reflectance is not None:
            light = plate.transmission * self.setup.site_lx / math.pi
            picture += np.float32(light) * site_reflectance.reshape(*picture.shape[:2], -1)
        return picture

    def see_sheet(
        self, sheet: PrintedSheet, left_from_sheet: RigidTransform, n: int = _N_SHEET_SAMPLES
    ) -> NDArray[np.float32]:
        """(H, W) reflectance of a printed sheet above a table, as seen through the plate."""
        share = sheet.white.astype(np.float32) / np.float32(255.0)
        texture = np.float32(_INK) + np.float32(_PAPER - _INK) * share
        half = 0.5 / sheet.px_per_mm
        first = left_from_sheet.apply(np.array([sheet.left_mm + half, sheet.top_mm + half, 0.0]))
        axes = left_from_sheet.rotation
        place = np.vstack(
            [first, sheet.px_per_mm * axes[:, 0], sheet.px_per_mm * axes[:, 1], axes[:, 2]]
        )
        picture = np.empty((self.camera.height, self.camera.width), np.float32)
        see_sheet(
            corner_rays(self.camera), self._turn, self._eye_mm, self._plate_rows(), place,
            texture, n, _TABLE, picture,
        )  # fmt: skip
        return picture

    def site_px(self, points_mm: FloatArray) -> FloatArray:
        """(N, 2) where points (N, 3) of the site appear in the picture."""
        return self._px(self.setup.directions_to_site(points_mm, self._eye_mm))

    def screen_px(self, pixels: FloatArray) -> FloatArray:
        """(N, 2) where pixels (N, 2) of the monitor's picture appear in the camera's."""
        return self._px(self.setup.directions_to_pixels(pixels, self._eye_mm))

    def _px(self, directions: FloatArray) -> FloatArray:
        return self.camera.project(self.eye_from_left.rotate(directions))

    def _plate_rows(self) -> FloatArray:
        plate = self.setup.plate
        return np.array(
            [
                plate.front_mm,
                plate.normal,
                [plate.thickness_mm, plate.refractive_index, 0.0],
                [plate.front_reflection, plate.back_reflection, 0.0],
            ]
        )

    def _luminance(self, image: NDArray[np.uint8], n_channels: int) -> NDArray[np.float32]:
        """(h, w, C) as lit, pixel by pixel of the panel."""
        panel = self.setup.panel
        if image.shape[:2] != (panel.height_px, panel.width_px):
            raise ValueError(f"the monitor takes {panel.width_px}x{panel.height_px} px")
        values = np.linspace(0.0, 1.0, 256) ** panel.gamma
        lit = panel.white_cd_m2 * (panel.black_share + (1.0 - panel.black_share) * values)
        shown = lit.astype(np.float32)[image.reshape(*image.shape[:2], -1)]
        shown = np.broadcast_to(shown, (*image.shape[:2], n_channels))
        columns = slice(None, None, -1 if panel.flips_columns else 1)
        rows = slice(None, None, -1 if panel.flips_rows else 1)
        return np.ascontiguousarray(shown[rows, columns])


def expose(
    luminance: NDArray[np.float32], white_cd_m2: float, noise: float = 1.0, seed: int = 0
) -> NDArray[np.uint8]:
    """(H, W, C) uint8 picture; that luminance is white, the noise is one of grey values."""
    values = luminance * np.float32(255.0 / white_cd_m2)
    if noise > 0.0:
        drawn = np.random.default_rng(seed).standard_normal(values.shape, dtype=np.float32)
        values = values + np.float32(noise) * drawn
    picture: NDArray[np.uint8] = np.clip(np.rint(values), 0, 255).astype(np.uint8)
    return picture
