"""The pose of a plate from measured places in both pictures: one robust least-squares fit.

Beside the pose stand how far white spreads over black in each picture, and the paper (`paper.py`).
What is known of them beforehand takes part, so that the covariance of the pose counts the rest.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.camera import Camera
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.tools.paper import Paper

# Standard deviation of the spread of white in a picture.
_SPREAD_PX = 0.3
_N_POSE, _N_SEEN = 6, 8
# Tukey's weight ends at so many standard deviations; residuals are never trusted below this.
_TUKEY, _LEAST_SIGMA_PX = 4.7, 0.02
_ROUNDS = 4
# Error that all edges of one direction on one marker have in common in a picture.
_COMMON_PX = 0.03


@dataclass(frozen=True, slots=True, eq=False)
class Lines:
    """Places that were measured across lines in the picture of one eye."""

    points_mm: FloatArray  # (n, 3) in the plate's frame
    # (n, 3, P) of those points by the paper.
    by_paper: FloatArray
    across_px: FloatArray  # (n, 2) unit normal of the line
    offset_px: FloatArray  # (n,) along that normal, from where the pose has it
    # 1 where white begins beyond the line, so that its spread counts; 0 for corners of markers.
    whitens: float
    edge: NDArray[np.intp]  # (n,) places of one edge err together
    side: NDArray[np.intp]  # (n,) of one marker: these have an error in common


@dataclass(frozen=True, slots=True, eq=False)
class PlateFit:
    """A pose that explains the places, and how well."""

    left_from_plate: RigidTransform
    covariance: FloatArray  # (6, 6) twist about the plate's origin, left camera's axes; mm, rad
    spread_px: FloatArray  # (2,) of white in the left and the right picture
    paper: FloatArray  # (P,) that explains them best
    # Of these pictures alone, with pose and spread solved for: the information on the paper (P, P)
    # and the right side of its normal equations (P,).
    paper_information: FloatArray
    paper_pull: FloatArray
    pose_by_paper: FloatArray  # (6, P) how the twist of the pose follows another paper
    sigma_px: float  # of a place that agrees
    weights: FloatArray  # (n,) of the left places, then of the right ones; 0: does not agree


def view(rig: StereoRig, eye: int) -> tuple[Camera, RigidTransform]:
    """A camera, and where it stands (camera_from_left). Eye 0 is the left one."""
    if eye == 0:
        return rig.left, RigidTransform.identity("left", "left")
    return rig.right, rig.right_from_left


def fit_plate(
    rig: StereoRig, lines: tuple[Lines, Lines], left_from_plate: RigidTransform, paper: Paper
) -> PlateFit:
    """The pose, near the given one, at which the measured places lie on their lines.

    Places that do not agree lose their weight (Tukey's; the scale is the median's).
    """
    slopes = np.concatenate(
        [_compute_slopes(rig, eye, one, left_from_plate) for eye, one in enumerate(lines)]
    )
    offsets = np.concatenate([one.offset_px for one in lines])
    prior, before = _make_prior(paper)
    change, residuals = before, offsets - slopes @ before
    for _ in range(_ROUNDS):
        sigma_px = max(1.4826 * float(np.median(np.abs(residuals))), _LEAST_SIGMA_PX)
        scaled = np.minimum(np.abs(residuals) / (_TUKEY * sigma_px), 1.0)
        weights = (1.0 - scaled**2) ** 2 / sigma_px**2
        seen = (slopes.T * weights) @ slopes
        right = slopes.T @ (weights * offsets) + prior @ before
        change = np.linalg.solve(seen + prior, right)
        residuals = offsets - slopes @ change
    covariance = _compute_covariance(seen + prior, prior, slopes, weights, residuals, lines)
    own, shared = slice(0, _N_SEEN), slice(_N_SEEN, None)
    apart = np.linalg.solve(seen[own, own] + prior[own, own], seen[own, shared])
    told = slopes.T @ (weights * offsets)
    return PlateFit(
        left_from_plate.move(change[:_N_POSE], left_from_plate.translation_mm),
        covariance[:_N_POSE, :_N_POSE],
        change[_N_POSE:_N_SEEN],
        change[_N_SEEN:],
        seen[shared, shared] - seen[shared, own] @ apart,
        told[shared] - apart.T @ told[own],
        -apart[:_N_POSE],
        sigma_px,
        weights * sigma_px**2,
    )


def _make_prior(paper: Paper) -> tuple[FloatArray, FloatArray]:
    """Information (n, n) and mean (n,) of everything that is fitted."""
    n = _N_SEEN + len(paper.mean)
    prior = np.zeros((n, n))
    prior[range(_N_POSE, _N_SEEN), range(_N_POSE, _N_SEEN)] = _SPREAD_PX**-2
    prior[_N_SEEN:, _N_SEEN:] = np.linalg.inv(paper.covariance)
    return prior, np.concatenate([np.zeros(_N_SEEN), paper.mean])


def _compute_slopes(
    rig: StereoRig, eye: int, lines: Lines, left_from_plate: RigidTransform
) -> FloatArray:
    """(n, 8 + P) of offsets by the pose's twist about the plate's origin, spreads, paper."""
    camera, eye_from_left = view(rig, eye)
    arms = left_from_plate.rotate(lines.points_mm)
    in_eye = eye_from_left.apply(arms + left_from_plate.translation_mm)
    in_picture = compute_picture_slopes(camera, in_eye)
    by_place = np.einsum("ni,nij->nj", lines.across_px, in_picture) @ eye_from_left.rotation
    spread = np.zeros((len(arms), 2))
    spread[:, eye] = lines.whitens
    by_paper = np.einsum("nj,njp->np", by_place @ left_from_plate.rotation, lines.by_paper)
    return np.hstack([by_place, np.cross(arms, by_place), spread, by_paper])


def compute_picture_slopes(camera: Camera, points_mm: FloatArray) -> FloatArray:
    """(n, 2, 3) of pixels by places in the camera's frame; the lens' distortion is left out."""
    z = points_mm[:, 2]
    slopes = np.zeros((len(points_mm), 2, 3))
    for axis in range(2):
        slopes[:, axis, axis] = camera.matrix[axis, axis] / z
        slopes[:, axis, 2] = -slopes[:, axis, axis] * points_mm[:, axis] / z
    return slopes


def _compute_covariance(
    information: FloatArray,
    prior: FloatArray,
    slopes: FloatArray,
    weights: FloatArray,
    residuals: FloatArray,
    lines: tuple[Lines, Lines],
) -> FloatArray:
    """Sandwich: residuals of one edge are one error, and sides of markers have one in common."""
    by_edge = _sum_groups(slopes * (weights * residuals)[:, None], [one.edge for one in lines])
    by_side = _sum_groups(slopes * weights[:, None], [one.side for one in lines])
    n_used = int(np.count_nonzero(np.abs(by_edge).sum(axis=1)))
    few = n_used / max(n_used - _N_SEEN, 1)
    inverse = np.linalg.inv(information)
    middle = few * by_edge.T @ by_edge + _COMMON_PX**2 * by_side.T @ by_side + prior
    return np.asarray(inverse @ middle @ inverse)


def _sum_groups(rows: FloatArray, groups: list[NDArray[np.intp]]) -> FloatArray:
    """(groups, n) sums over the groups of each eye, apart."""
    n = max(int(one.max()) for one in groups) + 1
    sums = np.zeros((2 * n, rows.shape[1]))
    np.add.at(sums, np.concatenate([groups[0], groups[1] + n]), rows)
    return sums
