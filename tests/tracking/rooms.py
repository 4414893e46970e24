"""Measured maps and simulated pictures whose truth is known."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from drivers.frames import StereoFrame
from navapp.evaluation import compute_mean_tre_mm
from navapp.geometry.box import Box
from navapp.geometry.rectification import RectifiedPair
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import RigidTransform
from navapp.geometry.zbuffer import render_rectified
from navapp.tracking import Goal
from navapp.tracking.bimcc_tracker import BimccTracker
from navapp.values import BoneModel, DisparityMap, Origin, Prior
from sim_devices.scenario import Scenario
from sim_devices.sensor import SensorModel
from sim_devices.truth import TruthOracle
from sim_devices.world import World
from tests.knees import SimulatedKnee
from tests.registration.shapes import GEOMETRY, TRUE
from tests.views import project_box

GOAL = Goal(np.empty((0, 3)), 2.0)


def measured_map(bone: BoneModel, pose: RigidTransform = TRUE, margin_px: int = 16) -> DisparityMap:
    """What a good matcher finds of a bone alone: exact up to noise of 0.25 px."""
    box = project_box(bone.mesh, pose, GEOMETRY).grow(margin_px).clip(1280, 720)
    view = render_rectified(bone.mesh, pose, GEOMETRY, box)
    noise = np.random.default_rng(1).normal(0.0, 0.25, view.mask.shape)
    disparity = GEOMETRY.focal_px * GEOMETRY.baseline_mm / view.depth_mm + noise
    return DisparityMap(
        np.where(view.mask, disparity, np.nan).astype(np.float32),
        np.where(view.mask, 0.25, np.nan).astype(np.float32),
        np.where(view.mask, Origin.MATCHED, Origin.UNKNOWN).astype(np.uint8),
        box.x,
        box.y,
    )


def blank_pair() -> RectifiedPair:
    """Grey pictures that show nothing."""
    grey = np.full((GEOMETRY.height, GEOMETRY.width), 90, np.uint8)
    return RectifiedPair(grey, grey, GEOMETRY, Box(0, 0, GEOMETRY.width, GEOMETRY.height))


@dataclass(frozen=True)
class Room:
    """Frames of a simulated knee, the tracker that follows it, and the truth for judging."""

    rig: StereoRig
    tracker: BimccTracker
    frames: tuple[StereoFrame, ...]
    oracle: TruthOracle
    prior: Prior

    def truth(self, frame: StereoFrame) -> RigidTransform:
        return self.oracle.left_from_body("femur", frame.captured_ns)

    def error_mm(self, pose: RigidTransform, frame: StereoFrame) -> float:
        """Mean over the visible vertices."""
        none_mm = np.empty((0, 3))
        return compute_mean_tre_mm(pose, self.truth(frame), self.tracker.model.bone, none_mm)


@lru_cache(maxsize=4)
def room(motion: str = "still", n_frames: int = 3, is_grey: bool = False) -> Room:
    knee = SimulatedKnee(Scenario(seed=5, motion=motion), SensorModel(seed=5, is_grey=is_grey))
    tracker, frames = BimccTracker(knee.rig, knee.bone), tuple(knee.frames(n_frames))
    return Room(knee.rig, tracker, frames, knee.oracle, knee.prior)


@lru_cache(maxsize=1)
def cone() -> tuple[np.ndarray, float]:
    """Axis and half angle of the approach to the room's knee."""
    world = World(Scenario(seed=5, motion="still"))
    return world.approach_axis, world.approach_half_angle_deg
