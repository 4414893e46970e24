import hashlib
import json
import os
from pathlib import Path

import numpy as np
import pytest

from navapp.errors import PlanError
from navapp.geometry.directions import ViewCone
from navapp.geometry.ply import read_ply
from navapp.preop import (
    PlanOrigin,
    plan_files,
    read_origin,
    read_plan,
    read_plan_view,
    write_plan,
)
from navapp.preop.slice_volume import SliceVolume
from navapp.preop.slices import make_grid
from navapp.values import BoneModel, Plan
from tests.geometry.shapes import sphere


def make_plan(radius_mm=30.0, **changes):
    mesh = sphere(radius_mm, 10)
    n = len(mesh.vertices_mm)
    rng = np.random.default_rng(3)
    femur = BoneModel(
        "femur",
        mesh,
        changes.pop("side", "right"),
        rng.uniform(0, 2, n),
        rng.uniform(0, 0.3, n),
        changes.pop("is_removed", np.empty(0, dtype=bool)),
        version=2,
        surface_sd_mm=changes.pop("surface_sd_mm", 0.03),
    )
    content = {
        "bones": {"femur": femur, "tibia": BoneModel("tibia", sphere(25.0, 8), "right")},
        "targets": {"femur/entry": rng.normal(size=(4, 3)) / 3, "tibia/none": np.empty((0, 3))},
        "curves": {"artery": rng.normal(size=(7, 3)) * 40},
    }
    return Plan(**{**content, **changes})


def names(folder):
    return sorted(entry.name for entry in folder.iterdir())


def test_a_plan_reads_back_exactly(tmp_path):
    plan = make_plan()
    write_plan(tmp_path / "plan", plan)
    again = read_plan(str(tmp_path / "plan"))
    assert again.digest == plan.digest
    assert again.name == "plan"
    assert set(again.bones) == {"femur", "tibia"}
    for name, bone in plan.bones.items():
        other = again.bones[name]
        assert other.mesh.vertices_mm.tobytes() == bone.mesh.vertices_mm.tobytes()
        assert other.mesh.faces.tobytes() == bone.mesh.faces.tobytes()
        assert other.cartilage_mm.tobytes() == bone.cartilage_mm.tobytes()
        assert other.cartilage_sd_mm.tobytes() == bone.cartilage_sd_mm.tobytes()
        assert (other.side, other.version, other.name) == (bone.side, bone.version, name)
        assert other.surface_sd_mm == bone.surface_sd_mm
    for name, points in plan.targets.items():
        assert again.targets[name].shape == (len(points), 3)
        np.testing.assert_array_equal(again.targets[name], points)
    np.testing.assert_array_equal(again.curves["artery"], plan.curves["artery"])


def test_parts_that_are_cut_away_stay_cut_away(tmp_path):
    removed = np.arange(len(sphere(30.0, 10).vertices_mm)) % 3 == 0
    write_plan(tmp_path / "plan", make_plan(is_removed=removed))
    np.testing.assert_array_equal(read_plan(tmp_path / "plan").bones["femur"].is_removed, removed)


def test_an_unknown_side_stays_unknown(tmp_path):
    write_plan(tmp_path / "plan", make_plan(side=None))
    assert read_plan(tmp_path / "plan").bones["femur"].side is None


def test_a_plan_with_whole_numbers_as_targets_reads_back(tmp_path):
    plan = make_plan(targets={"femur/entry": np.array([1, 2, 3])})
    write_plan(tmp_path / "plan", plan)
    np.testing.assert_array_equal(
        read_plan(tmp_path / "plan").targets_of(("femur/entry",)), [[1, 2, 3]]
    )


def test_the_folder_holds_a_surface_and_a_picture_for_each_bone(tmp_path):
    write_plan(tmp_path / "deep" / "plan", make_plan())
    assert names(tmp_path / "deep" / "plan") == [
        "femur.ply",
        "plan.json",
        "preview_femur.png",
        "preview_tibia.png",
        "summary.html",
        "tibia.ply",
    ]
    assert names(tmp_path / "deep") == ["plan"]
    assert (tmp_path / "deep" / "plan").stat().st_mode & 0o777 == 0o755


def header_of(file):
    return file.read_bytes().split(b"end_header\n")[0].decode()


def test_cartilage_is_stored_at_the_vertices_of_the_bones_that_have_some(tmp_path):
    write_plan(tmp_path / "plan", make_plan())
    head = header_of(tmp_path / "plan" / "femur.ply")
    assert "property double cartilage_mm\nproperty double cartilage_sd_mm\n" in head
    assert "cartilage" not in header_of(tmp_path / "plan" / "tibia.ply")
    assert "cartilage" not in (tmp_path / "plan" / "plan.json").read_text()


def test_a_bone_with_cartilage_is_a_surface_for_any_reader(tmp_path):
    plan = make_plan()
    write_plan(tmp_path / "plan", plan)
    mesh, header = read_ply(tmp_path / "plan" / "femur.ply")
    np.testing.assert_array_equal(mesh.vertices_mm, plan.bones["femur"].mesh.vertices_mm)
    np.testing.assert_array_equal(mesh.faces, plan.bones["femur"].mesh.faces)
    assert (header.tag("SPACE"), header.tag("UNIT")) == ("LPS", "mm")


def test_an_older_plan_that_knows_of_no_cartilage_still_reads(tmp_path):
    plan = Plan({"femur": BoneModel("femur", sphere(30.0), "left")})
    write_plan(tmp_path / "plan", plan)
    edit(tmp_path / "plan", set_at("bones", "femur", "cartilage_mm", value=None))
    edit(tmp_path / "plan", set_at("bones", "femur", "cartilage_sd_mm", value=None))
    again = read_plan(tmp_path / "plan")
    assert again.digest == plan.digest
    assert not again.bones["femur"].cartilage_mm.any()


@pytest.mark.parametrize("column", [3, 4])
def test_changed_cartilage_is_noticed_by_the_plan_s_own_hash(written, column):
    """Also when whoever changed it brought the file's hash up to date."""
    file = written / "femur.ply"
    content = bytearray(file.read_bytes())
    place = content.index(b"end_header\n") + len(b"end_header\n") + (5 * 7 + column) * 8
    content[place : place + 8] = np.float64(0.25).tobytes()
    file.write_bytes(content)
    digest = hashlib.sha256(content).hexdigest()
    edit(written, set_at("bones", "femur", "sha256", value=digest))
    with pytest.raises(PlanError, match="does not match its hash"):
        read_plan(written)


def test_an_older_plan_is_replaced(tmp_path):
    write_plan(tmp_path / "plan", make_plan())
    (tmp_path / "plan" / "femur.ply").write_bytes(b"")
    newer = make_plan(31.0, bones={"femur": BoneModel("femur", sphere(31.0))})
    write_plan(tmp_path / "plan", newer)
    assert read_plan(tmp_path / "plan").digest == newer.digest
    assert names(tmp_path / "plan") == [
        "femur.ply", "plan.json", "preview_femur.png", "summary.html",
    ]  # fmt: skip
    assert names(tmp_path) == ["plan"]


def test_an_empty_folder_is_used(tmp_path):
    (tmp_path / "plan").mkdir()
    write_plan(tmp_path / "plan", make_plan())
    assert read_plan(tmp_path / "plan").digest == make_plan().digest


def test_the_folder_of_something_else_is_refused(tmp_path):
    (tmp_path / "photos").mkdir()
    (tmp_path / "photos" / "cat.jpg").write_bytes(b"meow")
    with pytest.raises(PlanError, match=r"photos exists and is not a plan"):
        write_plan(tmp_path / "photos", make_plan())
    assert names(tmp_path / "photos") == ["cat.jpg"]
    with pytest.raises(PlanError, match="is not a plan"):
        write_plan(tmp_path / "photos" / "cat.jpg", make_plan())
    assert names(tmp_path) == ["photos"]


def test_a_plan_without_bones_is_refused(tmp_path):
    with pytest.raises(PlanError, match="at least one bone"):
        write_plan(tmp_path / "plan", Plan({}))
    assert names(tmp_path) == []


def test_a_place_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / "file").write_bytes(b"")
    with pytest.raises(PlanError, match="cannot be written"):
        write_plan(tmp_path / "file" / "plan", make_plan())


def no_space(*_args, **_kwargs):
    raise OSError(28, "No space left on device")


@pytest.mark.parametrize("with_older", [False, True])
def test_a_full_disk_leaves_what_was_there(tmp_path, monkeypatch, with_older):
    older = make_plan(33.0)
    if with_older:
        write_plan(tmp_path / "plan", older)
    monkeypatch.setattr(plan_files, "draw_preview", no_space)
    with pytest.raises(PlanError, match=r"plan cannot be written \(No space left on device\)"):
        write_plan(tmp_path / "plan", make_plan())
    assert names(tmp_path) == (["plan"] if with_older else [])
    if with_older:
        assert read_plan(tmp_path / "plan").digest == older.digest


@pytest.mark.parametrize("failing", [1, 2])
def test_a_failed_replacement_puts_the_older_plan_back(tmp_path, monkeypatch, failing):
    older = make_plan(33.0)
    write_plan(tmp_path / "plan", older)
    rename, calls = Path.rename, []

    def fails_once(self, target):
        calls.append(self)
        return no_space() if len(calls) == failing else rename(self, target)

    monkeypatch.setattr(Path, "rename", fails_once)
    with pytest.raises(PlanError, match="cannot be written"):
        write_plan(tmp_path / "plan", make_plan())
    assert names(tmp_path) == ["plan"]
    assert read_plan(tmp_path / "plan").digest == older.digest


def test_an_older_plan_that_cannot_be_put_back_is_not_deleted(tmp_path, monkeypatch):
    older = make_plan(33.0)
    write_plan(tmp_path / "plan", older)
    rename, calls = Path.rename, []

    def fails_after_the_first(self, target):
        calls.append(self)
        return no_space() if len(calls) > 1 else rename(self, target)

    monkeypatch.setattr(Path, "rename", fails_after_the_first)
    with pytest.raises(PlanError):
        write_plan(tmp_path / "plan", make_plan())
    (kept,) = tmp_path.glob("**/plan.json")
    assert read_plan(kept.parent).digest == older.digest


@pytest.mark.parametrize("make", [lambda folder: None, lambda folder: folder.mkdir()])
def test_a_missing_or_empty_folder_is_no_plan(tmp_path, make):
    make(tmp_path / "plan")
    with pytest.raises(PlanError, match=r"holds no plan.*navapp plan") as caught:
        read_plan(tmp_path / "plan")
    assert caught.value.subject == str(tmp_path / "plan")


@pytest.fixture
def written(tmp_path):
    write_plan(tmp_path / "plan", make_plan())
    return tmp_path / "plan"


def edit(folder, change):
    """Change an entry as an older plan would have it, without the hash of the whole file."""
    content = json.loads((folder / "plan.json").read_text(encoding="utf-8"))
    content.pop("file_hash", None)
    change(content)
    (folder / "plan.json").write_text(json.dumps(content), encoding="utf-8")


@pytest.mark.parametrize("key", ["kind", "warnings", "threshold_hu"])
def test_an_edited_fact_is_noticed(written, key):
    file = written / "plan.json"
    content = json.loads(file.read_text(encoding="utf-8"))
    content["origin"][key] = {"kind": "CT", "warnings": ["all is well"], "threshold_hu": 9.0}[key]
    file.write_text(json.dumps(content), encoding="utf-8")
    for read in (read_plan, read_origin):
        with pytest.raises(PlanError, match=r"plan\.json was edited"):
            read(written)


def test_nothing_is_known_of_the_origin_of_an_older_plan(written):
    edit(written, lambda content: content.pop("origin"))
    assert read_origin(written) == PlanOrigin()


def test_a_plan_without_bones_is_called_empty(written):
    edit(written, lambda content: content.update(bones={}))
    with pytest.raises(PlanError, match="is empty"):
        read_plan(written)


@pytest.mark.parametrize("file", ["femur.ply", "tibia.ply"])
def test_a_missing_surface_is_noticed(written, file):
    (written / file).unlink()
    with pytest.raises(PlanError, match=rf"is damaged: {file} is missing"):
        read_plan(written)


def test_a_cut_surface_is_noticed(written):
    os.truncate(written / "tibia.ply", 500)
    with pytest.raises(PlanError, match=r"tibia\.ply was changed or cut short"):
        read_plan(written)


def test_one_changed_byte_of_a_surface_is_noticed(written):
    content = bytearray((written / "femur.ply").read_bytes())
    content[-40] ^= 1
    (written / "femur.ply").write_bytes(content)
    with pytest.raises(PlanError, match=r"femur\.ply was changed"):
        read_plan(written)


def test_a_half_written_description_is_noticed(written):
    content = (written / "plan.json").read_bytes()
    for length in range(0, len(content), 997):
        (written / "plan.json").write_bytes(content[:length])
        with pytest.raises(PlanError, match="is damaged"):
            read_plan(written)


def set_at(*path, value):
    def change(content):
        for part in path[:-1]:
            content = content[part]
        content[path[-1]] = value

    return change


@pytest.mark.parametrize(
    "change",
    [
        set_at("bones", "femur", "side", value="left"),
        set_at("bones", "femur", "version", value=3),
        set_at("bones", "femur", "version", value=float("inf")),
        set_at("bones", "femur", value=7),
        set_at("bones", "femur", value={}),
        set_at("bones", "femur", "file", value=5),
        set_at("bones", value=[1, 2]),
        set_at("targets", "femur/entry", 0, 1, value=0.5),
        set_at("targets", "femur/entry", value=[[1.0, 2.0]]),
        set_at("targets", "femur/entry", value="here"),
        set_at("targets", value={}),
        set_at("curves", value={}),
        set_at("curves", value=None),
        set_at("hash", value="0123456789ab"),
        lambda content: content.pop("hash"),
        lambda content: content["bones"].pop("tibia"),
        lambda content: content.pop("targets"),
    ],
)
def test_a_tampered_description_is_noticed(written, change):
    edit(written, change)
    with pytest.raises(PlanError, match="is damaged"):
        read_plan(written)


@pytest.mark.parametrize("text", ["[]", "3", "null", '"plan"', "\x00"])
def test_a_description_of_another_kind_is_noticed(written, text):
    (written / "plan.json").write_text(text, encoding="utf-8")
    with pytest.raises(PlanError, match="is damaged"):
        read_plan(written)


def test_bytes_that_are_no_text_are_noticed(written):
    (written / "plan.json").write_bytes(b"\xff\xfe\x00{")
    with pytest.raises(PlanError, match="is damaged"):
        read_plan(written)


@pytest.mark.parametrize(
    "change", [set_at("format", value=2), set_at("unit", value="m"), set_at("space", value="RAS")]
)
def test_a_plan_of_another_format_is_refused(written, change):
    edit(written, change)
    with pytest.raises(PlanError, match="another format"):
        read_plan(written)


def test_usual_approaches_come_back_and_do_not_change_what_a_plan_is(tmp_path) -> None:
    cone = ViewCone(np.array([0.0, -0.5, -0.87]), 40.0)
    plan = make_plan(approaches={"femur": cone})
    assert plan.digest == make_plan().digest
    write_plan(tmp_path / "plan", plan)
    again = read_plan(tmp_path / "plan").approaches
    np.testing.assert_allclose(again["femur"].axis, cone.axis, atol=1e-15)
    assert again["femur"].half_angle_deg == 40.0


def make_slices(plan):
    grid = make_grid([bone.mesh for bone in plan.bones.values()])
    grey = np.random.default_rng(4).integers(0, 255, grid.size[::-1], dtype=np.uint8)
    return SliceVolume(grid, grey, (-200.0, 1400.0))


def test_slices_come_back_and_do_not_change_what_a_plan_is(tmp_path) -> None:
    """Recorded sessions name their plan by its digest: pictures for a person are not in it."""
    plan, origin = make_plan(), PlanOrigin("CT", warnings=("the CT is thick",))
    volume = make_slices(plan)
    write_plan(tmp_path / "plan", plan, origin, volume=volume)
    write_plan(tmp_path / "bare", plan, origin)
    again = read_plan(tmp_path / "plan")
    assert again.digest == read_plan(tmp_path / "bare").digest == plan.digest
    view = read_plan_view(tmp_path / "plan", again)
    assert view.origin == origin
    assert view.grid == volume.grid
    np.testing.assert_array_equal(view.volume.grey, volume.grey)


def test_a_plan_without_slices_is_written_as_ever_and_shows_contours_alone(tmp_path) -> None:
    plan = make_plan()
    write_plan(tmp_path / "plan", plan)
    assert set(json.loads((tmp_path / "plan" / "plan.json").read_text())) == {
        "format", "space", "unit", "bones", "targets", "curves", "approaches", "content",
        "origin", "hash", "file_hash",
    }  # fmt: skip
    view = read_plan_view(tmp_path / "plan", read_plan(tmp_path / "plan"))
    assert not view.has_pictures
    assert view.grid == make_grid([bone.mesh for bone in plan.bones.values()])


@pytest.mark.parametrize("damage", ["gone", "cut", "another"])
def test_damaged_slices_are_noticed(tmp_path, damage) -> None:
    plan = make_plan()
    write_plan(tmp_path / "plan", plan, volume=make_slices(plan))
    path = tmp_path / "plan" / "slices.npz"
    content = path.read_bytes()
    path.unlink()
    if damage == "cut":
        path.write_bytes(content[:-100])
    elif damage == "another":
        write_plan(tmp_path / "other", plan, volume=make_slices(make_plan(31.0)))
        path.write_bytes((tmp_path / "other" / "slices.npz").read_bytes())
    with pytest.raises(PlanError, match=r"is damaged: slices.npz is missing or was changed"):
        read_plan(tmp_path / "plan")


def test_a_full_disk_at_the_slices_leaves_nothing(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(plan_files, "write_slices", no_space)
    plan = make_plan()
    with pytest.raises(PlanError, match="No space left"):
        write_plan(tmp_path / "plan", plan, volume=make_slices(plan))
    assert names(tmp_path) == []
