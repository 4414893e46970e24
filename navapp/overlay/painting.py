"""Paints what the layers of a scene ask for into a picture."""

import numpy as np

from navapp.geometry.bands import begin_on_helper
from navapp.geometry.transform import FloatArray
from navapp.overlay.blend_kernels import blend_colour, mark_dots
from navapp.overlay.colours import Colour
from navapp.overlay.drawing import Drawing
from navapp.overlay.labels import Image, LabelBoard
from navapp.overlay.layers import LAYERS
from navapp.overlay.scene import SKIN_MM, Scene
from navapp.overlay.shading import draw_body, draw_bone
from navapp.overlay.strokes import draw_strokes


def paint_layers(image: Image, scene: Scene, labels: LabelBoard) -> None:
    """The scene's layers in the order of their table, and their words."""
    drawing = Drawing()
    # Both threads need the box. What stands in front is looked up by the helper, while the layers,
    # which know nothing of it, are asked and the bone is rendered.
    _ = scene.box
    with begin_on_helper(lambda: scene.seen):
        ask_layers(scene, drawing)
        _ = scene.view
    paint(image, scene, drawing, labels)


def ask_layers(scene: Scene, drawing: Drawing) -> None:
    """What the scene's layers want to be drawn, in the order of their table."""
    for name, layer in LAYERS.items():
        if name in scene.layers:
            layer(scene, drawing)


def paint(image: Image, scene: Scene, drawing: Drawing, labels: LabelBoard) -> None:
    """All that was asked for, into a picture (H, W, 3)."""
    draw_bone(image, scene, drawing.tints, drawing.outline)
    for body in drawing.bodies:
        draw_body(image, scene, scene.render(body.mesh), body)
    for points_mm, colour in drawing.dots:
        _draw_dots(image, scene, points_mm, colour)
    draw_strokes(image, scene, drawing.strokes)
    for panel in drawing.panels:
        panel(image, labels)
    ask_for_words(scene, drawing, labels)
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
