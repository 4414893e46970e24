"""A simulated knee before its camera: the pictures, what a plan says of it, and the truth."""

from drivers.clock import ManualClock
from drivers.frames import StereoFrame
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import RigidTransform
from navapp.values import BoneModel, Prior
from sim_devices.camera import Scene, SimulatedCamera
from sim_devices.scenario import Scenario
from sim_devices.sensor import SensorModel
from sim_devices.truth import TruthOracle
from sim_devices.world import World


def femur_of(world: World) -> BoneModel:
    """The right plan; normals computed anew, as a reader of its files does."""
    mesh = world.anatomy.bones["femur"]
    return BoneModel("femur", TriangleMesh(mesh.vertices_mm, mesh.faces), world.scenario.side)


def nominal_prior(world: World) -> Prior:
    """Where the femur is meant to lie."""
    return Prior({"femur": world.nominal_left_from_femur})


def stepped_camera(scene: Scene, sensor: SensorModel, rate_hz: float = 15.0) -> SimulatedCamera:
    """An opened camera that takes every instant."""
    camera = SimulatedCamera(scene, ManualClock(), is_stepped=True, rate_hz=rate_hz, sensor=sensor)
    camera.open()
    return camera


class SimulatedKnee:
    """A world with an opened camera before it.

    Attributes:
        world: what is seen.
        bone: the right plan of its femur.
        prior: the femur's nominal pose.
        camera: stepped; its noise has the seed of the world unless a sensor is given.
        oracle: the truth, for judging.
    """

    def __init__(self, world: World | Scenario, sensor: SensorModel | None = None) -> None:
        self.world = World(world) if isinstance(world, Scenario) else world
        self.bone = femur_of(self.world)
        self.prior = nominal_prior(self.world)
        self.camera = stepped_camera(
            self.world, sensor or SensorModel(seed=self.world.scenario.seed)
        )
        self.oracle = TruthOracle(self.world, self.camera.world_time_ns)

    @property
    def rig(self) -> StereoRig:
        """Of the world."""
        return self.world.rig

    def frames(self, n_frames: int) -> list[StereoFrame]:
        """The next ones."""
        return [self.camera.read(1.0) for _ in range(n_frames)]

    def truth(self, frame: StereoFrame) -> RigidTransform:
        """Left camera from femur when the frame was captured."""
        return self.oracle.left_from_body("femur", frame.captured_ns)
