"""Bones of the simulated anatomy, as a plan holds them."""

from navapp.geometry.mesh import TriangleMesh
from navapp.values import BoneModel
from sim_devices.anatomy import KneeSpec, make_knee


def femur_model(spec: KneeSpec | None = None) -> BoneModel:
    """The femur of that knee; normals computed anew, as a reader of the plan's files does."""
    spec = spec or KneeSpec()
    mesh = make_knee(spec).bones["femur"]
    return BoneModel("femur", TriangleMesh(mesh.vertices_mm, mesh.faces), spec.side)
