"""`navapp register`: poses, units, files of every kind, and what is refused."""

import json
import re
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial import cKDTree

from navapp.cli.main import run
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.ply import write_ply
from navapp.geometry.simplify import simplify
from navapp.geometry.surface_files import read_surface_file
from navapp.geometry.transform import RigidTransform, rotation_angle_deg, rotation_from_vector
from tests.bones import femur_model
from tests.geometry.pcd_bytes import lines, pcd
from tests.geometry.shapes import sphere
from tests.many import few_of

NO_FACES = np.empty((0, 3), dtype=int)
# The knee's side: most of a surgeon's view.
TOWARDS_CAMERA = np.array([0.0, -0.5, -np.sqrt(0.75)])


@lru_cache
def end_of_femur() -> TriangleMesh:
    """The simulated femur's joint, cut open above it, in few triangles: they are read often."""
    mesh = simplify(femur_model().mesh, 6000, 0.3)
    low = mesh.vertices_mm[:, 2] < mesh.vertices_mm[:, 2].min() + 65.0
    faces = mesh.faces[low[mesh.faces].all(axis=1)]
    used, index = np.unique(faces, return_inverse=True)
    return TriangleMesh(mesh.vertices_mm[used], index.reshape(-1, 3))


class Bone:
    """A bone in its file, a scene of it in another, and the pose that is asked for."""

    def __init__(self, folder: Path, seed: int = 1) -> None:
        self.rng = np.random.default_rng(seed)
        self.folder = folder
        self.mesh = end_of_femur()
        rotation = rotation_from_vector(self.rng.normal(size=3))
        self.true = RigidTransform.from_parts("scene", "model", rotation, [20.0, -30.0, 450.0])
        seen = np.flatnonzero(self.mesh.normals @ TOWARDS_CAMERA > 0.35)
        surface = self.mesh.vertices_mm[self.rng.choice(seen, 1500)]
        surface = surface + 0.3 * self.rng.normal(size=surface.shape)
        box = surface.mean(axis=0) + 35.0 * self.rng.uniform(-1, 1, (300, 3))
        self.points = self.true.apply(np.concatenate([surface, box]))
        centre = self.mesh.centroid_mm
        self.camera = self.true.apply(centre + 450.0 * TOWARDS_CAMERA)
        self.scene, self.model = folder / "scene.ply", folder / "model.ply"
        self.write(1.0, "mm")

    def write(self, scale: float, unit: str) -> None:
        write_ply(self.scene, TriangleMesh(scale * self.points, NO_FACES), unit=unit)
        write_ply(self.model, TriangleMesh(scale * self.mesh.vertices_mm, self.mesh.faces),
                  unit=unit)  # fmt: skip

    def start(self, angle_deg: float, shift_mm: float, scale: float = 1.0) -> str:
        """A file with the true pose, turned and moved."""
        axis, way = self.rng.normal(size=(2, 3))
        turn = np.radians(angle_deg) * axis / np.linalg.norm(axis)
        step = shift_mm * way / np.linalg.norm(way)
        pose = self.true.move(np.concatenate([step, turn]), self.points.mean(axis=0))
        matrix = np.array(pose.matrix)
        matrix[:3, 3] *= scale
        path = self.folder / "start.json"
        path.write_text(json.dumps({"matrix": matrix.tolist()}), encoding="utf-8")
        return str(path)

    def seen_from(self, scale: float = 1.0) -> list[str]:
        return ["--camera", *(repr(float(value)) for value in scale * self.camera)]

    def tre(self, matrix: Any, scale: float = 1.0) -> float:
        """Mean error over the model in mm of a pose in the files' unit."""
        found = np.array(matrix)
        points = scale * self.mesh.vertices_mm
        placed = points @ found[:3, :3].T + found[:3, 3]
        off = placed / scale - self.true.apply(self.mesh.vertices_mm)
        return float(np.linalg.norm(off, axis=1).mean())


@pytest.fixture
def bone(tmp_path: Path) -> Bone:
    return Bone(tmp_path)


def register(*options: object, code: int = 0) -> dict[str, Any]:
    """The result for programs."""
    files = [Path(str(option)) for option in options[:2]]
    out = files[0].parent / "result.json" if files[0].parent.is_dir() else Path("result.json")
    out.unlink(missing_ok=True)
    assert run(["register", *map(str, options), "--json", str(out)]) == code
    content: dict[str, Any] = json.loads(out.read_text(encoding="utf-8"))
    return content


@pytest.mark.parametrize(
    ("angle_deg", "shift_mm", "more"),
    [(10.0, 8.0, []), (25.0, 15.0, ["--global"]), (45.0, 20.0, ["--global"])],
)
def test_a_bone_is_found(bone: Bone, angle_deg: float, shift_mm: float, more: list[str]) -> None:
    start = bone.start(angle_deg, shift_mm)
    found = register(bone.scene, bone.model, "--initial", start, *bone.seen_from(), *more)
    assert found["status"] == "CONVERGED"
    assert found["reasons"] == []
    assert found["warnings"] == []
    assert bone.tre(found["scene_from_model"]) < 0.25
    assert found["command"] == "register"
    assert found["units"] == {"length": "mm", "angle": "deg"}
    assert found["rms"] == pytest.approx(0.3, abs=0.1)
    # 1500 of the 1800 points are of the bone; chance puts some of the others near it.
    assert 0.8 < found["inlier_share"] < 0.9
    assert found["coverage"] > 0.8
    assert found["starts"] == (14 if more else found["starts"])
    assert set(found["timing_ms"]) == {"read", "prepare", "register", "total"}
    assert "best_guess" not in found


@pytest.mark.release
def test_the_predicted_error_and_covariance_belong_to_the_error(bone: Bone) -> None:
    found = register(bone.scene, bone.model, "--initial", bone.start(5.0, 5.0))
    covariance = np.array(found["covariance"])
    np.testing.assert_allclose(covariance, covariance.T)
    assert np.linalg.eigvalsh(covariance).min() > 0.0
    assert bone.tre(found["scene_from_model"]) < found["predicted_tre"] < 0.5


@pytest.mark.release
def test_the_covariance_is_about_the_mean_of_the_file(bone: Bone) -> None:
    # Strays that are left out move the mean that the user sees, not the pose.
    far = np.array([[400.0, 0, 0], [401.0, 0, 0], [400.0, 1, 0]])
    n = len(bone.mesh.vertices_mm)
    start = bone.start(5.0, 5.0)
    plain = register(bone.scene, bone.model, "--initial", start)
    vertices = np.concatenate([bone.mesh.vertices_mm, np.repeat(far, 100, axis=0)])
    faces = np.concatenate([bone.mesh.faces, [[n, n + 100, n + 200]]])
    write_ply(bone.model, TriangleMesh(vertices, faces))
    found = register(bone.scene, bone.model, "--initial", start)
    assert any("tiny separate pieces" in warning for warning in found["warnings"])
    np.testing.assert_allclose(found["scene_from_model"], plain["scene_from_model"], atol=1e-9)
    shift = np.array(found["scene_from_model"])[:3, :3] @ (
        vertices.mean(axis=0) - bone.mesh.vertices_mm.mean(axis=0)
    )
    here, there = np.array(plain["covariance"]), np.array(found["covariance"])
    np.testing.assert_allclose(there[3:, 3:], here[3:, 3:])
    turn = np.cross(np.eye(3), shift)  # row i: e_i x shift, the point's way under that rotation
    moved = (
        here[:3, :3] + turn.T @ here[3:, :3] + here[:3, 3:] @ turn + turn.T @ here[3:, 3:] @ turn
    )
    np.testing.assert_allclose(there[:3, :3], moved, rtol=1e-6)


@pytest.mark.parametrize("more", few_of([[], ["--global"]]))
def test_metres_and_millimetres_give_the_same(bone: Bone, more: list[str]) -> None:
    in_mm = register(
        bone.scene, bone.model, "--initial", bone.start(10.0, 8.0), *bone.seen_from(), *more
    )
    bone.rng = np.random.default_rng(9)
    bone.write(1e-3, "m")
    start = json.loads((bone.folder / "start.json").read_text(encoding="utf-8"))["matrix"]
    for row in range(3):
        start[row][3] *= 1e-3
    (bone.folder / "start.json").write_text(json.dumps({"matrix": start}), encoding="utf-8")
    in_m = register(
        bone.scene, bone.model, "--initial", bone.folder / "start.json", *bone.seen_from(1e-3),
        *more, "--units", "m",
    )  # fmt: skip
    assert in_m["units"]["length"] == "m"
    assert in_m["warnings"] == []
    a, b = np.array(in_mm["scene_from_model"]), np.array(in_m["scene_from_model"])
    b[:3, 3] *= 1e3
    np.testing.assert_allclose(a, b, atol=1e-6)
    for key in ("rms", "predicted_tre"):
        assert 1e3 * in_m[key] == pytest.approx(in_mm[key], rel=1e-6)
    units = np.diag([1e3, 1e3, 1e3, 1.0, 1.0, 1.0])
    scaled = units @ np.array(in_m["covariance"]) @ units
    np.testing.assert_allclose(scaled, in_mm["covariance"], rtol=1e-4, atol=1e-12)


@pytest.mark.release
@pytest.mark.parametrize("scale", [700.0, 1e-4, 1.0])
def test_without_a_unit_any_size_is_found(bone: Bone, scale: float) -> None:
    bone.write(scale, "none")
    start = bone.start(10.0, 8.0, scale)
    found = register(bone.scene, bone.model, "--initial", start, "--units", "none")
    assert found["units"]["length"] == "none"
    assert found["warnings"] == []
    assert bone.tre(found["scene_from_model"], scale) < 0.25
    assert found["rms"] == pytest.approx(0.3 * scale, rel=0.3)


@pytest.mark.release
def test_the_pose_of_a_result_or_a_text_starts_the_next(bone: Bone) -> None:
    found = register(bone.scene, bone.model, "--initial", bone.start(10.0, 8.0))
    again = bone.folder / "again.json"
    again.write_text(json.dumps(found), encoding="utf-8")
    camera = bone.folder / "camera.json"
    camera.write_text(json.dumps({"camera_from_model": found["scene_from_model"]}))
    text = bone.folder / "again.txt"
    np.savetxt(text, found["scene_from_model"], header="a pose")
    for path in (again, camera, text):
        second = register(bone.scene, bone.model, "--initial", path)
        np.testing.assert_allclose(second["scene_from_model"], found["scene_from_model"], atol=0.02)


def obj_bytes(mesh: TriangleMesh) -> bytes:
    content = "".join(f"v {x!r} {y!r} {z!r}\n" for x, y, z in mesh.vertices_mm.tolist())
    content += "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in mesh.faces.tolist())
    return content.encode()


def stl_bytes(mesh: TriangleMesh) -> bytes:
    facets = np.zeros(len(mesh.faces), dtype=[("n", "<f4", 3), ("c", "<f4", (3, 3)), ("a", "<u2")])
    facets["c"] = mesh.vertices_mm[mesh.faces]
    return bytes(80) + len(facets).to_bytes(4, "little") + facets.tobytes()


def vtk_bytes(mesh: TriangleMesh) -> bytes:
    n, m = len(mesh.vertices_mm), len(mesh.faces)
    return (
        f"# vtk DataFile Version 3.0\nbone\nASCII\nDATASET POLYDATA\nPOINTS {n} double\n".encode()
        + lines(mesh.vertices_mm.tolist())
        + f"POLYGONS {m} {4 * m}\n".encode()
        + lines([[3, *face] for face in mesh.faces.tolist()])
    )


@pytest.mark.parametrize("kind", ["stl", "obj", "vtk", "pcd", "xyzn"])
def test_files_of_every_kind_are_registered(bone: Bone, kind: str) -> None:
    with_normals = np.hstack([bone.mesh.vertices_mm, bone.mesh.normals])
    content = {
        "stl": lambda: stl_bytes(bone.mesh),
        "obj": lambda: obj_bytes(bone.mesh),
        "vtk": lambda: vtk_bytes(bone.mesh),
        "pcd": lambda: pcd("binary", with_normals, "x y z normal_x normal_y normal_z"),
        "xyzn": lambda: lines(with_normals.tolist()),
    }[kind]()
    model, scene = bone.folder / f"model.{kind}", bone.folder / "scene.xyz"
    model.write_bytes(content)
    scene.write_bytes(lines(bone.points.tolist()))
    found = register(scene, model, "--initial", bone.start(10.0, 8.0), *bone.seen_from())
    assert found["status"] == "CONVERGED"
    assert found["warnings"] == []
    assert bone.tre(found["scene_from_model"]) < 0.25


def test_a_cloud_without_normals_gets_them_and_says_so(bone: Bone) -> None:
    write_ply(bone.model, TriangleMesh(bone.mesh.vertices_mm, NO_FACES))
    start = bone.start(10.0, 8.0)
    found = register(bone.scene, bone.model, "--initial", start, *bone.seen_from())
    assert len(found["warnings"]) == 1
    assert "no normals" in found["warnings"][0]
    assert bone.tre(found["scene_from_model"]) < 0.3


def test_inward_normals_are_turned(bone: Bone) -> None:
    write_ply(bone.model, bone.mesh.flip())
    start = bone.start(10.0, 8.0)
    found = register(bone.scene, bone.model, "--initial", start, *bone.seen_from())
    assert "pointed inwards" in found["warnings"][0]
    assert bone.tre(found["scene_from_model"]) < 0.25


@pytest.mark.parametrize("method", ["icp", "bimcc-literal"])
def test_the_papers_methods_answer_too(bone: Bone, method: str) -> None:
    # Only the bone, seen from all sides: what plain ICP asks for.
    everywhere = bone.true.apply(bone.mesh.vertices_mm)
    write_ply(bone.scene, TriangleMesh(everywhere, NO_FACES))
    start = bone.start(3.0, 2.0)
    found = register(bone.scene, bone.model, "--initial", start, "--method", method)
    assert found["method"] == method
    assert found["starts"] == 1
    assert bone.tre(found["scene_from_model"]) < 1.0


@pytest.mark.release
def test_the_aligned_model_lies_in_the_scene(bone: Bone) -> None:
    bone.write(1e-3, "m")
    out = bone.folder / "aligned.ply"
    found = register(
        bone.scene, bone.model, "--initial", bone.start(10.0, 8.0, 1e-3), "--units", "m",
        "--aligned", out,
    )  # fmt: skip
    aligned = read_surface_file(out)
    assert aligned.unit == "m"
    np.testing.assert_array_equal(aligned.mesh.faces, bone.mesh.faces)
    pose = np.array(found["scene_from_model"])
    placed = 1e-3 * bone.mesh.vertices_mm @ pose[:3, :3].T + pose[:3, 3]
    np.testing.assert_allclose(aligned.mesh.vertices_mm, placed, atol=1e-12)


def test_people_read_two_lines_and_the_pose(bone: Bone, capsys) -> None:
    options = [str(bone.scene), str(bone.model), "--initial", bone.start(5.0, 5.0)]
    assert run(["register", *options, *bone.seen_from()]) == 0
    told = capsys.readouterr()
    rows = told.out.splitlines()
    assert rows[0].startswith("CONVERGED: rms 0.")
    assert all(word in rows[0] for word in ("% of 1800 points fit", "predicted error", " ms"))
    assert rows[1] == "scene_from_model"
    pose = np.array([[float(word) for word in row.split()] for row in rows[2:]])
    assert bone.tre(pose) < 0.25
    assert told.err == ""


def test_json_on_stdout_stands_alone(bone: Bone, capsys) -> None:
    options = [str(bone.scene), str(bone.model), "--initial", bone.start(5.0, 5.0)]
    assert run(["register", *options, "--json", "-"]) == 0
    assert json.loads(capsys.readouterr().out)["status"] == "CONVERGED"


# ------------------------------------------------------------------ no registration, and why


def test_a_failed_registration_gives_no_pose(bone: Bone, capsys) -> None:
    # Another shape of the same size.
    write_ply(bone.model, sphere(35.0, 40))
    out = bone.folder / "aligned.ply"
    far = bone.folder / "far.txt"
    np.savetxt(far, np.eye(4))
    found = register(bone.scene, bone.model, "--initial", far, "--aligned", out, code=4)
    assert found["status"] == "FAILED"
    assert found["reasons"]
    assert found["scene_from_model"] is None
    assert found["covariance"] is None
    assert found["predicted_tre"] is None
    assert np.array(found["best_guess"]).shape == (4, 4)
    assert not out.exists()
    told = capsys.readouterr()
    assert "aligned.ply was not written" in told.err
    assert f"navapp: error: the registration is FAILED: {found['reasons'][0]}" in told.err
    assert "scene_from_model" not in told.out


def plate(width_mm: float, n: int) -> TriangleMesh:
    steps = np.linspace(-0.5 * width_mm, 0.5 * width_mm, n + 1)
    grid = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    first = (np.arange(n * (n + 1)).reshape(n, n + 1)[:, :-1]).ravel()
    faces = np.concatenate(
        [
            np.column_stack([first, first + 1, first + n + 1]),
            np.column_stack([first + 1, first + n + 2, first + n + 1]),
        ]
    )
    return TriangleMesh(np.column_stack([grid, np.zeros(len(grid))]), faces)


def test_a_plate_slides_and_the_reasons_say_where(tmp_path: Path, capsys) -> None:
    noise = 0.1 * np.random.default_rng(4).normal(size=(41 * 41, 3))
    scene, model, out = (tmp_path / f"{name}.ply" for name in ("scene", "model", "aligned"))
    write_ply(scene, TriangleMesh(plate(40.0, 40).vertices_mm + noise, NO_FACES))
    write_ply(model, plate(60.0, 60))
    found = register(scene, model, "--aligned", out, code=4)
    assert found["status"] == "DEGENERATE"
    free = [reason for reason in found["reasons"] if reason.startswith("not fixed: ")]
    assert sum("translation along" in reason for reason in free) == 2
    assert sum("rotation about (0, 0, 1)" in reason for reason in free) == 1
    assert found["scene_from_model"] is not None
    assert found["covariance"] is None
    assert found["predicted_tre"] is None
    assert out.exists()
    told = capsys.readouterr()
    assert "navapp: error: the registration is DEGENERATE" in told.err
    assert "scene_from_model" in told.out


@pytest.mark.release
@pytest.mark.parametrize("method", ["bimcc", "icp"])
def test_a_ball_turns_and_is_no_registration(tmp_path: Path, method: str) -> None:
    ball = sphere(25.0, 60)
    cap = ball.vertices_mm[ball.vertices_mm[:, 2] < -8.0]
    noise = 0.1 * np.random.default_rng(4).normal(size=cap.shape)
    scene, model = tmp_path / "scene.ply", tmp_path / "model.ply"
    write_ply(scene, TriangleMesh(cap + noise, NO_FACES))
    write_ply(model, ball)
    found = register(scene, model, "--method", method, code=4)
    assert found["status"] in ("DEGENERATE", "FAILED")
    assert found["reasons"]


@pytest.mark.release
@pytest.mark.parametrize("larger", ["scene", "model"])
@pytest.mark.parametrize("units", ["mm", "m", "none"])
def test_files_of_different_units_are_noticed(bone: Bone, larger: str, units: str, capsys) -> None:
    small, scale = (bone.model, 1e-3) if larger == "scene" else (bone.scene, 1e-3)
    mesh = read_surface_file(small).mesh
    write_ply(small, TriangleMesh(scale * mesh.vertices_mm, mesh.faces), unit="m")
    start = bone.start(0.0, 0.0, 1.0 if larger == "scene" else scale)
    found = register(bone.scene, bone.model, "--initial", start, "--units", units, code=4)
    assert found["status"] == "FAILED"
    told = capsys.readouterr().err
    assert f"the {larger} is about 1000 times as large as the" in told
    asked = "is their unit the same?" if units == "none" else "is one of them in m?"
    assert asked in told
    if units != "none":
        assert f"--units says {units}" in told


@pytest.mark.release
def test_metres_taken_for_millimetres_do_not_pass(bone: Bone, capsys) -> None:
    bone.write(1e-3, "")
    found = register(bone.scene, bone.model, "--initial", bone.start(5.0, 5.0, 1e-3), code=4)
    assert found["status"] == "FAILED"
    assert any(reason == "the model is too small to fix a bone" for reason in found["reasons"])
    assert "no bone's size: is --units right?" in capsys.readouterr().err


@pytest.mark.parametrize("n", few_of([59, 1, 2]))
@pytest.mark.parametrize("method", ["bimcc", "bimcc-literal", "icp"])
def test_few_points_fail_with_the_reason(bone: Bone, n: int, method: str) -> None:
    write_ply(bone.scene, TriangleMesh(bone.points[:n], NO_FACES))
    start = bone.start(0.0, 0.0)
    found = register(bone.scene, bone.model, "--initial", start, "--method", method, code=4)
    assert found["status"] == "FAILED"
    assert "too few points on the bone" in found["reasons"]
    assert found["rms"] is None


def test_repeated_points_count_once(bone: Bone) -> None:
    write_ply(bone.scene, TriangleMesh(np.repeat(bone.points[:3], 500, axis=0), NO_FACES))
    found = register(bone.scene, bone.model, "--initial", bone.start(0.0, 0.0), code=4)
    assert found["scene_points"] == 3
    assert "1497 of 1500 points repeat others" in found["warnings"][0]


@pytest.mark.parametrize("shape", few_of(["line", "plane"]))
def test_flat_and_straight_scenes_are_no_registration(bone: Bone, shape: str) -> None:
    middle = bone.mesh.vertices_mm[np.argmin(bone.mesh.vertices_mm[:, 2])]
    table = bone.rng.uniform(-30, 30, (800, 3))
    table[:, 2] = 0.0
    if shape == "line":
        table[:, 1] = 0.0
    write_ply(bone.scene, TriangleMesh(middle + table, NO_FACES))
    found = register(bone.scene, bone.model, code=4)
    assert found["status"] in ("DEGENERATE", "FAILED")
    assert found["reasons"]


@pytest.mark.release
def test_a_straight_model_is_no_registration(bone: Bone) -> None:
    write_ply(bone.model, TriangleMesh(np.outer(np.arange(300.0), [0.3, 0, 0]), NO_FACES))
    found = register(bone.scene, bone.model, "--initial", bone.start(0.0, 0.0), code=4)
    assert found["scene_from_model"] is None


@pytest.mark.release
def test_points_that_are_not_finite_are_told(bone: Bone) -> None:
    points = bone.points.copy()
    points[::9] = np.nan
    (bone.folder / "scene.xyz").write_bytes(lines(points.tolist()))
    start = bone.start(5.0, 5.0)
    found = register(bone.folder / "scene.xyz", bone.model, "--initial", start)
    assert "200 points are not finite" in found["warnings"][0]
    assert bone.tre(found["scene_from_model"]) < 0.25


@pytest.mark.release
@pytest.mark.slow
def test_a_large_cloud_is_subsampled_and_it_says_so(bone: Bone) -> None:
    many = np.repeat(bone.points[:1500], 140, axis=0)
    many += 0.3 * bone.rng.normal(size=many.shape)
    write_ply(bone.scene, TriangleMesh(many, NO_FACES))
    start = bone.start(10.0, 8.0)
    first = register(bone.scene, bone.model, "--initial", start)
    assert first["warnings"] == [f"scene {bone.scene}: 20000 of 210000 points are used"]
    assert bone.tre(first["scene_from_model"]) < 0.1
    second = register(bone.scene, bone.model, "--initial", start)
    assert second["scene_from_model"] == first["scene_from_model"]


@pytest.mark.release
@pytest.mark.slow
@pytest.mark.parametrize("is_mesh", [True, False])
def test_a_fine_model_is_thinned_and_it_says_so(bone: Bone, is_mesh: bool) -> None:
    mesh = fine_end_of_femur()
    write_ply(bone.model, TriangleMesh(mesh.vertices_mm, mesh.faces if is_mesh else NO_FACES))
    found = register(bone.scene, bone.model, "--initial", bone.start(10.0, 8.0))
    assert "were thinned to" in found["warnings"][0]
    assert found["model_vertices"] <= 50_000
    assert bone.tre(found["scene_from_model"]) < 0.25


@lru_cache
def fine_end_of_femur() -> TriangleMesh:
    mesh = end_of_femur()
    while len(mesh.vertices_mm) < 60_000:
        mesh = divided(mesh)
    return mesh


def divided(mesh: TriangleMesh) -> TriangleMesh:
    """Every triangle in four."""
    corners = mesh.vertices_mm[mesh.faces]
    a, b, c = corners.swapaxes(0, 1)
    ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
    four = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    soup = np.concatenate([np.stack(three, axis=1) for three in four]).reshape(-1, 3)
    vertices, index = np.unique(soup, axis=0, return_inverse=True)
    return TriangleMesh(vertices, index.reshape(-1, 3))


# ------------------------------------------------------------------ refusals


def refused(options: list[object], capsys, code: int, *words: str) -> None:
    capsys.readouterr()
    assert run(["--quiet", "register", *map(str, options)]) == code
    text = capsys.readouterr().err
    assert text.count("\n") == 1
    assert text.startswith("navapp: error: ")
    assert all(word in text for word in words), text


@pytest.mark.parametrize("method", ["icp", "bimcc-literal"])
def test_many_starts_are_for_the_production_method(bone: Bone, method: str, capsys) -> None:
    options = [bone.scene, bone.model, "--global", "--method", method]
    refused(options, capsys, 2, "--global", method)


def test_a_camera_is_three_finite_numbers(bone: Bone, capsys) -> None:
    files = [bone.scene, bone.model]
    refused([*files, "--camera", "nan", "0", "0"], capsys, 2, "--camera")
    assert run(["--quiet", "register", *map(str, files), "--camera", "1", "2"]) == 2


@pytest.mark.parametrize("which", [0, 1])
@pytest.mark.parametrize(
    ("content", "words"),
    [
        (None, ["cannot be read"]),
        (b"", ["not a usable PLY file"]),
        (b"ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\n"
         b"property float z\nend_header\n", ["no point with finite coordinates"]),
        (b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
         b"property float z\nend_header\nnan nan nan\n", ["no point with finite coordinates"]),
    ],
)  # fmt: skip
def test_unusable_files_are_refused(bone: Bone, which: int, content, words, capsys) -> None:
    bad = bone.folder / "bad.ply"
    if content is not None:
        bad.write_bytes(content)
    files: list[object] = [bone.scene, bone.model]
    files[which] = bad
    refused(files, capsys, 3, "bad.ply", *words)


@pytest.mark.parametrize("which", ["scene", "model"])
@pytest.mark.parametrize("coordinate", [1e160, -1e300])
def test_numbers_beyond_all_measure_are_refused(bone: Bone, which, coordinate, capsys) -> None:
    path = bone.scene if which == "scene" else bone.model
    points = np.concatenate([bone.points, [[0.0, coordinate, 0.0]]])
    with np.errstate(over="ignore"):
        write_ply(path, TriangleMesh(points, NO_FACES))
    refused([bone.scene, bone.model], capsys, 3, path.name, "a coordinate of 1e+")


@pytest.mark.release
def test_a_point_far_away_does_no_harm(bone: Bone) -> None:
    start = bone.start(5.0, 5.0)
    bone.points[0] = 1e8
    write_ply(bone.scene, TriangleMesh(bone.points, NO_FACES))
    found = register(bone.scene, bone.model, "--initial", start)
    assert bone.tre(found["scene_from_model"]) < 0.25


@pytest.mark.parametrize("n", [1, 3])
def test_a_model_of_a_few_points_is_no_surface(bone: Bone, n: int, capsys) -> None:
    points = np.repeat(bone.mesh.vertices_mm[:n], 200, axis=0)
    write_ply(bone.model, TriangleMesh(points, NO_FACES))
    refused([bone.scene, bone.model], capsys, 3, "model.ply", f"{n} different points")


def test_a_model_of_triangles_without_area_is_no_surface(bone: Bone, capsys) -> None:
    points = np.outer(np.arange(90.0), [1.0, 2.0, 0.0])
    write_ply(bone.model, TriangleMesh(points, np.arange(90).reshape(-1, 3)))
    refused([bone.scene, bone.model], capsys, 3, "no surface")


@pytest.mark.parametrize(
    "text",
    [
        "",
        "x",
        "[]",
        "{}",
        '{"matrix": null}',
        '{"matrix": [[1, 0], [0, 1]]}',
        '{"matrix": "four by four"}',
        '{"matrix": [[NaN,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}',
        '{"matrix": [[1,0,0,0],[0,1,0,0],[0,0,-1,0],[0,0,0,1]]}',
        '{"matrix": [[2,0,0,0],[0,2,0,0],[0,0,2,0],[0,0,0,1]]}',
    ],
)
@pytest.mark.parametrize("suffix", ["json", "txt"])
def test_a_start_that_is_no_pose_is_refused(bone: Bone, text: str, suffix: str, capsys) -> None:
    path = bone.folder / f"start.{suffix}"
    path.write_text(text, encoding="utf-8")
    refused([bone.scene, bone.model, "--initial", path], capsys, 3, f"start.{suffix}")


def test_a_missing_start_is_refused(bone: Bone, capsys) -> None:
    path = bone.folder / "none.json"
    refused([bone.scene, bone.model, "--initial", path], capsys, 3, "none.json", "cannot be read")


@pytest.mark.parametrize("option", ["--aligned", "--json"])
def test_a_target_that_cannot_be_written_is_refused_first(bone: Bone, option: str, capsys) -> None:
    path = bone.folder / "nowhere" / "out"
    refused(["none.ply", "none.ply", option, path], capsys, 3, "nowhere")


# ------------------------------------------------------------------ recorded data


@pytest.mark.data
@pytest.mark.parametrize("more", few_of([[], ["--global"]]))
def test_two_scans_of_a_bunny(data: Path, tmp_path: Path, more: list[str]) -> None:
    folder = data / "reg" / "pcl_bunny"
    out = tmp_path / "o.json"
    files = [str(folder / "bun4.pcd"), str(folder / "bun0.pcd")]
    assert run(["--quiet", "register", *files, "--units", "m", "--json", str(out), *more]) == 0
    found = json.loads(out.read_text(encoding="utf-8"))
    pose = RigidTransform("scene", "model", found["scene_from_model"])
    published = RigidTransform(
        "scene", "model", np.loadtxt(folder / "T_bun4_from_bun0_published.txt")
    )
    assert rotation_angle_deg(pose, published) < 2.0
    centre = read_surface_file(files[1]).mesh.centroid_mm
    assert np.linalg.norm(pose.apply(centre) - published.apply(centre)) < 3e-3
    assert np.linalg.norm(pose.translation_mm - published.translation_mm) < 3e-3


@pytest.mark.release
@pytest.mark.data
@pytest.mark.slow
def test_two_surfaces_without_a_unit(data: Path, tmp_path: Path) -> None:
    folder = data / "reg" / "fricp_example"
    out = tmp_path / "o.json"
    files = [str(folder / "target.ply"), str(folder / "source.ply")]
    options = ["--global", "--units", "none", "--json", str(out)]
    assert run(["--quiet", "register", *files, *options]) == 0
    found = np.array(json.loads(out.read_text(encoding="utf-8"))["scene_from_model"])
    reference = np.loadtxt(folder / "T_target_from_source_reference.txt")
    scene, model = (read_surface_file(path).mesh.vertices_mm for path in files)
    tree = cKDTree(scene)
    ours, theirs = (
        np.sort(tree.query(model @ pose[:3, :3].T + pose[:3, 3])[0]) for pose in (found, reference)
    )
    for share in (0.3, 0.5, 0.6, 0.7):
        n = int(share * len(model))
        assert np.sqrt((ours[:n] ** 2).mean()) <= 1.01 * np.sqrt((theirs[:n] ** 2).mean())


@pytest.mark.release
def test_people_are_told_no_unit_where_the_files_have_none(
    bone: Bone, capsys: pytest.CaptureFixture[str]
) -> None:
    bone.write(1e-4, "none")
    start = bone.start(5.0, 4.0, 1e-4)
    options = [str(bone.scene), str(bone.model), "--initial", start, "--units", "none"]
    assert run(["register", *options]) == 0
    told = capsys.readouterr()
    assert "lengths in the files' own unit" in told.out
    assert not re.search(r"\d (mm|m)\b", told.out + told.err)


def test_files_without_a_unit_that_differ_in_size_are_told_so(
    bone: Bone, capsys: pytest.CaptureFixture[str]
) -> None:
    bone.write(1.0, "none")
    write_ply(bone.scene, TriangleMesh(1e-3 * bone.points, NO_FACES), unit="none")
    assert run(["register", str(bone.scene), str(bone.model), "--units", "none"]) == 4
    told = capsys.readouterr().err
    assert "1000 times as large" in told
    assert "is their unit the same?" in told
    assert "in m?" not in told
