"""Local least squares of one disparity step, from the equations with loops.

For a window with left values l, right values r (sampled at x - d) and their derivative g:
minimise sum (l' - b r' + c g')^2 over b and c (primes: window mean removed); the step is c / b.
"""

import math

import numpy as np


def catmull_rom(row, u):
    """Value and derivative of a row at a real position; None outside."""
    i = math.floor(u)
    if i < 1 or i + 2 >= len(row):
        return None
    t = u - i
    p = [float(row[i + k]) for k in (-1, 0, 1, 2)]
    a = 0.5 * (p[2] - p[0])
    b = p[0] - 2.5 * p[1] + 2.0 * p[2] - 0.5 * p[3]
    c = -0.5 * p[0] + 1.5 * p[1] - 1.5 * p[2] + 0.5 * p[3]
    return p[1] + a * t + b * t**2 + c * t**3, a + 2.0 * b * t + 3.0 * c * t**2


def refine_step(left, right, support, offset, right_column, radius, min_filled):
    """(h, w) new offset, and (h, w, 4) step, sigma, correlation and roughness px of each window.

    Where a window cannot tell, the correlation is 0 and the others are NaN.
    """
    height, width = left.shape
    refined = np.zeros((height, width))
    quality = np.tile([np.nan, np.nan, 0.0, np.nan], (height, width, 1))
    for y in range(height):
        for x in range(width):
            samples, offsets = [], []
            for v in range(max(0, y - radius), min(height, y + radius + 1)):
                for u in range(max(0, x - radius), min(width, x + radius + 1)):
                    if math.isnan(support[v, u]):
                        continue
                    seen = catmull_rom(right[v], u + right_column - support[v, u] - offset[v, u])
                    if seen is not None:
                        samples.append((float(left[v, u]), *seen))
                        offsets.append(float(offset[v, u]))
            weights = [slope**2 for _, _, slope in samples]
            if sum(weights) > 1e-3:
                refined[y, x] = np.average(offsets, weights=weights)
            if math.isnan(support[y, x]) or len(samples) < min_filled * (2 * radius + 1) ** 2:
                continue
            solved = solve(np.array(samples))
            if solved is not None:
                spread = np.average((offsets - refined[y, x]) ** 2, weights=weights) ** 0.5
                quality[y, x] = *solved, spread
                refined[y, x] += np.clip(solved[0], -0.5, 0.5)
    return refined, quality


def solve(samples):
    """Step, sigma and correlation of one window; None when it cannot tell."""
    n = len(samples)
    left, right, slope = (samples - samples.mean(axis=0)).T
    if left @ left < 1e-3 * n or right @ right < 1e-3 * n or slope @ slope < 1e-4 * n:
        return None
    design = np.column_stack([right, -slope])
    normal = design.T @ design
    if np.linalg.det(normal) < 1e-3 * (right @ right) * (slope @ slope):
        return None
    b, c = np.linalg.solve(normal, design.T @ left)
    if not 0.2 <= b <= 5.0:
        return None
    residual = left - design @ (b, c)
    variance = residual @ residual / max(n - 3, 1) * np.linalg.inv(normal)[1, 1] / b**2
    correlation = left @ right / math.sqrt((left @ left) * (right @ right))
    return c / b, math.sqrt(variance), correlation
