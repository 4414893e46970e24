"""Left or right, of simulated knees of both sides and real right ones: never certainly wrong."""

import os
from pathlib import Path

import numpy as np
import pytest

from navapp.geometry.ply import read_ply
from navapp.preop.side import estimate_side
from tests.geometry.shapes import sphere
from tests.preop.knees import fibula_of, knees, turned

BONES = Path(os.environ.get("NAVAPP_DATA", "../shared/data")) / "bones"
SETS = [("femur",), ("tibia",), ("patella",), ("femur", "tibia"), ("femur", "tibia", "patella")]
REAL = [f"pymskt/{name}" for name in ("femur_1", "femur_2", "femur_3", "tibia_1", "tibia_2")]
REAL += [f"knee_dess_R/{name}" for name in ("femur", "tibia", "patella")]


@pytest.mark.parametrize("names", SETS)
def test_shapes_alone_are_never_certain_and_not_wrong(names) -> None:
    known = 0
    for knee in knees():
        estimate = estimate_side({name: knee.bones[name] for name in names})
        assert estimate.certainty != "certain"
        assert estimate.side in (None, knee.spec.side)
        assert (estimate.side is None) is (estimate.certainty == "unknown")
        known += estimate.side is not None
    assert known >= 10


def test_with_a_fibula_the_side_of_a_whole_knee_is_certain() -> None:
    for knee in knees():
        estimate = estimate_side({**knee.bones, "fibula": fibula_of(knee)})
        assert (estimate.side, estimate.certainty) == (knee.spec.side, "certain")


def test_a_fibula_without_anything_that_shows_the_front_is_likely_only() -> None:
    knee = knees()[0]
    estimate = estimate_side({"tibia": knee.bones["tibia"], "fibula": fibula_of(knee)})
    assert (estimate.side, estimate.certainty) == ("right", "likely")


@pytest.mark.parametrize("signs", [(-1, -1, 1), (-1, 1, -1), (1, -1, -1)])
def test_a_knee_that_is_turned_round_is_never_certainly_the_other_one(signs) -> None:
    """RAS read as LPS, or upside down: it is still the same knee."""
    for knee in knees():
        whole = {**knee.bones, "fibula": fibula_of(knee)}
        estimate = estimate_side({name: turned(mesh, signs) for name, mesh in whole.items()})
        assert estimate.certainty != "certain"


def test_a_mirrored_knee_is_the_other_one() -> None:
    for knee in knees():
        whole = {**knee.bones, "fibula": fibula_of(knee)}
        estimate = estimate_side({name: turned(m, (-1, 1, 1)) for name, m in whole.items()})
        assert estimate.side == {"left": "right", "right": "left"}[knee.spec.side]


def test_a_fibula_that_other_bones_contradict_says_nothing() -> None:
    for knee in knees():
        wrong = turned(fibula_of(knee), (-1, 1, 1))
        estimate = estimate_side({**knee.bones, "fibula": wrong})
        assert (estimate.side, estimate.certainty) == (None, "unknown")


def test_a_ball_has_no_side() -> None:
    balls = {name: sphere(30.0, 20) for name in ("femur", "tibia", "patella")}
    estimate = estimate_side(balls)
    assert (estimate.side, estimate.certainty) == (None, "unknown")
    assert estimate.reasons


@pytest.mark.data
@pytest.mark.parametrize("name", REAL)
def test_real_right_bones_are_never_called_left(name) -> None:
    mesh = read_ply(BONES / f"{name}.ply")[0]
    bone = name.partition("/")[2].partition("_")[0]
    estimate = estimate_side({bone: mesh})
    assert estimate.side in ("right", None)
    assert estimate.certainty != "certain"
    mirrored = estimate_side({bone: turned(mesh, (-1, 1, 1))})
    assert mirrored.side in ("left", None)


@pytest.mark.data
def test_a_whole_real_knee_is_certain() -> None:
    bones = {
        name: read_ply(BONES / "knee_dess_R" / f"{name}.ply")[0]
        for name in ("femur", "tibia", "patella", "fibula")
    }
    assert estimate_side(bones).certainty == "certain"
    assert estimate_side(bones).side == "right"
    angles = np.radians(np.arange(-180, 180, 15))
    for angle in angles:
        turn = np.array(
            [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
        )
        spun = {n: type(m)(m.vertices_mm @ turn.T, m.faces) for n, m in bones.items()}
        estimate = estimate_side(spun)
        assert (estimate.side, estimate.certainty) != ("left", "certain"), np.degrees(angle)
