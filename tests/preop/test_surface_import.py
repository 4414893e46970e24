import numpy as np
import pytest

from navapp.errors import InputError, PlanError
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.ply import write_ply
from navapp.preop import import_surface
from tests.geometry.shapes import cube, sphere

BONE = sphere(40.0, 16, (5.0, -20.0, 100.0))


@pytest.fixture
def imported(tmp_path):
    def run(mesh, side="right", **tags):
        write_ply(tmp_path / "bone.ply", mesh, **tags)
        return import_surface("femur", tmp_path / "bone.ply", side)

    return run


def joined(*meshes):
    vertices = np.vstack([mesh.vertices_mm for mesh in meshes])
    starts = np.cumsum([0, *(len(mesh.vertices_mm) for mesh in meshes[:-1])])
    faces = [mesh.faces + start for mesh, start in zip(meshes, starts, strict=True)]
    return TriangleMesh(vertices, np.vstack(faces))


def test_a_clean_surface_is_taken_as_it_is(imported):
    surface = imported(BONE)
    assert surface.warnings == ()
    assert (surface.bone.name, surface.bone.side) == ("femur", "right")
    np.testing.assert_array_equal(surface.bone.mesh.vertices_mm, BONE.vertices_mm)
    np.testing.assert_array_equal(surface.bone.mesh.faces, BONE.faces)


@pytest.mark.parametrize("kind", ["open", "stray"])
def test_a_surface_that_is_not_closed_is_told(imported, kind):
    faces = BONE.faces[5:] if kind == "open" else np.vstack([BONE.faces, BONE.faces[:1, ::-1]])
    surface = imported(TriangleMesh(BONE.vertices_mm, faces))
    assert [w for w in surface.warnings if "open or has stray triangles" in w]


def test_ras_becomes_lps(imported):
    surface = imported(BONE, space="RAS")
    np.testing.assert_array_equal(
        surface.bone.mesh.vertices_mm, BONE.vertices_mm * [-1.0, -1.0, 1.0]
    )
    assert surface.bone.mesh.volume_mm3() == pytest.approx(BONE.volume_mm3())
    assert surface.warnings == ()


def test_a_surface_without_a_space_is_taken_as_lps_with_a_warning(imported):
    surface = imported(BONE, space="")
    np.testing.assert_array_equal(surface.bone.mesh.vertices_mm, BONE.vertices_mm)
    assert len(surface.warnings) == 1
    assert "LPS is assumed" in surface.warnings[0]


def test_an_unknown_space_is_refused(imported):
    with pytest.raises(PlanError, match=r"unknown space SCANNER.*LPS or RAS"):
        imported(BONE, space="scanner")


@pytest.mark.parametrize("unit", ["m", "cm", "inch"])
def test_another_unit_is_refused(imported, unit):
    with pytest.raises(PlanError, match=rf"unit is {unit}"):
        imported(BONE, unit=unit)


def test_a_file_without_a_unit_is_taken_as_mm(imported):
    assert imported(BONE, unit="").bone.mesh.size_mm[2] == pytest.approx(80.0)


def test_inward_normals_are_turned(imported):
    surface = imported(BONE.flip())
    assert surface.bone.mesh.volume_mm3() > 0
    assert "inwards" in surface.warnings[0]
    outward = surface.bone.mesh.vertices_mm - [5.0, -20.0, 100.0]
    assert (np.einsum("ij,ij->i", surface.bone.mesh.normals, outward) > 0).all()


def test_stray_triangles_are_left_out_and_counted(imported):
    surface = imported(joined(cube(3.0, (90, 0, 0)), BONE))
    np.testing.assert_array_equal(surface.bone.mesh.vertices_mm, BONE.vertices_mm)
    assert surface.warnings == ("femur: 12 triangles of separate pieces were left out",)


def test_a_stray_piece_far_away_does_not_make_the_bone_too_long(imported):
    surface = imported(joined(BONE, cube(3.0, (2000, 0, 0))))
    assert surface.bone.mesh.size_mm.max() == pytest.approx(80.0)


def test_a_stray_piece_does_not_make_a_crumb_long_enough(imported):
    with pytest.raises(PlanError, match=r"is 8 mm long"):
        imported(joined(sphere(4.0), cube(3.0, (80, 0, 0))))


@pytest.mark.parametrize(
    ("factor", "hint"), [(0.001, "looks like m,"), (0.1, "looks like cm,"), (1000.0, "micrometres")]
)
def test_another_unit_is_guessed_from_the_size(imported, factor, hint):
    with pytest.raises(PlanError, match=hint):
        imported(TriangleMesh(BONE.vertices_mm * factor, BONE.faces))


def test_a_size_of_nothing_known_is_refused(imported):
    with pytest.raises(PlanError, match="which no knee bone is"):
        imported(TriangleMesh(BONE.vertices_mm * 1e-7, BONE.faces))


def test_too_few_triangles_are_refused(imported):
    with pytest.raises(PlanError, match="has only 12 triangles"):
        imported(cube(80.0))


def test_points_without_triangles_are_refused(imported):
    with pytest.raises(PlanError, match="has only 0 triangles"):
        imported(TriangleMesh(BONE.vertices_mm, np.empty((0, 3), dtype=np.int32)))


def test_triangles_that_share_no_vertices_are_refused(imported):
    """As exported through STL: each triangle would be a piece of its own."""
    loose = TriangleMesh(
        BONE.vertices_mm[BONE.faces].reshape(-1, 3), np.arange(BONE.faces.size).reshape(-1, 3)
    )
    with pytest.raises(PlanError, match=r"separate pieces.*shared vertices"):
        imported(loose)


def test_a_missing_or_damaged_file_is_named(tmp_path):
    with pytest.raises(InputError, match=r"none\.ply"):
        import_surface("femur", tmp_path / "none.ply")
    (tmp_path / "bad.ply").write_bytes(b"ply\n")
    with pytest.raises(InputError, match=r"bad\.ply"):
        import_surface("femur", tmp_path / "bad.ply")
