"""Paints what the layers of a scene ask for into a picture."""

import threading
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from functools import partial

import numpy as np

from navapp.geometry.bands import begin_on_helper
from navapp.geometry.transform import FloatArray
from navapp.geometry.zbuffer import RenderedView
from navapp.overlay.blend_kernels import blend_colour, mark_dots
from navapp.overlay.colours import Colour
from navapp.overlay.drawing import Drawing
from navapp.overlay.labels import Image, LabelBoard
from navapp.overlay.layers import LAYERS
from navapp.overlay.scene import SKIN_MM, Scene
from navapp.overlay.shading import draw_body, draw_bone
from navapp.overlay.strokes import PlacedStrokes, blend_strokes, place_strokes, trace_strokes


def paint_layers(make_image: Callable[[], Image], scene: Scene, labels: LabelBoard) -> Image:
    """The scene's layers in the order of their table, and their words, in a picture (H, W, 3)."""
    drawing = Drawing()
    # The helper makes the picture, which needs nothing of the scene, and looks up what stands in
    # front; this thread asks the layers and renders what is not the bone. Whoever is free first
    # renders the bone.
    with ExitStack() as jobs:
        made = jobs.enter_context(begin_on_helper(make_image))
        _ = scene.box  # the look-up needs it
        looked_up = jobs.enter_context(begin_on_helper(lambda: scene.seen))
        rendered = jobs.enter_context(begin_on_helper(lambda: scene.view))
        ask_layers(scene, drawing)
        views = [scene.render(body.mesh) for body in drawing.bodies]
        placed = place_strokes(scene, drawing.strokes)
        ask_for_words(scene, drawing, labels)
        rendered.result()
        looked_up.result()
        _ = scene.ground  # needs both
        image = made.result()
    paint(image, scene, drawing, views, placed, labels)
    return image


def ask_layers(scene: Scene, drawing: Drawing) -> None:
    """What the scene's layers want to be drawn, in the order of their table."""
    for name, layer in LAYERS.items():
        if name in scene.layers:
            layer(scene, drawing)


def paint(
    image: Image,
    scene: Scene,
    drawing: Drawing,
    views: Sequence[RenderedView],
    placed: PlacedStrokes | None,
    labels: LabelBoard,
) -> None:
    """Paint all that was asked for.

    Args:
        image: (H, W, 3) in place.
        scene: whose ground is known: both threads need it.
        drawing: what was asked for.
        views: of each of its bodies.
        placed: its strokes.
        labels: board that knows its words (`ask_for_words`).
    """
    # Lines are traced by the helper while surfaces are drawn.
    trace = partial(trace_strokes, scene, placed, threading.get_ident())
    with begin_on_helper(trace) as traced:
        draw_bone(image, scene, drawing.tints, drawing.outline)
        for body, view in zip(drawing.bodies, views, strict=True):
            draw_body(image, scene, view, body)
        for points_mm, colour in drawing.dots:
            _draw_dots(image, scene, points_mm, colour)
        blend_strokes(image, traced.result())
    for panel in drawing.panels:
        panel(image, labels)
    labels.draw(image)


def _draw_dots(image: Image, scene: Scene, points_mm: FloatArray, colour: Colour) -> None:
    """Points (N, 3) of the bone's surface, those on the side that is seen."""
    in_camera = scene.to_camera(points_mm)
    pixels = scene.camera.project(in_camera) - (scene.box.x, scene.box.y)
    share = np.zeros(scene.bone_mm.shape, dtype=np.float32)
    depth_mm = np.ascontiguousarray(in_camera[:, 2])
    rows = mark_dots(pixels, depth_mm, scene.bone_mm, scene.weight, SKIN_MM, share)
    blend_colour(image[scene.box.slices][slice(*rows)], share[slice(*rows)], colour)


def ask_for_words(scene: Scene, drawing: Drawing, labels: LabelBoard) -> None:
    """Ask the board for labels beside the middle ones of the points that lie in the picture."""
    if not drawing.words:
        return
    points_mm = np.concatenate([words.points_mm for words in drawing.words])
    pixels = scene.camera.project(scene.to_camera(points_mm))
    size = scene.camera.width, scene.camera.height
    with np.errstate(invalid="ignore"):
        is_inside = np.asarray(((pixels >= 0) & (pixels < size)).all(axis=1))
    last = 0
    for words in drawing.words:
        first, last = last, last + len(words.points_mm)
        seen = pixels[first:last][is_inside[first:last]]
        if len(seen):
            labels.add(words.text, seen[len(seen) // 2], words.colour)
