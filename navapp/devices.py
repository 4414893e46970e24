"""Composition root: the only place that turns a configuration into opened devices."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from drivers.clock import Clock, ManualClock, SystemClock
from drivers.fixed_mirror import FixedMirror
from drivers.interfaces import DeviceSet, StereoCamera
from drivers.no_projector import NoProjector
from drivers.replay_camera import ReplayCamera
from navapp.config import Configuration
from navapp.errors import ConfigurationError, DeviceError, RigError, WrongDevice
from navapp.geometry import RigidTransform, StereoRig, TriangleMesh, read_rig
from navapp.geometry.transform import FloatArray
from sim_devices.camera import SimulatedCamera
from sim_devices.display import SimulatedDisplay
from sim_devices.faults import fault_script
from sim_devices.scenario import Scenario
from sim_devices.sensor import SensorModel
from sim_devices.truth import TruthOracle
from sim_devices.world import World

_ENTRY_POINTS = "navapp.devices"


@dataclass(frozen=True, slots=True, eq=False)
class Simulation:
    """What the simulated room hands to its caller, apart from the devices.

    Attributes:
        bones: name -> surface as planned.
        side: of the knee.
        targets: `bone/name` -> point, mm, bone coordinates.
        curves: vessels and nerves beside the femur.
        nominal_left_from_femur: how the knee was laid on the table; a rough start.
        approach_axis, approach_half_angle_deg: of the approach cone.
        oracle: the truth, for evaluation after the run only.
        set_stage: tells the room which stage is in force.
    """

    bones: Mapping[str, TriangleMesh]
    side: Literal["left", "right"]
    targets: Mapping[str, FloatArray]
    curves: Mapping[str, FloatArray]
    nominal_left_from_femur: RigidTransform
    approach_axis: FloatArray
    approach_half_angle_deg: float
    oracle: TruthOracle
    set_stage: Callable[[str], None]


@dataclass(frozen=True, slots=True)
class Recording:
    """A recorded source to be replayed."""

    source: str
    order: Literal["forward", "pingpong"] = "forward"
    n_frames: int | None = None
    start: int = 0
    rate_hz: float = 15.0
    is_side_by_side: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class OpenedDevices:
    """Opened devices with the rig that took the pictures."""

    devices: DeviceSet
    rig: StereoRig
    reopen_camera: Callable[[], StereoCamera]
    simulation: Simulation | None = None


def open_live(configuration: Configuration, *, is_headless: bool) -> OpenedDevices:
    """Open the configured devices.

    Args:
        configuration: in force.
        is_headless: nobody watches; a simulated camera then waits to be read.

    Raises:
        DeviceError, RigError, ConfigurationError.
    """
    if configuration.camera.backend == "simulated":
        return _open_simulated(configuration, is_headless=is_headless)
    return _open_third_party(configuration)


def open_recording(
    recording: Recording, rig: StereoRig, configuration: Configuration
) -> OpenedDevices:
    """Open a recorded source as the camera of a stepped session.

    Raises:
        SequenceError: the source; RigError: pictures of another size than the rig's.
    """
    clock = ManualClock()
    camera = ReplayCamera(
        recording.source,
        clock,
        order=recording.order,
        n_frames=recording.n_frames,
        start=recording.start,
        rate_hz=recording.rate_hz,
        rig_id=rig.rig_id,
        split_side_by_side=recording.is_side_by_side,
    )
    camera.open()
    try:
        _check_size(camera, rig)
    except RigError:
        camera.close()
        raise
    return OpenedDevices(_device_set(configuration, camera, clock, rig), rig, _no_reopening)


def configured_rig(configuration: Configuration) -> StereoRig:
    """The rig file that the configuration names.

    Raises:
        ConfigurationError: it names none.
    """
    if configuration.camera.rig is None:
        raise ConfigurationError(
            "no rig is configured", subject="camera.rig", remedy="give --rig or [camera] rig"
        )
    return read_rig(configuration.camera.rig)


def _open_simulated(configuration: Configuration, *, is_headless: bool) -> OpenedDevices:
    settings = configuration.camera.simulated
    world = World(
        Scenario(
            seed=settings.seed,
            side=settings.side,
            sex=settings.sex,
            age_group=settings.age_group,
            cartilage_mm=settings.cartilage_mm,
            motion=settings.motion,
            instrument=settings.instrument,
        )
    )
    is_stepped = is_headless if settings.stepped is None else settings.stepped
    clock: Clock = ManualClock() if is_stepped else SystemClock()
    camera = SimulatedCamera(
        world,
        clock,
        is_stepped=is_stepped,
        rate_hz=configuration.camera.rate_hz,
        scale=settings.scale,
        sensor=SensorModel(seed=settings.seed, is_grey=settings.grey),
        faults=fault_script(settings.faults),
        skew_ns=round(settings.skew_ms * 1e6),
    )
    camera.open()
    rig = replace(
        world.rig if settings.scale == 1.0 else world.rig.scaled(settings.scale), name="sim:rig"
    )
    if configuration.camera.rig is not None:
        rig = configured_rig(configuration)
        _check_size(camera, rig)
    serials = camera.info.serials

    def reopen() -> StereoCamera:
        camera.open()
        if camera.info.serials != serials:
            found = camera.info.serials
            camera.close()
            raise WrongDevice(
                f"camera {camera.info.name} has serial numbers {found}, the rig {serials}",
                remedy="connect the cameras that the rig was calibrated with",
            )
        return camera

    devices = _device_set(configuration, camera, clock, rig)
    return OpenedDevices(devices, rig, reopen, _simulation(world, camera))


def _simulation(world: World, camera: SimulatedCamera) -> Simulation:
    anatomy = world.anatomy
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
        nominal_left_from_femur=world.nominal_left_from_femur,
        approach_axis=np.asarray(world.approach_axis),
        approach_half_angle_deg=world.approach_half_angle_deg,
        oracle=TruthOracle(world, camera.world_time_ns),
        set_stage=world.set_stage,
    )


def _open_third_party(configuration: Configuration) -> OpenedDevices:
    """A camera of the entry-point group `navapp.devices`, entry `camera.NAME`."""
    from importlib.metadata import entry_points

    name = configuration.camera.backend
    found = [entry for entry in entry_points(group=_ENTRY_POINTS) if entry.name == f"camera.{name}"]
    if not found:
        raise ConfigurationError(
            f"there is no camera backend '{name}'",
            subject="camera.backend",
            remedy="use simulated, or install the package that provides it",
        )
    rig = configured_rig(configuration)
    clock = SystemClock()
    settings = (configuration.camera.model_extra or {}).get(name, {})
    try:
        camera: StereoCamera = found[0].load()(settings, clock)
    except (ImportError, AttributeError, TypeError) as error:
        raise DeviceError(f"camera backend '{name}' cannot be loaded: {error}") from error
    camera.open()
    _check_size(camera, rig)

    def reopen() -> StereoCamera:
        camera.open()
        return camera

    return OpenedDevices(_device_set(configuration, camera, clock, rig), rig, reopen)


def _device_set(
    configuration: Configuration, camera: StereoCamera, clock: Clock, rig: StereoRig
) -> DeviceSet:
    display = SimulatedDisplay(clock, rig.width, rig.height)
    mirror = FixedMirror(configuration.mirror.calibrated_deg)
    projector = NoProjector()
    for device in (display, mirror, projector):
        device.open()
    return DeviceSet(camera, display, projector, mirror, clock)


def _check_size(camera: StereoCamera, rig: StereoRig) -> None:
    info = camera.info
    if (info.width, info.height) != (rig.width, rig.height):
        raise RigError(
            f"the pictures of {info.name} are {info.width}x{info.height}, "
            f"the rig was calibrated at {rig.width}x{rig.height}",
            subject=info.name,
            remedy="use the rig file that belongs to these pictures",
        )


def _no_reopening() -> StereoCamera:
    raise DeviceError("a recording cannot be reopened")
