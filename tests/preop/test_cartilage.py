import numpy as np
import pytest

from navapp.errors import InputError, PlanError
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.ply import write_ply
from navapp.preop import figures_of, import_cartilage, make_even_cartilage
from navapp.preop.cartilage import MAPPED_SD_MM
from navapp.values import BoneModel
from sim_devices.anatomy import KneeSpec, make_knee
from sim_devices.cartilage import make_cartilage_thickness_mm
from tests.geometry.shapes import cube, sphere

CENTRE = (5.0, -20.0, 100.0)
BONE = BoneModel("femur", sphere(40.0, 24, CENTRE), "right")
HEIGHT = BONE.mesh.vertices_mm[:, 2] - CENTRE[2]


@pytest.fixture
def covered(tmp_path):
    def run(mesh, **tags):
        write_ply(tmp_path / "cartilage.ply", mesh, **tags)
        return import_cartilage(BONE, tmp_path / "cartilage.ply")

    return run


def raised(thickness_mm, mesh=BONE.mesh):
    """The surface that lies a thickness (V,) above a bone."""
    return TriangleMesh(
        mesh.vertices_mm + np.asarray(thickness_mm)[..., None] * mesh.normals, mesh.faces
    )


def part(mesh, is_kept):
    return TriangleMesh(mesh.vertices_mm, mesh.faces[is_kept[mesh.faces].all(axis=1)])


CAP_MM = np.where(HEIGHT > 5.0, np.clip(0.1 * (HEIGHT - 4.0), 0.0, 2.5), 0.0)


def test_the_thickness_is_the_distance_along_the_normal(covered):
    found = covered(raised(CAP_MM))
    assert found.warnings == ()
    np.testing.assert_allclose(found.bone.cartilage_mm, CAP_MM, atol=1e-3)
    assert found.bone.mesh is BONE.mesh
    assert (found.bone.name, found.bone.side) == ("femur", "right")


def test_a_surface_with_triangles_of_its_own_is_measured_between_its_vertices(covered):
    found = covered(sphere(42.0, 41, CENTRE))
    np.testing.assert_allclose(found.bone.cartilage_mm, 2.0, atol=0.08)


def test_the_deviation_is_there_where_cartilage_is(covered):
    bone = covered(raised(CAP_MM)).bone
    np.testing.assert_array_equal(
        bone.cartilage_sd_mm, np.where(bone.cartilage_mm > 0.0, MAPPED_SD_MM, 0.0)
    )
    assert (bone.cartilage_sd_mm == 0.0).any()


def test_where_the_surfaces_coincide_there_is_none(covered):
    bone = covered(raised(np.where(HEIGHT > 0.0, 2.0, 0.0))).bone
    assert (bone.cartilage_mm[HEIGHT < -1.0] == 0.0).all()
    assert (bone.cartilage_sd_mm[HEIGHT < -1.0] == 0.0).all()


def test_a_patch_covers_what_it_lies_over(covered):
    bone = covered(part(sphere(42.0, 41, CENTRE), sphere(42.0, 41).vertices_mm[:, 2] > 0.0)).bone
    np.testing.assert_allclose(bone.cartilage_mm[HEIGHT > 4.0], 2.0, atol=0.08)
    assert (bone.cartilage_mm[HEIGHT < -1.0] == 0.0).all()


def test_a_closed_shell_is_measured_to_its_outer_side(covered):
    inner, outer = sphere(40.0, 24, CENTRE).flip(), sphere(42.0, 41, CENTRE)
    shell = TriangleMesh(
        np.vstack([inner.vertices_mm, outer.vertices_mm]),
        np.vstack([inner.faces, outer.faces + len(inner.vertices_mm)]),
    )
    np.testing.assert_allclose(covered(shell).bone.cartilage_mm, 2.0, atol=0.08)


def test_the_neighbouring_bone_s_surface_is_not_this_one_s_cartilage(covered):
    """It looks the other way, and its far side is too far."""
    own = raised(CAP_MM)
    neighbour = sphere(20.0, 16, (CENTRE[0], CENTRE[1], CENTRE[2] - 40.0 - 3.0 - 20.0))
    both = TriangleMesh(
        np.vstack([own.vertices_mm, neighbour.vertices_mm]),
        np.vstack([own.faces, neighbour.faces + len(own.vertices_mm)]),
    )
    np.testing.assert_allclose(covered(both).bone.cartilage_mm, CAP_MM, atol=1e-3)


def test_shallow_dips_beneath_the_bone_are_no_cartilage(covered):
    dips = np.where(HEIGHT < 0.0, -0.3, CAP_MM)
    np.testing.assert_allclose(covered(raised(dips)).bone.cartilage_mm[HEIGHT < -4.0], 0.0)


def test_inward_normals_of_a_closed_surface_are_turned(covered):
    found = covered(raised(CAP_MM).flip())
    np.testing.assert_allclose(found.bone.cartilage_mm, CAP_MM, atol=1e-3)
    assert "turned" in found.warnings[0]


def test_ras_becomes_lps(covered):
    mirrored = TriangleMesh(raised(CAP_MM).vertices_mm * (-1.0, -1.0, 1.0), BONE.mesh.faces)
    bone = covered(mirrored, space="RAS").bone
    np.testing.assert_allclose(bone.cartilage_mm, CAP_MM, atol=1e-3)


@pytest.mark.parametrize(
    ("mesh", "words"),
    [
        (raised(np.full(len(HEIGHT), -2.0)), r"lies inside the femur, by up to 2\.0 mm: .*outer"),
        (raised(np.where(HEIGHT > 20.0, 2.0, -1.0)), "lies inside the femur"),
        (sphere(42.0, 24, (CENTRE[0] + 6.0, *CENTRE[1:])), "lies inside the femur"),
        (sphere(42.0, 24, (300.0, 0.0, 0.0)), r"lies \d+ mm away from the femur: .*coordinates"),
        (raised(np.full(len(HEIGHT), 8.0)), "lies 8 mm away from the femur"),
        (TriangleMesh(raised(CAP_MM).vertices_mm / 1000.0, BONE.mesh.faces), "mm away.*in mm"),
        (BONE.mesh, "lies nowhere outside the femur"),
        (part(raised(CAP_MM), HEIGHT > 10.0).flip(), "nowhere outside.*outward normals"),
        (cube(80.0), "has only 12 triangles"),
    ],
)
def test_a_surface_that_is_not_this_bone_s_cartilage_is_refused(covered, mesh, words):
    with pytest.raises(PlanError, match=words) as caught:
        covered(mesh)
    assert caught.value.subject.endswith("cartilage.ply")


@pytest.mark.parametrize("name", ["femur", "tibia", "patella"])
def test_the_cartilage_of_a_knee_is_found_again_from_its_outer_surface(tmp_path, name):
    """Also in the notch and where bare bone goes over into cartilage."""
    knee = make_knee(KneeSpec(4))
    mesh = TriangleMesh(knee.bones[name].vertices_mm, knee.bones[name].faces)
    true = make_cartilage_thickness_mm(knee, name, 2.0, 4)
    true[true < 0.1] = 0.0
    write_ply(tmp_path / "cartilage.ply", raised(true, mesh))
    found = import_cartilage(BoneModel(name, mesh), tmp_path / "cartilage.ply").bone.cartilage_mm
    assert (np.abs(found - true) > 0.05).mean() < 0.001
    assert (found[true == 0.0] == 0.0).mean() > 0.999


def test_another_unit_or_a_missing_file_is_refused(covered, tmp_path):
    with pytest.raises(PlanError, match="unit is m"):
        covered(raised(CAP_MM), unit="m")
    with pytest.raises(InputError, match=r"none\.ply"):
        import_cartilage(BONE, tmp_path / "none.ply")


def test_one_thickness_covers_a_whole_bone():
    bone = make_even_cartilage(BONE, 2.0, 0.6)
    assert (bone.cartilage_mm == 2.0).all()
    assert (bone.cartilage_sd_mm == 0.6).all()


def test_one_thickness_leaves_flat_ends_bare():
    shaft = TriangleMesh(
        np.clip(BONE.mesh.vertices_mm, None, (np.inf, np.inf, CENTRE[2] + 30.0)), BONE.mesh.faces
    )
    bone = make_even_cartilage(BoneModel("femur", shaft), 2.0, 0.6)
    np.testing.assert_array_equal(bone.cartilage_mm, np.where(HEIGHT >= 30.0, 0.0, 2.0))
    np.testing.assert_array_equal(bone.cartilage_sd_mm, np.where(HEIGHT >= 30.0, 0.0, 0.6))


def test_one_thickness_leaves_open_borders_bare():
    bowl = part(BONE.mesh, HEIGHT < 30.0)
    bone = make_even_cartilage(BoneModel("femur", bowl), 2.0, 0.6)
    border = HEIGHT[np.unique(bowl.faces)].max()
    is_bare = np.abs(HEIGHT - border) < 1e-6
    np.testing.assert_array_equal(bone.cartilage_mm == 0.0, is_bare)


@pytest.mark.parametrize(
    ("mean_mm", "sd_mm"), [(-0.1, 0.5), (10.1, 0.5), (np.nan, 0.5), (2.0, np.nan), (2.0, -1.0)]
)
def test_an_impossible_thickness_is_refused(mean_mm, sd_mm):
    with pytest.raises(ValueError, match="not possible"):
        make_even_cartilage(BONE, mean_mm, sd_mm)


def test_the_figures_are_of_the_covered_part(covered):
    assert figures_of(BONE) is None
    bone = covered(raised(np.where(HEIGHT > 0.0, 2.0, 0.0))).bone
    found = figures_of(bone)
    is_covered = bone.cartilage_mm > 0.0
    assert found.mean_mm == pytest.approx(bone.cartilage_mm[is_covered].mean())
    assert found.max_mm == pytest.approx(2.0, abs=1e-3)
    assert found.sd_mm == pytest.approx(MAPPED_SD_MM)
    assert found.share == pytest.approx(is_covered.mean())
