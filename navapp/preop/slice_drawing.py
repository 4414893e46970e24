"""Draws slices with the contours of surfaces, points and a scale bar."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import FloatArray
from navapp.preop.plan_view import PlanView
from navapp.preop.slice_volume import SliceVolume, make_bounds, sample_grey
from navapp.preop.slices import DIRECTIONS, Direction, Picture, cut_contour, make_grid
from navapp.preop.volume import CtVolume, LabelVolume

Colour = tuple[int, int, int]  # red, green, blue

# Red, green, blue.
_CONTOUR: Colour = (255, 170, 60)
BONE_COLOURS: dict[str, Colour] = {
    "femur": _CONTOUR,
    "tibia": (90, 190, 255),
    "patella": (120, 235, 120),
}
OTHER_COLOUR: Colour = (230, 160, 230)
# Of the points in a slice, in turn.
POINT_COLOURS: tuple[Colour, ...] = (
    (255, 255, 80), (255, 80, 255), (80, 255, 255), (255, 90, 90), (255, 255, 255),
    (150, 150, 255), (170, 255, 60),
)  # fmt: skip
# What is shown from black to white; None: all that is stored.
WINDOWS_HU: dict[str, tuple[float, float] | None] = {"bone": None, "soft tissue": (-150.0, 250.0)}
_WHITE: Colour = (255, 255, 255)
_PREVIEW_HEIGHT_PX = 360
_SCALES_MM = (100, 50, 20, 10, 5)
# Longest scale bar, and length of a cross, as parts of the picture's smaller side.
_SCALE_SHARE, _CROSS_SHARE = 0.45, 0.05
# Subpixels of OpenCV's drawing, as a shift.
_SHIFT = 4


def choose_point_colour(k: int) -> Colour:
    """Of the point that comes at place `k` in its slice."""
    return POINT_COLOURS[k % len(POINT_COLOURS)]


def choose_scale_mm(width_mm: float) -> int:
    """Length of the scale bar for a slice so wide."""
    fitting = (scale for scale in _SCALES_MM if scale <= _SCALE_SHARE * width_mm)
    return next(fitting, _SCALES_MM[-1])


def draw_slice(
    view: PlanView,
    direction: Direction,
    index: int,
    size_px: tuple[int, int],
    window_hu: tuple[float, float] | None = None,
    thickness_px: int = 1,
    has_numbers: bool = False,
) -> Picture:
    """(h, w, 3) BGR: a slice with contours, crosses at its points, and a scale bar.

    Args:
        view: of the plan.
        direction: of the slice.
        index: of the slice.
        size_px: width and height of the picture, in the proportions of the slice.
        window_hu: shown as black and as white; None for all that is stored.
        thickness_px: of crosses and bar; contours are fine, so that they hide nothing.
        has_numbers: crosses are numbered, from 1.
    """
    grey = apply_window(view.volume, view.volume.slice_of(direction, index), window_hu)
    drawing = _Drawing(grey, size_px, thickness_px)
    for name, segments in view.find_contours(direction, index).items():
        drawing.add_segments(segments, BONE_COLOURS.get(name, OTHER_COLOUR))
    for k, at in enumerate(view.find_points(direction, index).values()):
        drawing.add_cross(at, choose_point_colour(k), str(k + 1) if has_numbers else "")
    drawing.add_scale(view.grid.step_mm)
    return drawing.picture


def apply_window(
    volume: SliceVolume, grey: Picture, window_hu: tuple[float, float] | None
) -> Picture:
    """Grey values with other densities as black and white; a segmentation's stay as they are."""
    import cv2

    if window_hu is None or volume.range_hu is None:
        return grey
    hu = np.linspace(*volume.range_hu, 256)
    share = (hu - window_hu[0]) / (window_hu[1] - window_hu[0])
    table = np.rint(255.0 * np.clip(share, 0.0, 1.0)).astype(np.uint8)
    return np.asarray(cv2.LUT(np.ascontiguousarray(grey), table), dtype=np.uint8)


def draw_slices(volume: CtVolume | LabelVolume, mesh: TriangleMesh) -> Picture:
    """(h, w, 3) BGR: three slices through a surface's middle, at the voxels' own resolution.

    Args:
        volume: CT in HU, or labels.
        mesh: LPS mm.
    """
    return np.hstack([_draw_middle(volume, mesh, direction) for direction in DIRECTIONS])


def _draw_middle(
    volume: CtVolume | LabelVolume, mesh: TriangleMesh, direction: Direction
) -> Picture:
    """One slice, at the height of most of the surface."""
    whole = make_grid([mesh], make_bounds(volume), float(volume.spacing_mm.min()))
    origin, size = list(whole.origin_mm), list(whole.size)
    origin[direction.axis] = float(np.median(mesh.vertices_mm[:, direction.axis]))
    size[direction.axis] = 1
    grid = replace(
        whole, origin_mm=(origin[0], origin[1], origin[2]), size=(size[0], size[1], size[2])
    )
    thin = SliceVolume(grid, sample_grey(volume, grid))
    rows, columns = grid.shape_of(direction)
    width_px = max(2, round(_PREVIEW_HEIGHT_PX * columns / rows))
    drawing = _Drawing(thin.slice_of(direction, 0), (width_px, _PREVIEW_HEIGHT_PX), 1)
    ends = cut_contour(mesh.vertices_mm, mesh.faces, direction.axis, origin[direction.axis])
    drawing.add_segments(grid.find_pixels(direction, ends), _CONTOUR)
    length_mm = drawing.add_scale(grid.step_mm)
    drawing.add_words(direction, f"{length_mm} mm")
    return drawing.picture


class _Drawing:
    """A slice, enlarged, that is drawn into. Places are given in pixels of the slice."""

    def __init__(self, grey: Picture, size_px: tuple[int, int], thickness_px: int) -> None:
        import cv2

        rows, columns = grey.shape
        self._scale = np.array(size_px, dtype=np.float64) / (columns, rows)
        self._thickness_px = thickness_px
        enlarged = cv2.resize(np.ascontiguousarray(grey), size_px, interpolation=cv2.INTER_LINEAR)
        self.picture: Picture = np.asarray(cv2.cvtColor(enlarged, cv2.COLOR_GRAY2BGR), np.uint8)

    def add_segments(self, segments: FloatArray, colour: Colour) -> None:
        import cv2

        lines = list(self._find_places(segments))
        cv2.polylines(self.picture, lines, False, colour[::-1], 1, cv2.LINE_AA, _SHIFT)

    def add_cross(self, at: FloatArray, colour: Colour, label: str) -> None:
        arm = max(3.0, _CROSS_SHARE * min(self.picture.shape[:2])) / self._scale
        ends = at + np.array([[[-1, 0], [1, 0]], [[0, -1], [0, 1]]]) * arm
        self._add_outlined(ends, colour)
        x, y = ((at + 0.5) * self._scale).astype(int).tolist()
        self._add_text(label, (x + 4, y - 4), colour)

    def add_scale(self, step_mm: float) -> int:
        """A bar at the lower left; its length, mm."""
        height, width = self.picture.shape[:2]
        length_mm = choose_scale_mm(width / self._scale[0] * step_mm)
        length = length_mm / step_mm
        left, bottom = 0.04 * width / self._scale[0], 0.95 * height / self._scale[1]
        tick = 0.015 * height / self._scale[1]
        ends = [((left, bottom), (left + length, bottom))]
        ends += [((x, bottom - tick), (x, bottom + tick)) for x in (left, left + length)]
        self._add_outlined(np.array(ends), _WHITE)
        return length_mm

    def add_words(self, direction: Direction, scale: str) -> None:
        """The letters of its sides, and how long the bar is."""
        height, width = self.picture.shape[:2]
        places = (
            (6, height // 2), (width - 20, height // 2), (width // 2, 18), (width // 2, height - 8),
            (round(0.04 * width), round(0.95 * height) - 12),
        )  # fmt: skip
        for mark, place in zip((*direction.marks, scale), places, strict=True):
            self._add_text(mark, place, _WHITE)

    def _add_text(self, text: str, place: tuple[int, int], colour: Colour) -> None:
        import cv2

        font = cv2.FONT_HERSHEY_SIMPLEX
        for tone, thickness in (((0, 0, 0), 3), (colour[::-1], 1)):
            cv2.putText(self.picture, text, place, font, 0.5, tone, thickness, cv2.LINE_AA)

    def _add_outlined(self, ends: FloatArray, colour: Colour) -> None:
        """Lines with a black rim: on bright bone it is the one that is seen."""
        import cv2

        # At whole pixels: upright lines are sharp there.
        lines = [np.rint(line / 2**_SHIFT).astype(np.int32) for line in self._find_places(ends)]
        for tone, more in (((0, 0, 0), 2), (colour[::-1], 0)):
            thickness = self._thickness_px + more
            cv2.polylines(self.picture, lines, False, tone, thickness)

    def _find_places(self, pixels: FloatArray) -> NDArray[np.int32]:
        # A pixel's middle lies half a pixel inside its enlarged square.
        places = (pixels + 0.5) * self._scale - 0.5
        whole: NDArray[np.int32] = np.rint(places * 2**_SHIFT).astype(np.int32)
        return whole
