"""Filled pixels that are nearer than their occlusion allows, pixel by pixel from the rule."""

import numpy as np

MATCHED, INTERIOR = 1, 3


def find_beyond_bound_slowly(disparity, origin, edge_px, layer_px):
    """(h, w) filled pixels beyond the bound that differ from a matched neighbour."""
    height, width = origin.shape
    out = np.zeros((height, width), dtype=bool)
    for y in range(height):
        matched = [x for x in range(width) if origin[y, x] == MATCHED]
        for x in range(width):
            if origin[y, x] < INTERIOR:
                continue
            right = [k for k in matched if k > x]
            left = [k for k in matched if k < x]
            most = max((disparity[y, k] - (k - x) for k in right), default=-np.inf)
            neighbours = [disparity[y, k] for k in left[-1:] + right[:1]]
            differs = any(abs(disparity[y, x] - one) > layer_px for one in neighbours)
            out[y, x] = disparity[y, x] > most + edge_px and differs
    return out
