"""From a measured surface and a model to a pose with its covariance."""

from navapp.registration.bimcc import fit_bimcc, fit_pose, solution_at
from navapp.registration.bimcc_kernels import BimccSettings
from navapp.registration.initial import find_initial
from navapp.registration.model import RegistrationModel
from navapp.registration.multi_start import (
    ScoredPose,
    distinct,
    find_poses,
    is_same_pose,
    make_far_starts,
    make_near_starts,
    make_scattered_starts,
    rank_fits,
    select_poses,
)
from navapp.registration.point_to_point import solve_bimcc_literal, solve_icp
from navapp.registration.pose_sampler import PoseSampler
from navapp.registration.register import Outcome, Registration, register
from navapp.registration.scene import Scene
from navapp.registration.score_kernels import DepthMap

__all__ = [
    "BimccSettings",
    "DepthMap",
    "Outcome",
    "PoseSampler",
    "Registration",
    "RegistrationModel",
    "Scene",
    "ScoredPose",
    "distinct",
    "find_initial",
    "find_poses",
    "fit_bimcc",
    "fit_pose",
    "is_same_pose",
    "make_far_starts",
    "make_near_starts",
    "make_scattered_starts",
    "rank_fits",
    "register",
    "select_poses",
    "solution_at",
    "solve_bimcc_literal",
    "solve_icp",
]
