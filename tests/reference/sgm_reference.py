"""Census, semi-global aggregation and the choice of both views, from the definitions with loops."""

import math

import numpy as np

# (dy, dx) along which a scan from the first pixel to the last can follow paths, and the other one.
DOWN = [(1, -1), (1, 0), (1, 1), (0, 1)]
UP = [(-dy, -dx) for dy, dx in DOWN]


def census(image, radius_x, radius_y):
    """(h, w) of tuples: which neighbours are darker; `image` has a margin of the radii."""
    height, width = image.shape[0] - 2 * radius_y, image.shape[1] - 2 * radius_x
    codes = np.empty((height, width), dtype=object)
    for y in range(height):
        for x in range(width):
            window = image[y : y + 2 * radius_y + 1, x : x + 2 * radius_x + 1]
            darker = (window < window[radius_y, radius_x]).ravel().tolist()
            del darker[len(darker) // 2]
            codes[y, x] = tuple(darker)
    return codes


def matching_cost(left, right, first_partner, n, no_partner):
    """(h, w, n) Hamming distances of two pictures of census tuples."""
    height, width = left.shape
    cost = np.full((height, width, n), no_partner, dtype=int)
    for y in range(height):
        for x in range(width):
            for k in range(n):
                u = x + first_partner - k
                if 0 <= u < right.shape[1]:
                    cost[y, x, k] = sum(
                        a != b for a, b in zip(left[y, x], right[y, u], strict=True)
                    )
    return cost


def surplus(cost, grey, directions, p1, p2, edge_grey):
    """(h, w, n) what paths along some directions add to the cost (Hirschmueller 2008, eq. 13)."""
    height, width, n = cost.shape
    total = np.zeros_like(cost)
    for dy, dx in directions:
        path = cost.copy()
        for y in range(height)[:: -1 if dy < 0 else 1]:
            for x in range(width)[:: -1 if dx < 0 else 1]:
                yb, xb = y - dy, x - dx
                if not (0 <= yb < height and 0 <= xb < width):
                    continue
                step = abs(int(grey[y, x]) - int(grey[yb, xb]))
                jump = max(p1 + 1, p2 // (1 + step // edge_grey))
                before = path[yb, xb]
                for k in range(n):
                    ways = [before[k], before.min() + jump]
                    ways += [before[m] + p1 for m in (k - 1, k + 1) if 0 <= m < n]
                    path[y, x, k] = cost[y, x, k] + min(ways) - before.min()
        total += path - cost
    return total


def aggregate(cost, grey, p1, p2, edge_grey):
    """(h, w, n) sum of the path costs over eight directions."""
    return 8 * cost + surplus(cost, grey, DOWN + UP, p1, p2, edge_grey)


def choose(total, first_partner, lowest_px, right_width):
    """Left disparity (sub-pixel), right disparity and uniqueness of one aggregated cost."""
    height, width, n = total.shape
    left = np.full((height, width), math.nan)
    right = np.full((height, right_width), math.nan)
    uniqueness = np.empty((height, width))
    for y in range(height):
        for x in range(width):
            sums = total[y, x]
            best = int(np.argmin(sums))
            others = [sums[k] for k in range(n) if abs(k - best) > 1]
            uniqueness[y, x] = min(1.0, (min(others) - sums[best]) / max(sums[best], 1))
            if 0 < best < n - 1:
                a, b, c = (float(sums[best + k]) for k in (-1, 0, 1))
                bend = a - 2.0 * b + c
                left[y, x] = lowest_px + best + (0.5 * (a - c) / bend if bend > 0.0 else 0.0)
        for u in range(right_width):
            seen = [
                (total[y, u - first_partner + k, k], u - first_partner + k, k)
                for k in range(n)
                if 0 <= u - first_partner + k < width
            ]
            if seen:
                right[y, u] = lowest_px + min(seen)[2]
    return left, right, uniqueness
