"""Comparison of the two views, on whole arrays."""

import numpy as np


def at_partner(right_values, disparity_px, shift, missing):
    """The right view's value at column floor(x + shift - d + 0.5)."""
    width, right_width = disparity_px.shape[1], right_values.shape[1]
    position = np.floor(np.arange(width) + (shift + 0.5) - disparity_px.astype(np.float64))
    is_inside = (position >= 0.0) & (position <= right_width - 1)
    column = np.where(is_inside, position, 0.0).astype(int)
    values = np.take_along_axis(right_values, column, axis=1)
    return np.where(is_inside, values, missing)


def judge(evidence, demands):
    """Which pixels have contrast, which match, how surely."""
    partner_contrast = at_partner(evidence.right_contrast, evidence.left_px, evidence.shift, 0)
    contrast = np.minimum(evidence.left_contrast, partner_contrast)
    partner_px = at_partner(evidence.right_px, evidence.left_px, evidence.shift, np.nan)
    difference = np.abs(partner_px - evidence.left_px)
    is_judged = contrast >= demands.contrast_grey
    is_matched = is_judged & (difference <= demands.max_difference_px)
    is_matched &= evidence.uniqueness >= demands.min_uniqueness
    texture = np.minimum(contrast / demands.full_contrast_grey, 1.0)
    closeness = 1.0 - 0.5 * np.nan_to_num(difference) / demands.max_difference_px
    return is_judged, is_matched, np.where(is_matched, evidence.uniqueness * texture * closeness, 0)
