"""From a measured surface and a model to a pose with its covariance."""

from navapp.registration.icp import fit_icp
from navapp.registration.initial import distinct, find_candidates, tilted_starts
from navapp.registration.model import RegistrationModel
from navapp.registration.point_to_plane import (
    PointToPlaneSettings,
    estimate_at,
    fit_point_to_plane,
)

__all__ = [
    "PointToPlaneSettings",
    "RegistrationModel",
    "distinct",
    "estimate_at",
    "find_candidates",
    "fit_icp",
    "fit_point_to_plane",
    "tilted_starts",
]
