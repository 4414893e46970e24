"""A simulated eye in front of the mirror: what it sees, and where it would put a cross."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.transform import FloatArray, RigidTransform
from sim_devices.mirror_optics import MirrorSetup
from sim_devices.mirror_setups import look_at_site, make_eye_camera
from sim_devices.mirror_view import MirrorView, expose
from sim_devices.sheet import PrintedSheet

# Of a head that is held still: 95 % of its places within 3 mm of their mean.
WANDER_SD_MM = 3.0 / 2.7955
_WIDTH_PX, _HEIGHT_PX = 160, 107
# Half of the width that it looks at, mm, and how far a cross may be away for that, px of the panel.
_ZOOMS = ((7.0, 18.0), (30.0, 80.0), (110.0, 320.0), (300.0, np.inf))
_FROM_AFAR_MM = 130.0
_SITE_LX, _WHITE_CD_M2 = 400.0, 110.0
_LIT = 40


class AligningEye:
    """Looks into the mirror from about one place, from another one at every look.

    Args:
        setup: of plate, monitor and site.
        seed: of its places and of how well it aligns.
        alignment_sd_px: of a cross, each coordinate.
    """

    def __init__(self, setup: MirrorSetup, seed: int, alignment_sd_px: float) -> None:
        self.setup = replace(setup, site_lx=_SITE_LX)
        self._seed, self._sd_px = seed, alignment_sd_px

    def aim_px(self, point_mm: FloatArray, look: int) -> FloatArray:
        """(2,) px of the monitor's picture where it puts a cross on a point (3,)."""
        eye_mm, off_px = self._draw(look)
        directions = self.setup.directions_to_site(point_mm[None], eye_mm)
        aimed: FloatArray = self.setup.pixels_in_directions(directions, eye_mm)[0] + off_px
        return aimed

    def see(
        self,
        shown_bgr: NDArray[np.uint8],
        sheet: PrintedSheet,
        left_from_sheet: RigidTransform,
        point_mm: FloatArray,
        look: int,
    ) -> NDArray[np.uint8]:
        """(107, 160, 3) BGR: a sheet at the site and what the monitor shows, around a point (3,).

        The nearer the light is to the point, the nearer it looks; from afar the point is marked
        with a yellow ring and the middle of the light with a green one.
        """
        eye_mm, _ = self._draw(look)
        lit_px = _middle_of_light(shown_bgr)
        half_mm = self._zoom_mm(lit_px, point_mm, eye_mm)
        distance_mm = float(np.linalg.norm(point_mm - eye_mm))
        # The middle of the picture is where the point is seen through the plate.
        ahead = self.setup.directions_to_site(point_mm[None], eye_mm)[0]
        around = replace(self.setup, eye_mm=eye_mm, site_mm=eye_mm + distance_mm * ahead)
        camera = make_eye_camera(_WIDTH_PX, _HEIGHT_PX, 0.5 * _WIDTH_PX * distance_mm / half_mm)
        view = MirrorView(around, camera, look_at_site(around))
        site = np.repeat(view.render(None, view.see_sheet(sheet, left_from_sheet)), 3, axis=2)
        if lit_px is not None:
            site[:, :, 1:2] += view.render(np.ascontiguousarray(shown_bgr[:, :, 1]))
        picture = expose(site, _WHITE_CD_M2, noise=0.0)
        if lit_px is not None and half_mm > _ZOOMS[0][0]:
            _draw_ring(picture, view.site_px(point_mm[None])[0], (0, 220, 255))
            _draw_ring(picture, view.screen_px(lit_px[None])[0], (80, 255, 80))
        return picture

    def _draw(self, look: int) -> tuple[FloatArray, FloatArray]:
        """(3,) mm where it is at a look, (2,) px by which it misses."""
        rng = np.random.default_rng([self._seed, look])
        eye_mm = self.setup.eye_mm + rng.normal(0.0, WANDER_SD_MM, 3)
        return eye_mm, rng.normal(0.0, self._sd_px, 2)

    def _zoom_mm(
        self, lit_px: FloatArray | None, point_mm: FloatArray, eye_mm: FloatArray
    ) -> float:
        if lit_px is None:
            return _FROM_AFAR_MM
        directions = self.setup.directions_to_site(point_mm[None], eye_mm)
        aim_px = self.setup.pixels_in_directions(directions, eye_mm)[0]
        far_px = float(np.linalg.norm(lit_px - aim_px))
        return next(half_mm for half_mm, limit_px in _ZOOMS if far_px <= limit_px)


def _middle_of_light(shown_bgr: NDArray[np.uint8]) -> FloatArray | None:
    """(2,) px; None when the monitor is dark."""
    lit = shown_bgr[:, :, 1] > _LIT
    columns, rows = np.flatnonzero(lit.any(axis=0)), np.flatnonzero(lit.any(axis=1))
    if len(columns) == 0:
        return None
    return 0.5 * np.array([columns[0] + columns[-1], rows[0] + rows[-1]], dtype=np.float64)


def _draw_ring(
    picture: NDArray[np.uint8], middle_px: FloatArray, colour: tuple[int, int, int]
) -> None:
    v, u = np.mgrid[: picture.shape[0], : picture.shape[1]]
    off = np.hypot(u - middle_px[0], v - middle_px[1])
    picture[(off > 6.0) & (off < 9.0)] = colour
