"""Simulated knees that are followed, before an eye that looks at them through the mirror."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from navapp.devices.simulated_plan import make_built_in_plan
from navapp.devices.simulated_room import simulation_of
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.tracking import Goal, TrackState, make_tracker
from navapp.values import Foreground, Plan, Status
from sim_devices.mirror_setups import make_eye_camera
from sim_devices.rigs import camera_from_left
from sim_devices.scenario import Scenario
from sim_devices.sensor import Eye
from sim_devices.world import World
from tests.knees import SimulatedKnee

BoolArray = NDArray[np.bool_]

BONE = "femur"
_EYE_FOCAL_PX = 2400.0
_N_FOLLOWED, _MOST_FRAMES = 5, 30
_GOAL = Goal(np.empty((0, 3)), 2.0)
# A point so far behind what is seen in its pixel is still seen: pixels are that wide on slopes.
_BEHIND_MM = 0.5


@dataclass(frozen=True, eq=False)
class FollowedKnee:
    """One frame of a followed femur: what the tracker tells of it, and the truth beside it."""

    world: World  # the room, for judging
    rig: StereoRig
    plan: Plan
    estimated: RigidTransform  # left camera from femur, as tracked
    foreground: Foreground  # as measured by the tracker
    true: RigidTransform  # for judging, and to place what stands in the room
    time_ns: int  # of the world, when the frame was captured

    @cached_property
    def middle_mm(self) -> FloatArray:
        """(3,) of the femur's surface that the left camera sees, in its frame."""
        seen = self.world.depth("left", self.time_ns)
        is_femur = seen.body == seen.bodies.index(BONE)
        v, u = np.nonzero(is_femur)
        rays = self.rig.left.rays(np.column_stack([u, v]).astype(float))
        return np.asarray((rays * seen.depth_mm[is_femur][:, None]).mean(axis=0))

    def is_seen_by_eye(self, points_mm: FloatArray, eye_from_left: RigidTransform) -> BoolArray:
        """(n,) whether nothing of the room stands between an eye and points (n, 3) of the femur.

        The glass shifts all that is seen by about the same, and hides nothing.
        """
        camera = make_eye_camera(self.rig.left.width, self.rig.left.height, _EYE_FOCAL_PX)
        rig = StereoRig(self.rig.left, camera, eye_from_left.rename("right", "left"))
        # The room is laid out for the rig that takes the pictures; this one only looks.
        world = World(self.world.scenario)
        world.rig = rig
        return self._is_seen(points_mm, "right", world)

    def is_seen_by_cameras(self, points_mm: FloatArray) -> BoolArray:
        """(n,) whether both cameras see points (n, 3) of the femur."""
        return np.logical_and(
            self._is_seen(points_mm, "left", self.world),
            self._is_seen(points_mm, "right", self.world),
        )

    def _is_seen(self, points_mm: FloatArray, which: Eye, world: World) -> BoolArray:
        camera = world.rig.left if which == "left" else world.rig.right
        depth_mm = world.depth(which, self.time_ns).depth_mm
        there = camera_from_left(world.rig, which).apply(self.true.apply(points_mm))
        at = np.rint(camera.project(there))
        size = (camera.width - 1, camera.height - 1)
        is_inside = ((at >= 0) & (at <= size)).all(axis=1)
        u, v = np.clip(at, 0, size).astype(np.intp).T
        return is_inside & (there[:, 2] <= depth_mm[v, u] + _BEHIND_MM)


def follow_knee(seed: int) -> FollowedKnee:
    """Register the femur of a knee from where it is meant to lie, and follow it.

    The knee lies 6 to 9 degrees and 6 to 10 mm off there. Nothing but pictures, rig, bone and
    nominal pose reaches the tracker.
    """
    knee = SimulatedKnee(Scenario(seed=seed, side="left" if seed % 2 else "right"))
    plan = make_built_in_plan(simulation_of(knee.world, knee.camera))
    tracker, state, n_ok = make_tracker(knee.rig, plan.bones[BONE]), None, 0
    for _ in range(_MOST_FRAMES):
        frame = knee.camera.read(1.0)
        if state is None:
            tracked = tracker.register(frame, knee.prior, _GOAL)[0]
            if tracked.verdict.status is Status.OK:
                state = TrackState.at_rest(tracked.left_from_bone, frame.captured_ns)
            continue
        tracked, state = tracker.track(frame, state, _GOAL)
        n_ok = n_ok + 1 if tracked.verdict.status is Status.OK else 0
        if n_ok == _N_FOLLOWED:
            break
    else:
        raise RuntimeError(f"knee {seed} was not followed within {_MOST_FRAMES} frames")
    truth, time_ns = knee.truth(frame), knee.camera.world_time_ns(frame.captured_ns)
    knee.camera.close()
    return FollowedKnee(
        knee.world, knee.rig, plan, tracked.left_from_bone, tracked.foreground, truth,
        time_ns,
    )  # fmt: skip
