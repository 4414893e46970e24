"""What holds of every layer."""

from dataclasses import replace

import numpy as np
import pytest

from navapp.geometry.transform import RigidTransform
from navapp.overlay import LAYERS, Scene
from navapp.overlay.colours import DEFECT, DRILL, PART, PLANE, SCALE, TARGET, risk_colour
from navapp.values import (
    Box,
    Defect,
    DrillAxis,
    Origin,
    Part,
    ResectionPlane,
    RiskStructure,
    SurgicalContent,
)
from tests.overlay.scenes import (
    CAMERA,
    POSE,
    Occluder,
    change,
    draw,
    is_colour,
    panel_boxes,
    scene,
    seen,
    video,
)
from tests.overlay.scenes import TARGET as POINT

UP = np.array([0.0, 0.0, 1.0])
# On the bowl, inside its tip, and before it.
ARTERY = np.column_stack([np.linspace(-30, 30, 21), np.full(21, 8.0), np.full(21, 14.0)])
CONTENT = SurgicalContent(
    planes={"cut": ResectionPlane("femur", np.array([0.0, 0.0, 3.0]), -UP, (60.0, 50.0))},
    drills={"guide": DrillAxis("femur", np.array([0.0, 0.0, 0.0]), UP, 20.0, 8.0)},
    parts={
        "tray": Part(
            "implant", Box((30.0, 24.0, 6.0)),
            RigidTransform.from_parts("femur", "tray", np.eye(3), (0.0, 0.0, 8.0)),
        )
    },
    risks={"artery": RiskStructure("femur", 6.0)},
    defects={"worn": Defect("femur", np.arange(300, 500))},
)  # fmt: skip
COLOURS = {
    "defects": DEFECT, "risks": risk_colour("artery"), "parts": PART, "planes": PLANE,
    "drills": DRILL, "targets": TARGET, "scale": SCALE,
}  # fmt: skip
# They lie at the bone; the scale and the legend have their own places.
AT_BONE = [name for name in LAYERS if name != "scale"]


def full(**options) -> Scene:
    return scene(*LAYERS, content=CONTENT, curves={"artery": ARTERY}, **options)


def bone_part(mask: np.ndarray) -> np.ndarray:
    """(h, w) without the removal's legend, which has its own place."""
    part = mask.copy()
    for box in panel_boxes("removal", full()):
        part[box.slices] = 0
    return part


@pytest.mark.parametrize("layer", list(LAYERS))
def test_every_layer_draws_what_a_plan_has(layer: str) -> None:
    image = draw(layer, seen(full()))
    assert image.any()
    if layer in COLOURS:
        assert is_colour(image, COLOURS[layer]).sum() > 10


@pytest.mark.parametrize("layer", [name for name in LAYERS if name not in ("bone", "scale")])
def test_without_anything_planned_nothing_is_drawn(layer: str) -> None:
    plain = scene(*LAYERS, targets={"tibia/plateau": POINT})
    assert not draw(layer, seen(plain)).any()


@pytest.mark.parametrize("layer", list(LAYERS))
def test_what_belongs_to_another_bone_is_not_drawn(layer: str) -> None:
    given = full()
    of_tibia = SurgicalContent(
        planes={"cut": replace(CONTENT.planes["cut"], bone="tibia")},
        drills={"guide": replace(CONTENT.drills["guide"], bone="tibia")},
        parts={
            "tray": replace(
                CONTENT.parts["tray"],
                bone_from_part=RigidTransform.from_parts("tibia", "tray", np.eye(3), np.zeros(3)),
            )
        },
        risks={"artery": RiskStructure("tibia", 6.0)},
        defects={"worn": Defect("tibia", np.empty(0, dtype=np.int64))},
    )
    targets = {"tibia/plateau": POINT}
    other = replace(given, plan=replace(given.plan, content=of_tibia, targets=targets, digest=""))
    image = draw(layer, seen(other))
    assert image.any() == (layer in ("bone", "scale"))


@pytest.mark.parametrize("layer", AT_BONE)
@pytest.mark.parametrize("nearer_mm", [10.0, 60.0, 150.0])
def test_a_hand_leaves_no_paint_inside_its_edge(layer: str, nearer_mm: float) -> None:
    # A cross is as long as the arm of which least is seen: the hand covers a part of the right one.
    column = {"targets": round(CAMERA.project(POSE.apply(POINT[None]))[0, 0]) + 5}.get(layer, 350)
    given = seen(full(), occluder=Occluder(column, nearer_mm))
    changed = bone_part(change(video(), draw(layer, given, video())) > 3)
    assert changed[:, : column - 3].sum() > 10
    assert not changed[:, column + 4 :].any()


@pytest.mark.parametrize("layer", AT_BONE)
@pytest.mark.parametrize(
    "options", [{"origin": Origin.FILLED_INTERIOR}, {"origin": Origin.UNKNOWN},
                {"occluder": Occluder(nearer_mm=3.5)}, None],
    ids=["guess", "unknown", "tissue", "no tracker tells it"],
)  # fmt: skip
def test_beneath_something_a_layer_is_fainter_but_seen(layer: str, options) -> None:
    before, on_top = video(), seen(full())
    beneath = full() if options is None else seen(full(), **options)
    faint, strong = (
        bone_part(change(before, draw(layer, given, video()))) for given in (beneath, on_top)
    )
    assert (faint > 3).sum() > 20
    # Less of it, or less strongly.
    assert faint.sum() < 0.97 * strong.sum()
    drawn = strong > 12
    assert (faint[drawn] > 3).mean() > 0.3


@pytest.mark.parametrize("layer", list(LAYERS))
def test_a_bone_out_of_view_draws_nothing(layer: str) -> None:
    away = RigidTransform.from_parts("left", "femur", np.eye(3), (0.0, 3000.0, 400.0))
    image = draw(layer, full(pose=away))
    # The scale is that of its depth.
    assert image.any() == (layer == "scale")


@pytest.mark.parametrize("layer", list(LAYERS))
@pytest.mark.parametrize("z_mm", [-400.0, 0.0, 1e-5, 1.0, 10.0])
def test_a_bone_behind_or_at_the_camera_is_survived(layer: str, z_mm: float) -> None:
    pose = RigidTransform.from_parts("left", "femur", np.eye(3), (0.0, 0.0, z_mm))
    image = draw(layer, full(pose=pose))
    if z_mm < 0.0:
        assert not image.any()


@pytest.mark.parametrize("layer", ["targets", "risks"])
@pytest.mark.parametrize("depth_mm", [1e-5, 1e-3, 0.1])
def test_points_beside_the_lens_draw_nothing_far_away(layer: str, depth_mm: float) -> None:
    """They project millions of pixels away."""
    near = np.array([[80.0, 5.0, depth_mm], [-90.0, 7.0, depth_mm]])
    points = POSE.inverse().apply(near)
    given = scene(layer, targets={"femur/notch": points[:1]}, curves={"artery": points})
    assert not draw(layer, given).any()
