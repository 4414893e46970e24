"""Plan and prior of the simulated patient, used when none is given."""

from navapp.devices.simulated_content import make_built_in_content
from navapp.devices.simulated_room import Simulation
from navapp.geometry.directions import ViewCone
from navapp.geometry.mesh import TriangleMesh
from navapp.values import BoneModel, Plan, Prior


def make_built_in_plan(simulation: Simulation) -> Plan:
    """The plan of the simulated patient: the surfaces that a perfect CT would have given."""
    # Normals as any reader of the plan's files computes them, so that a replay finds the same.
    bones = {
        name: BoneModel(name, TriangleMesh(mesh.vertices_mm, mesh.faces), simulation.side)
        for name, mesh in simulation.bones.items()
    }
    return Plan(
        bones,
        simulation.targets,
        simulation.curves,
        name="sim:plan",
        content=make_built_in_content(simulation),
    )


def make_nominal_prior(simulation: Simulation) -> Prior:
    """How the simulated knee was meant to lie on the table."""
    return Prior(
        simulation.nominal_left_from_bone,
        {"femur": ViewCone(simulation.approach_axis, simulation.approach_half_angle_deg)},
    )
