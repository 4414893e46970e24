"""What an eye sees of crosses and lines in the mirror: how far they are from where they belong.

Pictures are of the simulated view's luminance; nothing of the drawing is known to what reads them
but the length of a cross's bars and the width of a line.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from navapp.geometry.camera import Camera
from navapp.geometry.transform import FloatArray, RigidTransform
from sim_devices.mirror_optics import MirrorSetup
from sim_devices.mirror_view import MirrorView

EYE_FOCAL_PX = 5000.0
Picture = NDArray[np.float32]

# The ghost of the plate's second face is a fiftieth of the picture.
_READ_ABOVE = 0.06
# Of the light of a full pixel: what is darker is no line.
_DRAWN_ABOVE = 0.15
# Of a bar's mean light along it: a quarter of it is lit.
_BAR_ABOVE = 0.15
_STEP_PX = 0.25
# The light of a line is taken together over so much of it: it is lit in squares of 0.28 mm.
_TOGETHER_MM, _N_TOGETHER = 1.0, 9
_ACROSS_MM = 1.6
# How far a cross's bars reach on each side, and from where only one of them is lit.
_BAR_MM, _MIDDLE_MM = 3.0, 0.7
# In the middle of a bar there is a pixel with nearly full light, but at its ends and in gaps.
_WHOLE_ABOVE = 0.5


@dataclass(frozen=True, eq=False)
class Sight:
    """An eye that looks into the mirror; its pixels lie on rays, whatever part is rendered."""

    setup: MirrorSetup
    eye_from_left: RigidTransform

    @property
    def eye_mm(self) -> FloatArray:
        """(3,) in the left camera's frame."""
        return self.eye_from_left.inverse().translation_mm

    def px(self, points_mm: FloatArray) -> FloatArray:
        """(n, 2) where points (n, 3) of the left camera's frame are seen through the glass."""
        return self._view(np.zeros(2), 1, 1).site_px(points_mm)

    def px_per_mm(self, points_mm: FloatArray) -> FloatArray:
        """(n,) at the distance of points (n, 3)."""
        return EYE_FOCAL_PX / np.linalg.norm(points_mm - self.eye_mm, axis=1)

    def see(self, shown: NDArray[np.uint8], low: FloatArray, high: FloatArray) -> Picture:
        """(h, w) luminance of a picture (H, W) on the monitor, from pixel `low` to `high`."""
        width, height = (high - low).astype(int) + 1
        return self._view(low, int(width), int(height)).render(shown)[:, :, 0]

    def _view(self, low: FloatArray, width: int, height: int) -> MirrorView:
        matrix = np.diag([EYE_FOCAL_PX, EYE_FOCAL_PX, 1.0])
        matrix[:2, 2] = -low
        camera = Camera(matrix, np.zeros(0), width, height)
        return MirrorView(self.setup, camera, self.eye_from_left)

    @property
    def full_light(self) -> float:
        """Luminance of a pixel with the value 255 by the front face."""
        return self.setup.panel.white_cd_m2 * self.setup.plate.front_reflection


def box_around(pixels: FloatArray, margin_px: float) -> tuple[FloatArray, FloatArray]:
    """Whole pixels around all of (n, 2), the first and the last."""
    return np.floor(pixels.min(axis=0) - margin_px), np.ceil(pixels.max(axis=0) + margin_px)


def read_centroid(picture: Picture, full_light: float) -> FloatArray:
    """(2,) px of what is bright; NaN when nothing is, against a pixel that is covered by a bar."""
    if picture.max() < _DRAWN_ABOVE * full_light:
        return np.full(2, np.nan)
    light = np.where(picture > _READ_ABOVE * picture.max(), picture, 0.0).astype(float)
    v, u = np.mgrid[: light.shape[0], : light.shape[1]]
    return np.array([(u * light).sum(), (v * light).sum()]) / light.sum()


def is_cross_whole(
    picture: Picture, near: FloatArray, bars: FloatArray, scale: float, full_light: float
) -> bool:
    """Whether both bars of a cross are lit all along; arguments as of `read_crossing`."""
    along = np.linspace(-_BAR_MM, _BAR_MM, 80) * scale
    across = _offsets(0.5 * _ACROSS_MM * scale)
    for bar, normal in zip(bars, _normals(bars), strict=True):
        places = near + along[:, None, None] * bar + across[:, None] * normal
        if _look_up(picture, places).max(axis=1).min() < _WHOLE_ABOVE * full_light:
            return False
    return True


def read_crossing(
    picture: Picture, near: FloatArray, bars: FloatArray, scale: float, full_light: float
) -> FloatArray:
    """(2,) px where the middles of a cross's two bars meet; NaN when one of them is dark.

    Args:
        picture: with one cross.
        near: (2,) px, where it is expected.
        bars: (2, 2) unit directions of its bars.
        scale: px of a mm.
        full_light: luminance of a pixel that is covered by a bar.
    """
    normals = _normals(bars)
    along_mm = np.linspace(_MIDDLE_MM, _BAR_MM, 24)
    along = np.concatenate([-along_mm[::-1], along_mm]) * scale
    offsets = []
    for bar, normal in zip(bars, normals, strict=True):
        across = _offsets(_ACROSS_MM * scale)
        places = near + along[:, None, None] * bar + across[:, None] * normal
        light = _look_up(picture, places).mean(axis=0)
        if light.max() < _BAR_ABOVE * full_light:
            return np.full(2, np.nan)
        offsets.append(_middle(light, across)[0])
    return near + np.linalg.solve(normals, np.array(offsets))


def read_line(
    picture: Picture, places: FloatArray, along: FloatArray, scale: FloatArray, full_light: float
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """How far a line is from places where it is expected, across it.

    Args:
        picture: with the line.
        places: (n, 2) px.
        along: (n, 2) unit, the line's expected direction there.
        scale: (n,) px of a mm.
        full_light: luminance of a pixel that is covered by the line.

    Returns:
        (n,) mm between the middle of the line's two edges and the place, NaN where no line is read;
        (n,) whether there is anything bright.
    """
    normals = _normals(along)
    off_mm, is_lit = np.full(len(places), np.nan), np.zeros(len(places), dtype=bool)
    beside = np.linspace(-0.5, 0.5, _N_TOGETHER)[:, None, None] * _TOGETHER_MM
    for k, place in enumerate(places):
        across = _offsets(_ACROSS_MM * scale[k])
        grid = place + scale[k] * beside * along[k] + across[:, None] * normals[k]
        light = _look_up(picture, grid)
        # Lit at the place itself, and not only beside it along the line.
        is_lit[k] = light[_N_TOGETHER // 2].max() > _DRAWN_ABOVE * full_light
        if is_lit[k]:
            middle_px, is_alone = _middle(light.mean(axis=0), across)
            off_mm[k] = middle_px / scale[k] if is_alone else np.nan
    return off_mm, is_lit


def _normals(directions: FloatArray) -> FloatArray:
    return np.column_stack([-directions[:, 1], directions[:, 0]])


def _offsets(reach_px: float) -> FloatArray:
    n = int(reach_px / _STEP_PX)
    return np.arange(-n, n + 1) * _STEP_PX


def _look_up(picture: Picture, places: FloatArray) -> FloatArray:
    """Light at places (..., 2), between pixels."""
    v, u = places[..., 1], places[..., 0]
    return np.asarray(map_coordinates(picture, [v, u], output=float, order=1, mode="nearest"))


def _middle(light: FloatArray, across: FloatArray) -> tuple[float, bool]:
    """Middle between the two edges of what is brightest, and whether all else is dark.

    An edge is where half of the greatest light is passed.
    """
    top = int(np.argmax(light))
    half = 0.5 * light[top]
    if half <= 0.0:
        return np.nan, False
    low, high = top, top
    while low > 0 and light[low - 1] >= half:
        low -= 1
    while high < len(light) - 1 and light[high + 1] >= half:
        high += 1
    if low == 0 or high == len(light) - 1:
        return np.nan, False
    ends = []
    for inner, outer in ((low, low - 1), (high, high + 1)):
        share = (light[inner] - half) / (light[inner] - light[outer])
        ends.append(across[inner] + share * (across[outer] - across[inner]))
    beyond = round(1.5 * (high - low)) + 1
    beside = np.concatenate([light[: max(low - beyond, 0)], light[high + beyond :]])
    is_alone = len(beside) == 0 or bool(beside.max() < half)
    return float(np.mean(ends)), is_alone
