"""How far a followed bone moves up or down in the picture while one camera waits for the other."""

import math

import numpy as np

from drivers.frames import StereoFrame
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.values import Plan, TrackedFrame

# Enough to know how the ends of a bone move.
_N_POINTS = 64
# Between frames that are farther apart a bone may have moved to and fro.
_LONGEST_NS = 1_000_000_000
# Pictures without stamps of their own are paired with the nearest of the other camera.
_UNKNOWN_SHARE = 0.5


class BoneMotion:
    """Compares the poses of one frame and the next.

    Args:
        rig: whose left picture is meant.
        plan: with the bones' models.
    """

    def __init__(self, rig: StereoRig, plan: Plan) -> None:
        self._rig = rig
        self._points_mm = {
            name: _sample(bone.mesh.vertices_mm) for name, bone in plan.bones.items()
        }
        self._last: tuple[int, RigidTransform] | None = None

    def row_px(self, frame: StereoFrame, tracked: TrackedFrame | None) -> float:
        """By how much the rows of a pair may disagree because its bone moves; inf when unknown.

        Of the bone's points in the picture the one that moves most counts. A skew of zero is what
        cameras tell that have no stamps: it is taken for unknown, half a frame's time at most.

        Args:
            frame: the next one.
            tracked: what was found in it.
        """
        last, pose = self._last, None if tracked is None else tracked.left_from_bone
        self._last = None if pose is None else (frame.captured_ns, pose)
        if last is None or pose is None or last[1].source != pose.source:
            return math.inf
        passed_ns = frame.captured_ns - last[0]
        if not 0 < passed_ns <= _LONGEST_NS:
            return math.inf
        share = abs(frame.skew_ns) / passed_ns if frame.skew_ns else _UNKNOWN_SHARE
        return share * self._motion_px(last[1], pose)

    def _motion_px(self, before: RigidTransform, after: RigidTransform) -> float:
        camera, points_mm = self._rig.left, self._points_mm[after.source]
        old_px, new_px = (camera.project(pose.apply(points_mm)) for pose in (before, after))
        size_px = (camera.width, camera.height)
        is_seen = ((new_px >= 0.0) & (new_px < size_px)).all(axis=1) & np.isfinite(old_px[:, 1])
        moved_px = np.abs(new_px - old_px)[is_seen, 1]
        return float(moved_px.max()) if len(moved_px) else math.inf


def _sample(points_mm: FloatArray) -> FloatArray:
    """Spread over all of them."""
    return points_mm[:: max(1, len(points_mm) // _N_POINTS)]
