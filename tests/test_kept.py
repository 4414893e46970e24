"""What is kept on disk is what would be made anew, made by one, and never a damaged file."""

import os
import threading
import time

import numpy as np
import pytest

from sim_devices.anatomy import KneeSpec
from sim_devices.planned_cuts import make_planned_cuts
from tests import kept

SPEC = KneeSpec(3, "left", "male", "old")


@pytest.mark.release
@pytest.mark.parametrize("is_there", [False, True])
def test_a_kept_knee_is_the_simulators(tmp_path, monkeypatch, is_there: bool) -> None:
    monkeypatch.setattr(kept, "FOLDER", tmp_path)
    true = kept.make_new_knee(SPEC)
    if is_there:
        kept.make_knee.__wrapped__(SPEC)
        monkeypatch.setattr(kept, "make_new_knee", None)
    ours = kept.make_knee.__wrapped__(SPEC)
    assert (ours.spec, ours.shape) == (true.spec, true.shape)
    np.testing.assert_array_equal(ours.scale, true.scale)
    assert list(ours.bones) == list(true.bones) == list(ours.solids) == list(true.solids)
    for name, mesh in true.bones.items():
        for part in ("vertices_mm", "faces", "normals"):
            found = getattr(ours.bones[name], part)
            np.testing.assert_array_equal(found, getattr(mesh, part))
            assert not found.flags.writeable
    for part in ("landmarks", "curves"):
        found, wanted = getattr(ours, part), getattr(true, part)
        assert list(found) == list(wanted)
        for name in wanted:
            np.testing.assert_array_equal(found[name], wanted[name])


@pytest.mark.release
def test_kept_tissue_components_and_drawn_meshes_are_what_is_made(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(kept, "FOLDER", tmp_path)
    knee = kept.make_knee(SPEC)
    femur = knee.bones["femur"]
    cuts = [cut for cut in make_planned_cuts(knee).values() if cut.bone == "femur"]
    true = kept.make_new_tissue([femur], [femur], 3), kept.make_new_femoral_component(knee, cuts)
    simplified = kept.make_new_simplified(femur, 300, 5.0)
    for _ in range(2):
        sheet = kept.make_tissue([femur], [femur], 3)
        ours = sheet, kept.make_femoral_component(knee, cuts)
        np.testing.assert_array_equal(sheet.mark, true[0].mark)
        np.testing.assert_array_equal(sheet.exposure, true[0].exposure)
        for found, wanted in ((ours[0].mesh, true[0].mesh), (ours[1], true[1])):
            for part in ("vertices_mm", "faces", "normals"):
                np.testing.assert_array_equal(getattr(found, part), getattr(wanted, part))
        simple = kept.make_simplified(femur, 300, 5.0)
        np.testing.assert_array_equal(simple.vertices_mm, simplified.vertices_mm)
        np.testing.assert_array_equal(simple.faces, simplified.faces)
        monkeypatch.setattr(kept, "_write", None)  # nothing is made a second time


@pytest.mark.release
def test_other_arguments_are_other_things(tmp_path, monkeypatch) -> None:
    # Before anything is counted: the knee itself is kept as well, unless it is in memory.
    femur, tibia = (kept.make_knee(SPEC).bones[name] for name in ("femur", "tibia"))
    monkeypatch.setattr(kept, "FOLDER", tmp_path)
    for asked in ((femur, 300, 5.0), (femur, 400, 5.0), (femur, 300, 6.0), (tibia, 300, 5.0)):
        kept.make_simplified(*asked)
    assert len(list(tmp_path.rglob("*.npz"))) == 4
    with pytest.raises(AssertionError, match="has no name"):
        kept.make_tissue([femur], [femur], np.arange(3))


@pytest.mark.release
def test_solids_are_made_for_those_who_ask() -> None:
    knee, true = kept.make_knee(SPEC), kept.make_new_knee(SPEC)
    points = np.random.default_rng(1).uniform(-60.0, 60.0, (50, 3))
    for name, solid in true.solids.items():
        np.testing.assert_array_equal(knee.solids[name](points), solid(points))


def test_a_file_is_read_when_it_is_whole_and_made_anew_otherwise(tmp_path) -> None:
    made = []

    def make() -> kept.Arrays:
        made.append(1)
        return {"a": np.arange(9.0)}

    for n_made in (1, 1):
        np.testing.assert_array_equal(kept.keep(tmp_path, "it", make)["a"], np.arange(9.0))
        assert len(made) == n_made
    (path,) = tmp_path.rglob("*.npz")
    content = path.read_bytes()
    for n_made, damaged in enumerate((b"", content[:-7], content[:-1] + b"!", b"!" + content), 2):
        path.write_bytes(damaged)
        np.testing.assert_array_equal(kept.keep(tmp_path, "it", make)["a"], np.arange(9.0))
        assert len(made) == n_made
        assert path.read_bytes() == content


def test_other_sources_and_other_parameters_are_something_else(tmp_path, monkeypatch) -> None:
    for n, sources in enumerate(("one", "other")):
        monkeypatch.setattr(kept, "sources_hash", lambda sources=sources: sources)
        for what in ((1, 2), (1, 3)):
            told = np.array([n, *what])
            found = kept.keep(tmp_path, what, lambda told=told: {"a": told})
            np.testing.assert_array_equal(found["a"], told)
    assert len(list(tmp_path.rglob("*.npz"))) == 4


def test_the_hash_tells_of_every_source(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(kept, "ROOT", tmp_path)
    files = [
        tmp_path / name if name.endswith(".py") else tmp_path / name / "inner" / "a.py"
        for name in kept.SOURCES
    ]
    for file in files:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text("x = 1\n")
    for file in files:
        before = kept.sources_hash.__wrapped__()
        file.write_text("x = 2\n")
        assert kept.sources_hash.__wrapped__() != before


def test_what_other_sources_made_goes_after_a_day(tmp_path, monkeypatch) -> None:
    for sources, days in (("old", 2.0), ("new", 0.5)):
        monkeypatch.setattr(kept, "sources_hash", lambda sources=sources: sources)
        kept.keep(tmp_path, "it", lambda: {"a": np.arange(9.0)})
        then = time.time() - days * 86400.0
        os.utime(tmp_path / sources, (then, then))
    monkeypatch.setattr(kept, "sources_hash", lambda: "now")
    kept.keep(tmp_path, "it", lambda: {"a": np.arange(9.0)})
    assert sorted(path.name for path in tmp_path.iterdir()) == ["new", "now"]


def test_one_makes_it_and_the_others_wait(tmp_path) -> None:
    made = []

    def make() -> kept.Arrays:
        made.append(1)
        time.sleep(0.05)
        return {"a": np.arange(9.0)}

    threads = [threading.Thread(target=kept.keep, args=(tmp_path, "it", make)) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(made) == 1
