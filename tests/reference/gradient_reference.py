"""Sum of gradient magnitude differences: equations (2) and (3) written out with loops."""

import numpy as np


def match(left, right, radius, n, inside):
    """Numbers of the best disparities of the left and of the right view; -1 without a partner.

    Args: magnitudes of the left part and of all its partners, both with a margin of the window's
    radius; the number of disparities. The left pixel x at number k has the right partner
    x + n - 1 - k, and partners outside `inside` do not compete.
    """
    height, width = left.shape[0] - 2 * radius, left.shape[1] - 2 * radius
    side = 2 * radius + 1
    cost = np.full((height, width, n), np.inf)
    for y in range(height):
        for x in range(width):
            for k in range(n):
                u = x + n - 1 - k
                if inside[0] <= u < inside[1]:
                    a = left[y : y + side, x : x + side]
                    b = right[y : y + side, u : u + side]
                    cost[y, x, k] = np.abs(a - b).sum() / side**2
    left_best = np.where(np.isfinite(cost).any(axis=2), cost.argmin(axis=2), -1)
    right_best = np.full((height, width + n - 1), -1)
    for y in range(height):
        for u in range(*inside):
            seen = [
                (cost[y, u - n + 1 + k, k], u - n + 1 + k, k)
                for k in range(n)
                if 0 <= u - n + 1 + k < width
            ]
            if seen:
                right_best[y, u] = min(seen)[2]
    return left_best, right_best
