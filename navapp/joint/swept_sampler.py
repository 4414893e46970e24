"""Poses of a tibia beside a known femur: drawn over the knee's range, scored on measured depth."""

import numpy as np
from scipy.spatial.transform import Rotation

from navapp.geometry.transform import RigidTransform
from navapp.limb import Hinge, Poses
from navapp.registration import DepthMap, PoseSampler, RegistrationModel, distinct
from navapp.registration.pose_sampler import Draw

# Always the same draws: the same pictures give the same pose.
_SEED = 20
# All chosen. Width of the kernel (mm), and what is drawn: first anywhere in the knee's range, then
# around the best of the round before. Tissue suits a wide kernel better than the bone does, so all
# are narrower than those around a rough pose, and more poses are kept.
_FIRST = (2.0, Draw(300, 40_000, 800, 0.0, 0.0))
_ROUNDS = (
    (1.2, Draw(500, 12_000, 500, 3.0, 3.0)),
    (0.8, Draw(800, 12_000, 400, 1.5, 2.0)),
)
# Then so many distinct poses climb, each on its own, kernel by kernel.
_N_CLIMBING, _CLIMB = 60, Draw(800, 150, 20, 1.2, 1.5)
_CLIMB_MM = (0.8, 0.5, 0.5, 0.3, 0.3)


class SweptSampler(PoseSampler):
    """Draws poses of a tibia over the range of a hinge."""

    def __init__(self, model: RegistrationModel, hinge: Hinge) -> None:
        super().__init__(model)
        self._hinge, self._name = hinge, model.bone.name

    def sweep(
        self, depth: DepthMap, camera_from_femur: RigidTransform, n: int
    ) -> list[RigidTransform]:
        """At most n distinct poses of the tibia (camera from bone), best first.

        Args:
            depth: of whatever is in view, but for the femur.
            camera_from_femur: pose of the femur.
            n: so many.
        """
        random = np.random.default_rng(_SEED)
        sigma_mm, draw = _FIRST
        poses = self._hinge.draw(draw.n_poses, random)
        poses = self._select(depth, camera_from_femur, poses, sigma_mm, draw)
        for sigma_mm, draw in _ROUNDS:
            poses = self._draw_around(poses, draw, random)
            poses = self._select(depth, camera_from_femur, poses, sigma_mm, draw)
        placed = [
            camera_from_femur @ RigidTransform.from_parts("femur", self._name, *one)
            for one in zip(*poses, strict=True)
        ]
        starts = distinct(placed, self._centre_mm, _N_CLIMBING)
        climbed = [self._climb(depth, start, _CLIMB, _CLIMB_MM) for start in starts]
        climbed.sort(key=lambda one: one.score, reverse=True)
        ends = [one.scene_from_bone for one in climbed]
        return distinct(self._keep_possible(ends, camera_from_femur), self._centre_mm, n)

    def _select(
        self,
        depth: DepthMap,
        camera_from_femur: RigidTransform,
        poses: Poses,
        sigma_mm: float,
        draw: Draw,
    ) -> Poses:
        """The best of poses in femur coordinates, by the draw's number of points."""
        turn = camera_from_femur.rotation
        rotations = np.ascontiguousarray(turn @ poses.rotations)
        shifts_mm = poses.shifts_mm @ turn.T + camera_from_femur.translation_mm
        best, _ = self._find_best(depth, (rotations, shifts_mm), draw, sigma_mm)
        return poses.select(best)

    def _draw_around(self, poses: Poses, draw: Draw, random: np.random.Generator) -> Poses:
        """Poses in femur coordinates and others around them, as far as the hinge allows them."""
        parents = random.integers(0, len(poses.rotations), draw.n_poses)
        twists = random.standard_normal((draw.n_poses, 6)) * draw.deviations
        parents[: len(poses.rotations)] = np.arange(len(poses.rotations))
        twists[: len(poses.rotations)] = 0.0
        before, shifts_mm = poses.select(parents)
        rotations = np.asarray(Rotation.from_rotvec(twists[:, 3:]).as_matrix()) @ before
        shifts_mm = shifts_mm + twists[:, :3] + (before - rotations) @ self._centre_mm
        drawn = Poses(rotations, shifts_mm)
        return drawn.select(self._hinge.allows(drawn))

    def _keep_possible(
        self, ends: list[RigidTransform], camera_from_femur: RigidTransform
    ) -> list[RigidTransform]:
        """Poses (camera from bone) that the hinge allows."""
        femur_from_camera = camera_from_femur.inverse()
        relative = [femur_from_camera @ end for end in ends]
        poses = Poses(
            np.array([one.rotation for one in relative]).reshape(-1, 3, 3),
            np.array([one.translation_mm for one in relative]).reshape(-1, 3),
        )
        return [end for end, is_one in zip(ends, self._hinge.allows(poses), strict=True) if is_one]
