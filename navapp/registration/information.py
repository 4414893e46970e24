"""What the pairs fix and what they leave free: covariance and degeneracy."""

import math
from dataclasses import dataclass

import numpy as np

from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.registration.pairing_kernels import Pairs
from navapp.registration.step_kernels import FREE_SHARE, plane_system, size_terms, weighted_centre

_SINGULAR_SHARE = 1e-9
# A free direction turns when this much of it, in levers, is rotation; else it is a translation.
_TURN_SHARE = 0.1


@dataclass(frozen=True, slots=True, eq=False)
class Information:
    """How well a scene fixes a pose.

    Attributes:
        covariance: (6, 6) of the public twist (translation mm, rotation rad; from the left, about
            the model's centre); infinite when a direction is not fixed at all.
        free: (K, 6) directions that are not fixed, as twists about the seen surface's centre in
            levers: unit vectors, translation first, in the scene's frame.
        size_mm: by how much the pairs show the seen surface to be larger than the model's, at its
            rms distance from its centre.
        size_sigma_mm: standard deviation of that; infinite when nothing fixes it.
    """

    covariance: FloatArray
    free: FloatArray
    size_mm: float = 0.0
    size_sigma_mm: float = math.inf

    @property
    def is_degenerate(self) -> bool:
        """Whether some direction is free."""
        return len(self.free) > 0

    def free_in_words(self) -> list[str]:
        """The free directions for people: rotations first, as many as there are, then shifts."""
        if not self.is_degenerate:
            return []
        # Mixed so that the rotations stand in as few directions as can be.
        mixing, turns, _ = np.linalg.svd(self.free[:, 3:])
        mixed = mixing.T @ self.free
        is_turn = np.append(turns, np.zeros(len(mixed)))[: len(mixed)] > _TURN_SHARE
        return [
            f"rotation about {_axis(twist[3:])}"
            if turning
            else f"translation along {_axis(twist[:3])}"
            for twist, turning in zip(mixed, is_turn, strict=True)
        ]


def information_of(
    pairs: Pairs, n: int, pose: RigidTransform, centre_mm: FloatArray, n_sharing_errors: float
) -> Information:
    """Information of weighted pairs about a pose.

    Args:
        pairs: weighted by kernel over variance, in bone coordinates; first n hold.
        n: how many.
        pose: `scene_from_bone`.
        centre_mm: (3,) of the model, bone coordinates.
        n_sharing_errors: so many neighbouring pairs have their errors in common.

    Source: Gauss-Newton normal equations at the solution; their inverse is the covariance.
    """
    H, g, seen_mm = np.empty((6, 6)), np.empty(6), np.empty(3)
    lever_mm = float(weighted_centre(pairs, n, seen_mm))
    plane_system(pairs, n, seen_mm, lever_mm, H, g)
    eigenvalues, vectors = np.linalg.eigh(H)
    is_free = eigenvalues < FREE_SHARE * eigenvalues[-1]
    # (rotation x lever, translation) of the points become (translation, rotation) of the pose.
    turned = np.zeros((6, 6))
    turned[:3, 3:] = turned[3:, :3] = pose.rotation
    free = (turned @ vectors[:, is_free]).T
    if eigenvalues[0] <= _SINGULAR_SHARE * eigenvalues[-1]:
        return Information(np.diag([np.inf] * 6), free)
    size_mm, size_variance = _size(pairs, n, seen_mm, lever_mm, H, g)
    plane_system(pairs, n, np.ascontiguousarray(centre_mm), lever_mm, H, g)
    levers = np.diag([1.0, 1.0, 1.0, 1.0 / lever_mm, 1.0 / lever_mm, 1.0 / lever_mm])
    change = levers @ turned
    covariance = n_sharing_errors * change @ np.linalg.inv(H) @ change.T
    size_sigma_mm = math.sqrt(n_sharing_errors * size_variance)
    return Information(0.5 * (covariance + covariance.T), free, size_mm, size_sigma_mm)


def _size(
    pairs: Pairs, n: int, seen_mm: FloatArray, lever_mm: float, H: FloatArray, g: FloatArray
) -> tuple[float, float]:
    """Size as a seventh unknown beside the six of the motion, and its variance.

    Source: elimination of the motion from the normal equations (Schur complement).
    """
    mixed = np.empty(6)
    terms = size_terms(pairs, n, seen_mm, lever_mm, mixed)
    by_motion = np.linalg.solve(H, np.column_stack([mixed, g]))
    information = terms.squares - float(mixed @ by_motion[:, 0])
    if information <= _SINGULAR_SHARE * terms.squares:
        return 0.0, math.inf
    return (terms.product_mm - float(mixed @ by_motion[:, 1])) / information, 1.0 / information


def _axis(vector: FloatArray) -> str:
    """Direction of a vector, its largest component positive."""
    axis = vector / np.linalg.norm(vector)
    axis = axis * np.sign(axis[np.abs(axis).argmax()])
    x, y, z = (round(float(value), 2) + 0.0 for value in axis)
    return f"({x:g}, {y:g}, {z:g})"
