"""A simulated room with an everted, sawn patella, and its patella as a caliper tells it."""

from contextlib import ExitStack
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from drivers.frames import StereoFrame
from navapp.config import Configuration
from navapp.config.camera_sections import CameraSection, SimulationSection
from navapp.control.stages import stage_by_name
from navapp.devices import open_live
from navapp.devices.simulated_plan import make_built_in_plan
from navapp.evaluation import compute_mean_tre_mm
from navapp.face_tracking import FaceTracker
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import RigidTransform
from navapp.resection import CutBone
from navapp.tracking import Goal
from navapp.values import MeasuredFace, ResectionPlane
from sim_devices.truth import TruthOracle

# A reading's: half a degree and a tenth of a millimetre.
SMALL = np.diag([0.01, 0.01, 0.1]) ** 2


@dataclass(frozen=True)
class SawnRoom:
    """Frames in which the patella is sawn, and the truth for judging."""

    rig: StereoRig
    bone: CutBone
    made: MeasuredFace
    frames: tuple[StereoFrame, ...]
    oracle: TruthOracle
    goal: Goal

    def truth(self, frame: StereoFrame) -> RigidTransform:
        return self.oracle.left_from_seen_body("patella", frame.captured_ns)

    def tracker(self, face: MeasuredFace | None = None) -> FaceTracker:
        """Of the bone with a face; without one with the one that was made."""
        known = self.bone.with_caliper_face("patella", face or self.made)
        return FaceTracker(self.rig, known)

    def error_mm(self, pose: RigidTransform, frame: StereoFrame) -> float:
        """Mean over the targets."""
        true, targets_mm = self.truth(frame), self.goal.targets_mm
        return compute_mean_tre_mm(pose, true, self.bone.planned, targets_mm)


@lru_cache(maxsize=4)
def sawn_room(n_frames: int = 3, **settings: float) -> SawnRoom:
    """A room with other settings than the usual ones, and its first frames."""
    usual = SimulationSection(seed=5, stepped=True).model_dump()
    configuration = Configuration(camera=CameraSection(simulated={**usual, **settings}))
    with ExitStack() as undo:
        opened = open_live(configuration, is_headless=True)
        undo.callback(opened.devices.close)
        simulation = opened.simulation
        assert simulation is not None
        plan = make_built_in_plan(simulation)
        simulation.states.set_stage("patella")
        simulation.states.make("patella")
        frames = tuple(opened.devices.camera.read(1.0) for _ in range(n_frames))
        point_mm, normal = simulation.oracle.made_planes()["patella"]
    planned = plan.content.steps["patella"]
    assert isinstance(planned, ResectionPlane)
    tilts = planned.axes @ normal / (planned.normal @ normal)
    made = MeasuredFace(
        planned, np.array([*tilts, (point_mm - planned.point_mm) @ normal]), SMALL, 1.0
    )
    bone = CutBone(plan.bones["patella"]).make("patella", planned)
    stage = plan.stage(stage_by_name("patella"))
    goal = Goal(plan.targets_of(stage.targets), stage.tolerance_mm)
    return SawnRoom(opened.rig, bone, made, frames, simulation.oracle, goal)
