"""Layers that can be drawn over the video: one function each, and the table of their names."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.bands import in_row_bands
from navapp.geometry.camera import Camera
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.simplify import drawn, is_closed
from navapp.geometry.transform import RigidTransform
from navapp.geometry.zbuffer import RenderedView, render
from navapp.overlay.tint_kernels import compute_face_tints, tint_pixels
from navapp.values import Plan, StageSpec

Image = NDArray[np.uint8]

# BGR. Guides are green; a candidate that nobody has accepted is amber.
GUIDE_COLOUR = (120, 230, 60)
CANDIDATE_COLOUR = (40, 180, 255)
TARGET_COLOUR = (255, 240, 80)
DEFECT_COLOUR = (60, 60, 235)
CURVE_COLOURS = {"artery": (60, 60, 235), "vein": (220, 90, 60), "nerve": (60, 220, 250)}

# Of the bone's colour over a part that faces the camera, and how much more over a steep one.
_LEAST_FRACTION, _STEEP_FRACTION = 0.10, 0.35
_FARTHEST_PX = 20_000.0
# What is drawn simplified lies this near the surface: a vertex of it is not behind itself.
_SKIN_MM = 1.0
_DOT = ((0, 0), (0, 1), (1, 0), (0, -1), (-1, 0))


@dataclass(frozen=True)
class Scene:
    """What the layers draw: one bone at one pose, seen by the left camera."""

    plan: Plan
    stage: StageSpec
    mesh: TriangleMesh
    left_from_bone: RigidTransform
    camera: Camera
    is_candidate: bool

    @property
    def drawn_mesh(self) -> TriangleMesh:
        """The bone in as many triangles as a picture can show."""
        return drawn(self.mesh)

    @cached_property
    def view(self) -> RenderedView:
        """The bone's part of the left camera's picture, distortion included; rendered once."""
        mesh = self.drawn_mesh
        return render(
            mesh, self.left_from_bone, self.camera, is_whole=False, is_closed=is_closed(mesh)
        )

    @property
    def colour(self) -> tuple[int, int, int]:
        """Of the bone's outline."""
        return CANDIDATE_COLOUR if self.is_candidate else GUIDE_COLOUR


def draw_bone(image: Image, scene: Scene) -> None:
    """Outline, and creases and shape as a light veil, so that the bone beneath stays visible."""
    import cv2

    view, box, mesh = scene.view, scene.view.box, scene.drawn_mesh
    if box.is_empty:
        return
    part = image[box.y : box.y + box.height, box.x : box.x + box.width]
    # Steep parts are tinted more than those that face the camera: the shape shows, the bone too.
    towards = scene.left_from_bone.rotation[2]
    share = compute_face_tints(mesh.normals, mesh.faces, towards, _LEAST_FRACTION, _STEEP_FRACTION)
    in_row_bands(
        box.height,
        lambda rows: tint_pixels(
            part[slice(*rows)], view.face_index[slice(*rows)], share, scene.colour
        ),
    )
    mask = view.mask.astype(np.uint8)
    contours, _ = cv2.findContours(mask, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    cv2.drawContours(image, contours, -1, scene.colour, 2, offset=(box.x, box.y))


def draw_targets(image: Image, scene: Scene) -> None:
    """The stage's targets as crosses with their names."""
    import cv2

    for name in scene.stage.targets:
        points = scene.plan.targets.get(name)
        if points is None or not name.startswith(f"{scene.stage.bone}/"):
            continue
        pixels = scene.camera.project(scene.left_from_bone.apply(points.reshape(-1, 3)))
        for number, (u, v) in enumerate(pixels):
            if not _is_drawable(np.array([u, v])):
                continue
            centre = (round(float(u)), round(float(v)))
            cv2.drawMarker(image, centre, (0, 0, 0), cv2.MARKER_CROSS, 19, 4)
            cv2.drawMarker(image, centre, TARGET_COLOUR, cv2.MARKER_CROSS, 17, 2)
            if number == 0:  # a name for all of its points
                text = name.split("/", 1)[1].replace("_", " ")
                put_text(image, text, _label_place(text, centre, scene), 0.45, TARGET_COLOUR)


def draw_curves(image: Image, scene: Scene) -> None:
    """Vessels and nerves beside the bone, dashed where the bone hides them."""
    import cv2

    view = scene.view
    risks = scene.plan.content.risks
    for name, points in scene.plan.curves.items():
        if (risks[name].bone if name in risks else "femur") != scene.stage.bone:
            continue
        in_camera = scene.left_from_bone.apply(points)
        pixels = scene.camera.project(in_camera)
        colour = next((c for key, c in CURVE_COLOURS.items() if key in name), TARGET_COLOUR)
        for k in range(len(pixels) - 1):
            segment = pixels[k : k + 2]
            if not _is_drawable(segment):
                continue
            is_hidden = _is_behind(view, segment[0], float(in_camera[k, 2]))
            if is_hidden and k % 2:
                continue
            start, end = (tuple(int(value) for value in np.round(p)) for p in segment)
            cv2.line(image, start, end, colour, 1 if is_hidden else 2)


def draw_defects(image: Image, scene: Scene) -> None:
    """Damaged cartilage of the stage's bone as dots, where the bone does not hide it."""
    mesh, view = scene.mesh, scene.view
    height, width = view.depth_mm.shape
    for defect in scene.plan.content.defects.values():
        if defect.bone != scene.stage.bone:
            continue
        in_camera = scene.left_from_bone.apply(mesh.vertices_mm[defect.vertices])
        with np.errstate(invalid="ignore", divide="ignore"):
            pixels = np.round(scene.camera.project(in_camera)) - (view.box.x, view.box.y)
        is_inside = ((pixels >= 2) & (pixels < (width - 2, height - 2))).all(axis=1)
        u, v = pixels[is_inside].astype(np.intp).T
        # NaN, where the bone is not drawn, compares as not seen.
        is_seen = in_camera[is_inside, 2] < view.depth_mm[v, u] + _SKIN_MM
        u, v = u[is_seen] + view.box.x, v[is_seen] + view.box.y
        for down, right in _DOT:
            image[v + down, u + right] = DEFECT_COLOUR


def put_text(
    image: Image, text: str, at: tuple[int, int], size: float, colour: tuple[int, int, int]
) -> None:
    """Text with a dark rim, readable on any picture."""
    import cv2

    # A thicker stroke would have other letter widths: the rim is the same text, moved.
    for dx, dy in ((-1, -1), (-1, 1), (1, -1), (1, 1), (0, 2)):
        moved = (at[0] + dx, at[1] + dy)
        cv2.putText(image, text, moved, cv2.FONT_HERSHEY_SIMPLEX, size, (0, 0, 0), 1)
    cv2.putText(image, text, at, cv2.FONT_HERSHEY_SIMPLEX, size, colour, 1)


def _label_place(text: str, centre: tuple[int, int], scene: Scene) -> tuple[int, int]:
    """Beside the bone's middle line, away from it, so that labels do not run into each other."""
    middle = scene.camera.project(scene.left_from_bone.apply(scene.mesh.centroid_mm[None]))[0, 0]
    if abs(centre[0] - middle) < 15.0:
        return centre[0] - 4 * len(text), centre[1] - 16
    if centre[0] > middle:
        return centre[0] + 14, centre[1] + 5
    return centre[0] - 14 - 8 * len(text), centre[1] + 5


def _is_drawable(pixels: NDArray[np.float64]) -> bool:
    """Whether OpenCV can draw there: points beside the lens project millions of pixels away."""
    return bool((np.abs(pixels) < _FARTHEST_PX).all())


def _is_behind(view: RenderedView, pixel: NDArray[np.float64], depth_mm: float) -> bool:
    u, v = (int(value) for value in np.round(pixel) - (view.box.x, view.box.y))
    if not (0 <= v < view.depth_mm.shape[0] and 0 <= u < view.depth_mm.shape[1]):
        return False
    surface = view.depth_mm[v, u]
    return bool(np.isfinite(surface) and depth_mm > surface)


Layer = Callable[[Image, Scene], None]

LAYERS: Mapping[str, Layer] = MappingProxyType(
    {
        "bone": draw_bone,
        "defects": draw_defects,
        "targets": draw_targets,
        "curves": draw_curves,
    }
)
