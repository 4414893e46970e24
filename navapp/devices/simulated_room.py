"""The simulated room as configured: world, camera, and the truth kept apart from them."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from calibration.targets.boards import Board
from drivers.clock import Clock, ManualClock, SystemClock
from navapp.config import FaultSection, SimulationSection
from navapp.devices.simulated_board import make_hand, print_board
from navapp.devices.simulated_tool import SIMULATED_PLATES, make_touching
from navapp.errors import ConfigurationError
from navapp.geometry import RigidTransform, TriangleMesh
from navapp.geometry.transform import FloatArray
from sim_devices.caliper import Caliper
from sim_devices.camera import NOMINAL_EXPOSURE_MS, Scene, SimulatedCamera
from sim_devices.faults import Fault, FaultKind, FaultScript
from sim_devices.planned_cuts import Cut
from sim_devices.rigs import make_default_rig
from sim_devices.scenario import Scenario
from sim_devices.sensor import SensorModel
from sim_devices.sheet import SheetInView
from sim_devices.state_history import StateHistory
from sim_devices.truth import TruthOracle
from sim_devices.world import World


@dataclass(frozen=True, slots=True, eq=False)
class Simulation:
    """What the simulated room hands to its caller, apart from the devices."""

    bones: Mapping[str, TriangleMesh]  # name -> surface as planned
    side: Literal["left", "right"]  # of the knee
    targets: Mapping[str, FloatArray]  # `bone/name` -> point, mm, bone coordinates
    curves: Mapping[str, FloatArray]  # vessels and nerves beside the femur
    # drill_entry_mm, drill_direction: where the room's drill enters the femur, and whereto.
    drill_entry_mm: FloatArray
    drill_direction: FloatArray
    planned_cuts: Mapping[str, Cut]  # what the room's saw is to make, by name
    worn_vertices: NDArray[np.int64]  # of the femur, where its cartilage is worn
    # how the knee was laid on the table; rough starts.
    nominal_left_from_bone: Mapping[str, RigidTransform]
    # approach_axis, approach_half_angle_deg: of the approach cone.
    approach_axis: FloatArray
    approach_half_angle_deg: float
    oracle: TruthOracle  # the truth, for evaluation after the run only
    planned_parts: Mapping[str, TriangleMesh]  # the components, in the coordinates of their bones
    caliper: Caliper  # reads how thick a sawn bone is
    states: StateHistory  # tells the room what to show as made, by names of planned steps


@dataclass(frozen=True, slots=True)
class Pace:
    """How a simulated camera runs: by itself, or stepped by its reader."""

    clock: Clock
    is_stepped: bool

    @classmethod
    def of(cls, settings: SimulationSection, *, is_headless: bool) -> "Pace":
        """As configured; by default it is stepped where nobody watches."""
        is_stepped = is_headless if settings.stepped is None else settings.stepped
        return cls(ManualClock() if is_stepped else SystemClock(), is_stepped)


def make_simulated_camera(
    scene: Scene, settings: SimulationSection, pace: Pace, rate_hz: float
) -> SimulatedCamera:
    """A camera before a scene, with the configured noise and faults; not opened yet."""
    return SimulatedCamera(
        scene,
        pace.clock,
        is_stepped=pace.is_stepped,
        rate_hz=rate_hz,
        scale=settings.scale,
        sensor=make_sensor(settings),
        faults=FaultScript(tuple(_fault(section) for section in settings.faults)),
        skew_ns=round(settings.skew_ms * 1e6),
        unstamped_skew_ns=round(settings.unstamped_skew_ms * 1e6),
        is_blurred=settings.blur,
    )


def make_sensor(settings: SimulationSection) -> SensorModel:
    """What both eyes have behind their lenses."""
    return SensorModel(
        full_well_e=settings.full_well_e,
        read_noise_e=settings.read_noise_e,
        psf_sigma_px=settings.defocus_px,
        exposure=settings.light,
        seed=settings.seed,
        is_grey=settings.grey,
    )


def make_world(settings: SimulationSection, rate_hz: float) -> World:
    """The room before a rig with the configured shutter.

    Raises:
        ConfigurationError: shutter and exposure take longer than a frame period.
    """
    longest_ms = 1000.0 / rate_hz - NOMINAL_EXPOSURE_MS
    if settings.shutter_ms > max(longest_ms, 0.0):
        raise ConfigurationError(
            f"a shutter of {settings.shutter_ms:g} ms and an exposure of {NOMINAL_EXPOSURE_MS:g} ms"
            f" do not fit between two pictures at {rate_hz:g} Hz",
            subject="camera.simulated.shutter_ms",
            remedy=f"use a shutter_ms of at most {max(longest_ms, 0.0):.3g}, or a lower rate_hz",
        )
    rig = make_default_rig(baseline_mm=settings.baseline_mm)
    row_delay_ns = round(settings.shutter_ms * 1e6 / (rig.height - 1))
    return World(scenario_of(settings), replace(rig, row_delay_ns=row_delay_ns))


def scenario_of(settings: SimulationSection) -> Scenario:
    """Who lies in the room, and what happens there."""
    return Scenario(
        seed=settings.seed,
        side=settings.side,
        sex=settings.sex,
        age_group=settings.age_group,
        cartilage_mm=settings.cartilage_mm,
        motion=settings.motion,
        instrument=settings.instrument,
        contrast=settings.contrast,
        blood=settings.blood,
        highlights=settings.highlights,
        distance_mm=settings.distance_mm,
        misses=settings.misses,
        drift_mm_s=settings.drift_mm_s,
        shake_mm=settings.shake_mm,
        shake_hz=settings.shake_hz,
    )


def make_simulated_bones(settings: SimulationSection) -> dict[str, TriangleMesh]:
    """Name -> surface as planned, of the knee that lies in the room."""
    return dict(World(scenario_of(settings)).anatomy.bones)


def _fault(section: FaultSection) -> Fault:
    kind = FaultKind(section.kind)
    return Fault(kind, section.start_s, section.duration_s, section.delay_s, section.turn_deg)


def with_tool(world: World, settings: SimulationSection) -> Scene:
    """The room, with a tool that touches the femur when there is one to be held."""
    if settings.tool == "none":
        return world
    plate = SIMULATED_PLATES[settings.tool]
    return make_touching(settings.tool, plate, world, settings.seed)[0]


def with_board(room: Scene, board: Board | None, settings: SimulationSection) -> Scene:
    """The room, with a board held into the view when there is one to be shown."""
    if board is None or settings.board_s is None:
        return room
    hand = make_hand(board, settings.seed)
    from_s, to_s = settings.board_s
    shown_ns = (round(from_s * 1e9), round(to_s * 1e9))
    return SheetInView(room, print_board(board), hand.left_from_body, shown_ns)


def simulation_of(world: World, camera: SimulatedCamera) -> Simulation:
    """What a room tells apart from its devices."""
    anatomy = world.anatomy
    entry_mm, direction = world.drill_line
    joint_z_mm = float(anatomy.bones["femur"].vertices_mm[:, 2].min())
    return Simulation(
        bones=dict(anatomy.bones),
        side=world.scenario.side,
        targets={name: np.array(point) for name, point in anatomy.landmarks.items()},
        # Beyond the joint a vessel follows the tibia: with the knee flexed it is elsewhere.
        curves={
            name: np.asarray(points)[np.asarray(points)[:, 2] > joint_z_mm]
            for name, points in anatomy.curves.items()
        },
        drill_entry_mm=entry_mm,
        drill_direction=direction,
        planned_cuts=world.planned_cuts,
        planned_parts=world.planned_parts,
        worn_vertices=world.worn_vertices,
        nominal_left_from_bone={
            "femur": world.nominal_left_from_femur,
            "tibia": world.nominal_left_from_tibia,
            "patella": world.nominal_left_from_patella,
        },
        approach_axis=np.asarray(world.approach_axis),
        approach_half_angle_deg=world.approach_half_angle_deg,
        oracle=TruthOracle(world, camera.world_time_ns),
        caliper=Caliper(world),
        states=world.states,
    )


def find_cartilage_mm(settings: SimulationSection, bone: str) -> FloatArray:
    """(V,) true thickness over a bone's vertices: for evaluation only."""
    if settings.cartilage_mm == 0.0:
        return np.zeros(1)
    return World(scenario_of(settings)).cartilage_mm(bone)
