import numpy as np
import pytest

from navapp.geometry.transform import RigidTransform
from navapp.geometry.zbuffer import render
from navapp.overlay import layers
from navapp.overlay.layers import (
    CURVE_COLOURS,
    DEFECT_COLOUR,
    GUIDE_COLOUR,
    LAYERS,
    TARGET_COLOUR,
    Scene,
)
from navapp.overlay.tint_kernels import compute_face_tints, tint_pixels
from navapp.values import BoneModel, Defect, Plan, RiskStructure, SurgicalContent
from tests.geometry.shapes import sphere
from tests.overlay.scenes import BEHIND, CAMERA, HEIGHT, MESH, POSE, TARGET, WIDTH, scene, video
from tests.views import find_silhouette


def black() -> np.ndarray:
    return np.zeros((HEIGHT, WIDTH, 3), dtype=np.uint8)


def is_colour(image: np.ndarray, colour) -> np.ndarray:
    return (image == np.array(colour, dtype=np.uint8)).all(axis=2)


def grown(mask: np.ndarray, by: int) -> np.ndarray:
    import cv2

    return cv2.dilate(mask.astype(np.uint8), np.ones((2 * by + 1, 2 * by + 1))).astype(bool)


def test_the_outline_runs_where_the_model_ends() -> None:
    image = video()
    LAYERS["bone"](image, scene("bone"))
    view = render(MESH, POSE, CAMERA)
    drawn, edge = is_colour(image, GUIDE_COLOUR), find_silhouette(view)
    assert drawn[edge].mean() > 0.99
    assert not (drawn & ~grown(edge, 2)).any()


def test_the_veil_covers_the_model_and_nothing_else() -> None:
    before, image = video(), video()
    LAYERS["bone"](image, scene("bone"))
    mask = render(MESH, POSE, CAMERA).mask
    changed = (image != before).any(axis=2)
    assert changed[mask].mean() > 0.99
    assert not (changed & ~grown(mask, 2)).any()
    inner = mask & ~grown(~mask, 4)
    # Light: what lies beneath can still be told.
    assert np.corrcoef(before[inner][:, 0], image[inner][:, 0])[0, 1] > 0.5


def test_every_pixel_is_tinted_once() -> None:
    """Two threads share the picture: a band that both did would be twice as green."""
    drawn, image = scene("bone"), video()
    view, mesh = drawn.view, drawn.drawn_mesh
    box = view.box
    expected = video()[box.y : box.y + box.height, box.x : box.x + box.width]
    share = compute_face_tints(
        mesh.normals, mesh.faces, POSE.rotation[2], layers._LEAST_FRACTION, layers._STEEP_FRACTION
    )
    tint_pixels(expected, view.face_index, share, GUIDE_COLOUR)
    LAYERS["bone"](image, drawn)
    found = image[box.y : box.y + box.height, box.x : box.x + box.width]
    inner = view.mask & ~grown(find_silhouette(view), 3)
    assert inner.mean() > 0.3
    np.testing.assert_array_equal(found[inner], expected[inner])


@pytest.mark.parametrize("layer", list(LAYERS))
def test_a_bone_out_of_view_draws_nothing(layer: str) -> None:
    image = black()
    away = RigidTransform.from_parts("left", "femur", np.eye(3), (0.0, 3000.0, 400.0))
    LAYERS[layer](image, scene(layer, pose=away))
    assert not image.any()


@pytest.mark.parametrize("layer", list(LAYERS))
@pytest.mark.parametrize("z_mm", [-400.0, 0.0, 1e-5, 1.0, 10.0])
def test_a_bone_behind_or_at_the_camera_is_survived(layer: str, z_mm: float) -> None:
    pose = RigidTransform.from_parts("left", "femur", np.eye(3), (0.0, 0.0, z_mm))
    LAYERS[layer](black(), scene(layer, pose=pose))


@pytest.mark.parametrize("layer", ["targets", "curves"])
@pytest.mark.parametrize("depth_mm", [1e-5, 1e-3, 0.1])
def test_points_beside_the_lens_are_survived(layer: str, depth_mm: float) -> None:
    """They project millions of pixels away."""
    near = np.array([[80.0, 5.0, depth_mm], [-90.0, 7.0, 3.0], [0.0, 0.0, 400.0]])
    points = POSE.inverse().apply(near)
    LAYERS[layer](black(), scene(layer, targets={"femur/notch": points}, curves={"artery": points}))


def test_targets_of_this_bone_are_marked_where_they_are_seen() -> None:
    image = black()
    LAYERS["targets"](image, scene("targets"))
    u, v = np.round(CAMERA.project(POSE.apply(TARGET[None]))[0]).astype(int)
    drawn = is_colour(image, TARGET_COLOUR)
    assert drawn[v, u - 8 : u + 9].all()
    assert drawn[v - 8 : v + 9, u].all()
    other = np.round(CAMERA.project(POSE.apply(TARGET[None] + 20.0))[0]).astype(int)
    assert not drawn[other[1] - 2 : other[1] + 3, other[0] - 2 : other[0] + 3].any()


def test_a_curve_is_dashed_behind_the_bone_and_full_beside_it() -> None:
    image = black()
    LAYERS["curves"](image, scene("curves"))
    drawn = is_colour(image, CURVE_COLOURS["artery"])
    in_camera = POSE.apply(BEHIND)
    pixels = CAMERA.project(in_camera)
    mask = render(MESH, POSE, CAMERA).mask
    middles = np.round(0.5 * (pixels[1:] + pixels[:-1])).astype(int)
    hidden = mask[middles[:, 1], middles[:, 0]]
    seen = drawn[middles[:, 1], middles[:, 0]]
    assert hidden.sum() > 6
    assert (~hidden).sum() > 4
    assert seen[~hidden].mean() > 0.9
    assert 0.3 < seen[hidden].mean() < 0.75


def test_a_curve_before_the_bone_is_not_dashed() -> None:
    image = black()
    before = BEHIND * (0.4, 1.0, 1.0) - (0.0, 0.0, 90.0)
    LAYERS["curves"](image, scene("curves", curves={"nerve": before}))
    pixels = CAMERA.project(POSE.apply(before))
    middles = np.round(0.5 * (pixels[1:] + pixels[:-1])).astype(int)
    assert is_colour(image, CURVE_COLOURS["nerve"])[middles[:, 1], middles[:, 0]].all()


def test_a_target_of_many_points_is_named_once(monkeypatch) -> None:
    said = []
    monkeypatch.setattr("navapp.overlay.layers.put_text", lambda _, text, *rest: said.append(text))
    image = black()
    points = TARGET + np.array([[0.0, 0, 0], [12, 0, 0], [0, 12, 0]])
    LAYERS["targets"](image, scene("targets", targets={"femur/notch": points}))
    assert said == ["notch"]
    for u, v in CAMERA.project(POSE.apply(points)):
        assert is_colour(image, TARGET_COLOUR)[round(v), round(u)]


def test_a_curve_that_moves_with_another_bone_is_not_drawn_with_this_one() -> None:
    image = black()
    of_tibia = SurgicalContent(risks={"popliteal artery": RiskStructure("tibia", 5.0)})
    LAYERS["curves"](image, scene("curves", content=of_tibia))
    assert not image.any()
    of_femur = SurgicalContent(risks={"popliteal artery": RiskStructure("femur", 5.0)})
    LAYERS["curves"](image, scene("curves", content=of_femur))
    assert image.any()


def test_damaged_cartilage_is_shown_where_it_is_and_where_it_can_be_seen() -> None:
    near = np.flatnonzero(np.linalg.norm(MESH.vertices_mm - TARGET, axis=1) < 12.0)
    content = SurgicalContent(defects={"worn": Defect("femur", near)})
    image = black()
    LAYERS["defects"](image, scene("defects", content=content))
    dots = is_colour(image, DEFECT_COLOUR)
    pixels = np.round(CAMERA.project(POSE.apply(MESH.vertices_mm[near]))).astype(int)
    assert dots[pixels[:, 1], pixels[:, 0]].all()
    assert dots.sum() <= 5 * len(near)
    other = SurgicalContent(defects={"worn": Defect("tibia", np.empty(0, dtype=np.int64))})
    image = black()
    LAYERS["defects"](image, scene("defects", content=other))
    assert not image.any()


def test_damaged_cartilage_behind_the_bone_is_not_shown() -> None:
    """A ball's far half is hidden by its near one."""
    ball = sphere(20.0, 24)
    pose = RigidTransform.from_parts("left", "femur", np.eye(3), (0.0, 0.0, 400.0))
    whole = SurgicalContent(defects={"all": Defect("femur", np.arange(len(ball.vertices_mm)))})
    of_bowl = scene("defects")
    plan = Plan({"femur": BoneModel("femur", ball)}, content=whole)
    image = black()
    LAYERS["defects"](image, Scene(plan, of_bowl.stage, ball, pose, CAMERA, False))
    assert image.any()
    alone = SurgicalContent(
        defects={"far": Defect("femur", np.flatnonzero(ball.vertices_mm[:, 2] > 8.0))}
    )
    image = black()
    plan = Plan({"femur": BoneModel("femur", ball)}, content=alone)
    LAYERS["defects"](image, Scene(plan, of_bowl.stage, ball, pose, CAMERA, False))
    assert not image.any()
