"""An operator who aligns crosses with one eye in front of a simulated mirror."""

import numpy as np

from calibration.mirror.alignment_fit import Alignments
from calibration.mirror.alignment_start import AlignedDisplay
from calibration.mirror.alignments import (
    FEWEST_ALIGNMENTS,
    MOST_ALIGNMENTS,
    AlignedCalibration,
    choose_next,
    choose_spread,
    solve_alignments,
)
from navapp.devices.simulated_mirror import true_display
from navapp.geometry.display_model import DisplayModel
from sim_devices.mirror_optics import MirrorSetup
from sim_devices.mirror_setups import HEIGHT_PX, PITCH_MM, WIDTH_PX

# 95 % of the places of the eye lie within 3 mm of their mean.
WANDER_SD_MM = 3.0 / 2.7955
POINT_SD_MM = 0.06


def _thickness_as_told(setup: MirrorSetup) -> float:
    """As a person knows it: to a whole millimetre."""
    return float(max(1, round(setup.plate.thickness_mm)))


class SimulatedOperator:
    """Aligns points of a board that is put at four heights around the site.

    Args:
        setup: the mirror.
        rng: of all that is drawn.
        alignment_sd_px: of a cross, each coordinate.
    """

    def __init__(
        self, setup: MirrorSetup, rng: np.random.Generator, alignment_sd_px: float
    ) -> None:
        self.true: DisplayModel = true_display(setup)
        self._setup, self._rng, self._sd_px = setup, rng, alignment_sd_px
        ahead = setup.site_mm - setup.eye_mm
        ahead /= np.linalg.norm(ahead)
        x, y = np.meshgrid(np.linspace(-45.0, 45.0, 4), np.linspace(-32.0, 32.0, 3))
        grid = x.ravel()[:, None] * setup.right + y.ravel()[:, None] * np.cross(ahead, setup.right)
        heights = np.array([-38.0, -13.0, 13.0, 38.0])
        self.points_mm = np.vstack([setup.site_mm + grid + h * ahead for h in heights])
        self.points_mm += rng.uniform(-2.0, 2.0, self.points_mm.shape)
        self.anatomy_mm = setup.site_mm + rng.uniform(-1.0, 1.0, (30, 3)) * (30.0, 30.0, 25.0)
        self.display = AlignedDisplay(
            WIDTH_PX, HEIGHT_PX, PITCH_MM * (1.0 + rng.normal(0.0, 0.001)),
            _thickness_as_told(setup), reads_upside_down=setup.reads_upside_down,
        )  # fmt: skip

    def align(self, which: int) -> tuple[np.ndarray, np.ndarray]:
        """(2,) px where the cross is put, (3,) where the stereo cameras see the point."""
        eye = self._setup.eye_mm + self._rng.normal(0.0, WANDER_SD_MM, 3)
        point = self.points_mm[which]
        pixel = self.true.project(point[None], eye)[0]
        pixel = pixel + self._rng.normal(0.0, self._sd_px, 2)
        return pixel, point + self._rng.normal(0.0, POINT_SD_MM, 3)

    def calibrate(self, most: int = MOST_ALIGNMENTS) -> tuple[AlignedCalibration, int]:
        """Follow the guidance until it is accepted or has taken long enough."""
        pixels: list[np.ndarray] = []
        points: list[np.ndarray] = []
        found: AlignedCalibration | None = None
        while True:
            if found is None:
                which = choose_spread(np.array(points).reshape(-1, 3), self.points_mm)
            else:
                which = choose_next(found, self.points_mm)
            pixel, point = self.align(which)
            pixels.append(pixel)
            points.append(point)
            n = len(pixels)
            if n < FEWEST_ALIGNMENTS:
                continue
            given = Alignments(np.array(pixels), np.array(points), np.full(n, POINT_SD_MM))
            found = solve_alignments(self.display, given, self.anatomy_mm)
            quality = found.model.quality
            if n >= most or (quality is not None and quality.is_accepted):
                return found, n
