"""`navapp plan --cartilage`: what is made, shown and refused."""

import json
from pathlib import Path

import numpy as np
import pytest

from navapp.cli.main import run
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.ply import write_ply
from navapp.preop import read_plan
from tests.geometry.shapes import sphere

pytestmark = pytest.mark.usefixtures("few_sides")

BONE = sphere(40.0, 20)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Surfaces of a bone and of what may be said to be its cartilage."""
    high = np.clip(0.1 * BONE.vertices_mm[:, 2], 0.0, 2.5)
    surfaces = {
        "femur": BONE,
        "tibia": sphere(30.0, 20, (0.0, 0.0, -90.0)),
        "cartilage": TriangleMesh(BONE.vertices_mm + high[:, None] * BONE.normals, BONE.faces),
        "inside": sphere(38.0, 20),
        "elsewhere": sphere(42.0, 20, (0.0, 200.0, 0.0)),
    }
    for name, mesh in surfaces.items():
        write_ply(tmp_path / f"{name}.ply", mesh)
    return tmp_path


def made(folder: Path, *arguments: str) -> int:
    bone = f"femur={folder / 'femur.ply'}"
    return run([
        "plan", "--surface", bone, "--side", "right", "--out", str(folder / "plan"),
        "--json", str(folder / "made.json"), *arguments,
    ])  # fmt: skip


def bones_in(file: Path) -> dict:
    return json.loads(file.read_text(encoding="utf-8"))["bones"]


def test_a_plan_that_is_there_is_replaced_only_when_told_so(folder, capsys) -> None:
    assert made(folder) == 0
    before = (folder / "plan" / "plan.json").read_bytes()
    cartilage = ("--cartilage", f"femur={folder / 'cartilage.ply'}")
    assert made(folder, *cartilage) == 3
    assert "holds a plan: choose a new folder for --out, or add --replace" in (
        capsys.readouterr().err
    )
    assert (folder / "plan" / "plan.json").read_bytes() == before
    assert made(folder, *cartilage, "--replace") == 0
    assert (folder / "plan" / "plan.json").read_bytes() != before


def test_a_cartilage_surface_is_held_per_vertex_and_shown(folder, capsys) -> None:
    assert made(folder, "--cartilage", f"femur={folder / 'cartilage.ply'}") == 0
    bone = read_plan(folder / "plan").bones["femur"]
    assert bone.cartilage_mm.max() == pytest.approx(2.5, abs=1e-3)
    np.testing.assert_array_equal(bone.mesh.vertices_mm, BONE.vertices_mm)
    figures = bones_in(folder / "made.json")["femur"]["cartilage_mm"]
    assert set(figures) == {"mean", "max", "sd"}
    assert figures["max"] == pytest.approx(2.5, abs=1e-3)
    assert figures["sd"] == pytest.approx(0.4)
    capsys.readouterr()
    assert run(["plan", "show", str(folder / "plan"), "--json", str(folder / "shown.json")]) == 0
    assert "at most 2.5 mm, sd 0.4 mm" in capsys.readouterr().out
    assert bones_in(folder / "shown.json")["femur"]["cartilage_mm"] == figures


def test_one_mean_is_held_for_the_bone_that_it_is_given_for(folder) -> None:
    tibia = f"tibia={folder / 'tibia.ply'}"
    assert made(folder, "--surface", tibia, "--cartilage", "femur=2:0.6") == 0
    bones = bones_in(folder / "made.json")
    assert bones["femur"]["cartilage_mm"] == pytest.approx({"mean": 2.0, "max": 2.0, "sd": 0.6})
    assert bones["tibia"]["cartilage_mm"] is None


def test_a_plan_with_cartilage_has_another_hash(folder) -> None:
    hashes = []
    for arguments in ([], ["--cartilage", "femur=2:0.6"], ["--cartilage", "femur=2:0.5"]):
        assert made(folder, "--replace", *arguments) == 0
        hashes.append(json.loads((folder / "made.json").read_text())["hash"])
    assert len(set(hashes)) == 3


@pytest.mark.parametrize(
    ("value", "code", "words"),
    [
        ("tibia=2:0.5", 2, ("tibia", "--surface tibia=FILE")),
        ("hip=2:0.5", 2, ("'hip'", "femur, tibia or patella")),
        ("femur", 2, ("--cartilage femur", "NAME=")),
        ("femur=", 2, ("NAME=",)),
        ("femur=2", 2, ("neither a PLY file nor MEAN_MM:SD_MM", "femur=2.0:0.6")),
        ("femur=2:0.5:1", 2, ("neither a PLY file",)),
        ("femur=thick:0.5", 2, ("neither a PLY file",)),
        ("femur=-1:0.5", 2, ("mean of -1 mm", "0 to 10 mm")),
        ("femur=10.5:0.5", 2, ("mean of 10.5 mm", "0 to 10 mm")),
        ("femur=nan:0.5", 2, ("mean of nan mm", "0 to 10 mm")),
        ("femur=2:nan", 2, ("standard deviation of nan mm",)),
        ("femur=2:-0.5", 2, ("standard deviation of -0.5 mm",)),
        ("femur=2:inf", 2, ("standard deviation of inf mm",)),
        ("femur={folder}/none.ply", 3, ("none.ply", "cannot be read")),
        ("femur={folder}/inside.ply", 3, ("inside.ply", "lies inside the femur", "outer surface")),
        ("femur={folder}/elsewhere.ply", 3, ("elsewhere.ply", "away from the femur")),
        ("femur={folder}/femur.ply", 3, ("lies nowhere outside the femur",)),
    ],
)
def test_bad_cartilage_is_one_sentence_and_nothing_is_written(
    folder, capsys, value, code, words
) -> None:
    before = sorted(folder.iterdir())
    assert made(folder, "--cartilage", value.format(folder=folder)) == code
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert line.startswith("navapp: error: ")
    assert all(word in line for word in words), line
    assert sorted(folder.iterdir()) == before


def test_cartilage_given_twice_or_to_show_is_refused(folder, capsys) -> None:
    assert made(folder, "--cartilage", "femur=2:1", "--cartilage", "femur=1:1") == 2
    assert "the femur is given twice" in capsys.readouterr().err
    assert run(["plan", "show", str(folder), "--cartilage", "femur=2:1"]) == 2
    assert "show takes a plan folder only" in capsys.readouterr().err


def test_an_older_plan_stays_when_its_replacement_is_refused(folder) -> None:
    assert made(folder) == 0
    digest = read_plan(folder / "plan").digest
    assert made(folder, "--cartilage", f"femur={folder / 'inside.ply'}") == 3
    assert read_plan(folder / "plan").digest == digest
