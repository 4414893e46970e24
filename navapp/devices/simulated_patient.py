"""The patient of the simulated room before the operation: a CT, and what is planned on it."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from navapp.config import SimulationSection
from navapp.devices.simulated_room import scenario_of
from navapp.geometry.transform import FloatArray
from sim_devices.ct_volume import CtVolume, make_ct
from sim_devices.planned_cuts import Cut
from sim_devices.world import World


@dataclass(frozen=True, slots=True, eq=False)
class SimulatedPatient:
    """What there is of the patient on the day before; places in mm, LPS, as in the CT."""

    ct: CtVolume
    side: Literal["left", "right"]  # of the knee
    # drill_entry_mm, drill_direction: where the room's drill is to enter the femur, and whereto.
    drill_entry_mm: FloatArray
    drill_direction: FloatArray
    cuts: Mapping[str, Cut]  # that the room's saw is to make, by name


def make_simulated_patient(
    settings: SimulationSection, spacing_mm: tuple[float, float, float]
) -> SimulatedPatient:
    """The patient that the simulated cameras show, with a CT of these voxels."""
    world = World(scenario_of(settings))
    entry_mm, direction = world.drill_line
    return SimulatedPatient(
        make_ct(world.anatomy, spacing_mm),
        world.scenario.side,
        entry_mm,
        direction,
        dict(world.planned_cuts),
    )
