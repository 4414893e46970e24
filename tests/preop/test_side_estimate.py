"""Left or right, of simulated knees of both sides and real right ones: never certainly wrong."""

import os
from pathlib import Path

import numpy as np
import pytest

from navapp.geometry.ply import read_ply
from navapp.geometry.simplify import simplify
from navapp.preop.side_estimate import SideEstimate, estimate_side
from navapp.values import BoneModel
from tests.geometry.shapes import sphere
from tests.many import few_of
from tests.preop.knees import fibula_of, knees, obliquely_cut, turned

BONES = Path(os.environ.get("NAVAPP_DATA", "../shared/data")) / "bones"
SETS = [("femur",), ("tibia",), ("patella",), ("femur", "tibia"), ("femur", "tibia", "patella")]
REAL = [f"pymskt/{name}" for name in ("femur_1", "femur_2", "femur_3", "tibia_1", "tibia_2")]
REAL += [f"knee_dess_R/{name}" for name in ("femur", "tibia", "patella")]


def estimated(meshes) -> SideEstimate:
    """From surfaces, with or without a fibula among them."""
    bones = {name: BoneModel(name, mesh) for name, mesh in meshes.items() if name != "fibula"}
    return estimate_side(bones, meshes.get("fibula"))


@pytest.mark.parametrize("names", few_of(SETS))
def test_shapes_alone_are_never_certain_and_not_wrong(people, names) -> None:
    known = 0
    for knee in people:
        estimate = estimated({name: knee.bones[name] for name in names})
        assert estimate.certainty != "certain"
        assert estimate.side in (None, knee.spec.side)
        assert (estimate.side is None) is (estimate.certainty == "unknown")
        known += estimate.side is not None
    assert known >= len(people) // 2


@pytest.mark.release
def test_with_a_fibula_the_side_of_a_whole_knee_is_certain(people) -> None:
    for knee in people:
        estimate = estimated({**knee.bones, "fibula": fibula_of(knee)})
        assert (estimate.side, estimate.certainty) == (knee.spec.side, "certain")


def test_a_fibula_without_anything_that_shows_the_front_is_likely_only() -> None:
    knee = knees()[0]
    estimate = estimated({"tibia": knee.bones["tibia"], "fibula": fibula_of(knee)})
    assert (estimate.side, estimate.certainty) == ("right", "likely")


@pytest.mark.parametrize("signs", few_of([(-1, -1, 1), (-1, 1, -1), (1, -1, -1)]))
def test_a_knee_that_is_turned_round_is_never_certainly_the_other_one(people, signs) -> None:
    """RAS read as LPS, or upside down: it is still the same knee."""
    for knee in people:
        whole = {**knee.bones, "fibula": fibula_of(knee)}
        estimate = estimated({name: turned(mesh, signs) for name, mesh in whole.items()})
        assert estimate.certainty != "certain"


def test_a_mirrored_knee_is_the_other_one(people) -> None:
    for knee in people:
        whole = {**knee.bones, "fibula": fibula_of(knee)}
        estimate = estimated({name: turned(m, (-1, 1, 1)) for name, m in whole.items()})
        assert estimate.side == {"left": "right", "right": "left"}[knee.spec.side]


@pytest.mark.release
def test_a_fibula_that_other_bones_contradict_says_nothing(people) -> None:
    for knee in people:
        wrong = turned(fibula_of(knee), (-1, 1, 1))
        estimate = estimated({**knee.bones, "fibula": wrong})
        assert (estimate.side, estimate.certainty) == (None, "unknown")


def test_a_ball_has_no_side() -> None:
    balls = {name: sphere(30.0, 20) for name in ("femur", "tibia", "patella")}
    estimate = estimated(balls)
    assert (estimate.side, estimate.certainty) == (None, "unknown")
    assert estimate.reasons


@pytest.mark.data
@pytest.mark.parametrize("name", few_of(REAL, 2))
def test_real_right_bones_are_never_called_left(name) -> None:
    mesh = read_ply(BONES / f"{name}.ply")[0]
    bone = name.partition("/")[2].partition("_")[0]
    estimate = estimated({bone: mesh})
    assert estimate.side in ("right", None)
    assert estimate.certainty != "certain"
    mirrored = estimated({bone: turned(mesh, (-1, 1, 1))})
    assert mirrored.side in ("left", None)


@pytest.mark.release
@pytest.mark.data
@pytest.mark.parametrize("step_deg", [60, 15])
def test_a_whole_real_knee_is_certain(step_deg: int) -> None:
    bones = {
        name: read_ply(BONES / "knee_dess_R" / f"{name}.ply")[0]
        for name in ("femur", "tibia", "patella", "fibula")
    }
    assert estimated(bones).certainty == "certain"
    assert estimated(bones).side == "right"
    angles = np.radians(np.arange(-180, 180, step_deg))
    for angle in angles:
        turn = np.array(
            [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
        )
        spun = {n: type(m)(m.vertices_mm @ turn.T, m.faces) for n, m in bones.items()}
        estimate = estimated(spun)
        assert (estimate.side, estimate.certainty) != ("left", "certain"), np.degrees(angle)


@pytest.mark.parametrize("is_capped", few_of([False, True]))
def test_an_oblique_cut_does_not_lean_a_femur(people, is_capped) -> None:
    """Slices across what is left of the cut's end would lean by degrees, some to the other side."""
    for knee in people[:8]:
        cut = {"femur": obliquely_cut(knee, is_capped)["femur"]}
        assert estimate_side(cut).side == estimated({"femur": knee.bones["femur"]}).side


def test_slices_of_a_bone_and_coarse_ones_are_survived() -> None:
    """What is left may be a strip, or a shaft with a handful of vertices."""
    femur = knees()[0].bones["femur"]
    x = femur.vertices_mm[:, 0]
    for width_mm in (0.5, 1.0, 2.0, 4.0, 8.0):
        strip = BoneModel("femur", femur, is_removed=np.abs(x - np.median(x)) > width_mm)
        assert estimate_side({"femur": strip}).certainty != "certain"
    coarse = simplify(femur, 300, 5.0)
    for level in np.linspace(0.2, 1.0, 30):
        height = femur.vertices_mm[:, 2].min() + level * np.ptp(femur.vertices_mm[:, 2])
        cut = BoneModel("femur", coarse, is_removed=coarse.vertices_mm[:, 2] > height)
        assert estimate_side({"femur": cut}).side in ("right", None)
