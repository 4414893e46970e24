"""From a measured surface and a model to a pose with its covariance."""

from navapp.registration.bimcc import BimccSettings, estimate_at, fit_bimcc
from navapp.registration.model import RegistrationModel
from navapp.registration.multi_start import (
    Candidate,
    distinct,
    explained_share,
    find_candidates,
    is_same_pose,
    tilted_starts,
)
from navapp.registration.point_to_point import fit_bimcc_literal, fit_icp
from navapp.registration.register import Outcome, Registration, register
from navapp.registration.scene import Scene

__all__ = [
    "BimccSettings",
    "Candidate",
    "Outcome",
    "Registration",
    "RegistrationModel",
    "Scene",
    "distinct",
    "estimate_at",
    "explained_share",
    "find_candidates",
    "fit_bimcc",
    "fit_bimcc_literal",
    "fit_icp",
    "is_same_pose",
    "register",
    "tilted_starts",
]
