"""A plate's paper as many pictures of it tell, and its poses corrected for it."""

import numpy as np

from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.tools.paper import Paper
from navapp.tools.plate_fit import PlateFit


def fit_paper(fits: list[PlateFit], before: Paper) -> Paper:
    """What all pictures together say.

    The covariance is a sandwich over the views: what a view leaves counts as one error.

    Args:
        fits: of the views, all with the same paper before.
        before: what was known.
    """
    prior = np.linalg.inv(before.covariance)
    information = prior + sum(one.paper_information for one in fits)
    inverse = np.linalg.inv(information)
    pulls = np.array([one.paper_pull for one in fits])
    mean = inverse @ (prior @ before.mean + pulls.sum(axis=0))
    left = pulls - np.array([one.paper_information @ mean for one in fits])
    few = len(fits) / max(len(fits) - 1, 1)
    return Paper(mean, inverse @ (few * left.T @ left + prior) @ inverse)


def correct_pose(fit: PlateFit, paper: Paper) -> RigidTransform:
    """left_from_plate with this paper instead of what the view alone made of it."""
    twist: FloatArray = fit.pose_by_paper @ (paper.mean - fit.paper)
    pose = fit.left_from_plate
    return pose.move(twist, pose.translation_mm)
