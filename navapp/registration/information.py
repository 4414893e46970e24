"""What residuals fix and what they leave free: covariance, degeneracy, the size of the bone."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.transform import FloatArray, RigidTransform, skew
from navapp.registration.cartilage_fit import solve_out_thickness
from navapp.registration.pairing_kernels import Pairs
from navapp.registration.step_kernels import (
    FREE_FRACTION,
    find_motion_rows,
    find_weighted_centre,
    sum_plane_system,
    sum_size_terms,
)
from navapp.values import SizedPose

# Chosen, as all that names no source.
_SINGULAR_FRACTION = 1e-9
# A free direction turns when this much of it, in levers, is rotation; else it is a translation.
_TURN_FRACTION = 0.1
# Standard deviation of a model's size before anything is seen of it.
_SIZE_SD = 0.05


@dataclass(frozen=True, slots=True, eq=False)
class Information:
    """How well a scene fixes a pose."""

    # (6, 6) of the public twist (translation mm, rotation rad; from the left, about the model's
    # centre); infinite when a direction is not fixed at all.
    covariance: FloatArray
    # (K, 6) directions that are not fixed, as twists about the seen surface's centre in levers:
    # unit vectors, translation first, in the scene's frame.
    free: FloatArray
    sized: SizedPose | None = None  # where it was asked for, of pairs that fix a pose

    @property
    def is_degenerate(self) -> bool:
        """Whether some direction is free."""
        return len(self.free) > 0

    def free_in_words(self) -> list[str]:
        """The free directions for people: rotations first, as many as there are, then shifts."""
        # Mixed so that the rotations stand in as few directions as can be.
        mixing, turns, _ = np.linalg.svd(self.free[:, 3:])
        mixed = mixing.T @ self.free
        n_turns = int((turns > _TURN_FRACTION).sum())
        return [
            *(f"rotation about {_name_axis(twist[3:])}" for twist in mixed[:n_turns]),
            *(f"translation along {_name_axis(twist[:3])}" for twist in mixed[n_turns:]),
        ]


def compute_information(
    pairs: Pairs,
    n: int,
    pose: RigidTransform,
    centre_mm: FloatArray,
    n_sharing_errors: float,
    *,
    tells_size: bool = False,
    thickness_rows_mm: FloatArray | None = None,
) -> Information:
    """Information of the first n pairs, weighted by kernel over variance, about `scene_from_bone`.

    Pairs and the model's centre (3,) are in bone coordinates. So many neighbouring pairs as
    `n_sharing_errors` have their errors in common. With `tells_size` pose and size fitted together
    are told as well. With `thickness_rows_mm` (n, k), by how much the residuals fall with standard
    normal unknowns of the cartilage, it is the information with those fitted.

    Source: Gauss-Newton normal equations at the solution; their inverse is the covariance.
    """
    seen_mm, lever_mm = find_weighted_centre(pairs, n)
    sized_H, g = _sum_sized_system(pairs, n, seen_mm, lever_mm)
    # What a thickness explains as well is less sure, and no less fixed by its shape.
    eigenvalues, vectors = np.linalg.eigh(sized_H[:6, :6])
    is_free = _are_free(eigenvalues)
    # (rotation x lever, translation) of the points become (translation, rotation) of the pose.
    turned = np.zeros((6, 6))
    turned[:3, 3:] = turned[3:, :3] = pose.rotation
    free = (turned @ vectors[:, is_free]).T
    if eigenvalues[0] <= _SINGULAR_FRACTION * eigenvalues[-1]:
        return Information(np.diag([np.inf] * 6), free)
    if thickness_rows_mm is not None:
        rows = _find_sized_rows(pairs, n, seen_mm, lever_mm)
        sized_H, _ = solve_out_thickness(
            rows, pairs.weight[:n], thickness_rows_mm, n_sharing_errors
        )
    H: FloatArray = sized_H[:6, :6]
    arm_mm = pose.rotation @ (centre_mm - seen_mm)
    change = _pose_by_points(pose.rotation, lever_mm, arm_mm)
    of_pose, inverse = change[:6, :6], np.asarray(np.linalg.inv(H), dtype=np.float64)
    covariance = n_sharing_errors * _propagate(of_pose, inverse)
    if not tells_size:
        return Information(covariance, free)
    # The size as a seventh unknown; where the pairs do not fix it, as expected.
    sized_H[6, 6] += n_sharing_errors / (_SIZE_SD * lever_mm) ** 2
    inverse = np.asarray(np.linalg.inv(sized_H), dtype=np.float64)
    sized = SizedPose(
        change @ (inverse @ -g),
        n_sharing_errors * _propagate(change, inverse),
        arm_mm,
        lever_mm,
    )
    return Information(covariance, free, sized)


def _propagate(change: FloatArray, covariance: FloatArray) -> FloatArray:
    """Covariance (k, k) of `change` @ x, where x has that covariance; symmetric."""
    propagated: FloatArray = change @ covariance @ change.T
    return 0.5 * (propagated + propagated.T)


def _pose_by_points(rotation: FloatArray, lever_mm: float, arm_mm: FloatArray) -> FloatArray:
    """(7, 7) public twist and growth by the solver's (rotation x lever, translation, growth).

    What moves the points one way moves the pose the other. `rotation` (3, 3) is scene from bone;
    the arm (3,) reaches from the seen surface's centre to the model's, in the scene's frame.
    """
    change = np.zeros((7, 7))
    turn = -rotation / lever_mm
    change[:3, :3] = -skew(arm_mm) @ turn
    change[:3, 3:6], change[3:6, :3], change[6, 6] = -rotation, turn, 1.0
    return change


def _sum_sized_system(
    pairs: Pairs, n: int, centre_mm: FloatArray, lever_mm: float
) -> tuple[FloatArray, FloatArray]:
    """Normal equations (7, 7), (7,) of the motion of the points and the growth of the model."""
    H, g = np.zeros((7, 7)), np.zeros(7)
    H[:6, :6], g[:6] = sum_plane_system(pairs, n, centre_mm, lever_mm)
    mixed, squares, product_mm = sum_size_terms(pairs, n, centre_mm, lever_mm)
    # Growth of the model brings residuals down, as growth of the points would bring them up.
    H[:6, 6] = H[6, :6] = -mixed
    H[6, 6], g[6] = squares, -product_mm
    return H, g


def _find_sized_rows(pairs: Pairs, n: int, centre_mm: FloatArray, lever_mm: float) -> FloatArray:
    """(n, 7) how residuals grow with the motion of the points, and fall with the model's growth."""
    offsets_mm = pairs.point[:n] - centre_mm
    outward = (offsets_mm * pairs.direction[:n]).sum(axis=1) / lever_mm
    return np.column_stack([find_motion_rows(pairs, n, centre_mm, lever_mm), -outward])


def _are_free(eigenvalues: FloatArray) -> NDArray[np.bool_]:
    """(n,) directions that are not fixed, of the ascending eigenvalues of an information."""
    # What is not a number fixes nothing.
    is_free: NDArray[np.bool_] = ~(eigenvalues >= FREE_FRACTION * eigenvalues[-1])
    return is_free


def leaves_direction_free(
    covariance: FloatArray, centre_mm: FloatArray, seen_mm: FloatArray
) -> bool:
    """Whether some direction of a pose is not fixed, as `compute_information` judges it.

    All points of the seen surface count alike for its centre and lever. Without any all is free.

    Args:
        covariance: (6, 6) of the public twist about `centre_mm`.
        centre_mm: (3,) the model's centre.
        seen_mm: (N, 3) the seen surface, in the same frame.
    """
    if len(seen_mm) == 0:
        return True
    middle_mm = seen_mm.mean(axis=0)
    lever_mm = math.sqrt(((seen_mm - middle_mm) ** 2).sum(axis=1).mean())
    about_seen = np.eye(6)
    about_seen[:3, 3:] = skew(centre_mm - middle_mm)
    about_seen[3:] *= lever_mm
    spread = np.linalg.eigvalsh(about_seen @ covariance @ about_seen.T)
    return bool(_are_free(1.0 / np.maximum(spread[::-1], np.finfo(float).tiny)).any())


def _name_axis(vector: FloatArray) -> str:
    """Direction of a vector, its largest component positive."""
    axis = vector / np.linalg.norm(vector)
    axis = axis * np.sign(axis[np.abs(axis).argmax()])
    x, y, z = (round(float(value), 2) + 0.0 for value in axis)
    return f"({x:g}, {y:g}, {z:g})"
