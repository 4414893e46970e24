"""Readable versions of the compiled scores of hypotheses."""

import numpy as np


def quantised(picture, least):
    """One bit a pixel: the gradient's direction, 8 of them over half a turn; 0 where weak."""
    gy, gx = np.gradient(picture)
    k = np.floor(np.arctan2(gy, gx) * 8 / np.pi + 0.5).astype(int) % 8
    bins = np.where(gx**2 + gy**2 > least**2, 1 << k, 0).astype(np.uint8)
    bins[[0, -1]] = 0
    bins[:, [0, -1]] = 0
    return bins


def responses(bins, reach):
    """(h, w, 8): the best |cos| of each direction with those within reach, times 255."""
    height, width = bins.shape
    answer = np.zeros((height, width, 8))
    for dy in range(-reach, reach + 1):
        for dx in range(-reach, reach + 1):
            moved = np.zeros_like(bins)
            there = np.s_[max(dy, 0) : height + min(dy, 0), max(dx, 0) : width + min(dx, 0)]
            here = np.s_[max(-dy, 0) : height + min(-dy, 0), max(-dx, 0) : width + min(-dx, 0)]
            moved[here] = bins[there]
            for j in range(8):
                has = (moved >> j) & 1
                cosine = np.abs(np.cos(np.pi * (np.arange(8) - j) / 8))
                answer = np.maximum(answer, has[..., None] * cosine)
    return np.round(255 * answer).astype(np.uint8)


def edge_score(rotation, shift, points, tangents, pictures, optics):
    """Equations 2 and 3 with the tables' answer instead of |cos|."""
    total = 0.0
    for response, baseline in zip(pictures, (0.0, optics.baseline_mm), strict=True):
        for point, tangent in zip(points, tangents, strict=True):
            at = [rotation @ (point + s * tangent) + shift - (baseline, 0, 0) for s in (0.0, 1e-4)]
            (u, v), (u2, v2) = (
                (
                    optics.focal_px * p[0] / p[2] + optics.centre_x_px,
                    optics.focal_px * p[1] / p[2] + optics.centre_y_px,
                )
                for p in at
            )
            x, y = int(np.floor(u + 0.5)), int(np.floor(v + 0.5))
            if 0 <= x < response.shape[1] and 0 <= y < response.shape[0]:
                k = int(np.floor(np.arctan2(u2 - u, -(v2 - v)) * 8 / np.pi + 0.5)) % 8
                total += response[y, x, k] / 255
    return total / (2 * len(points))


def surface_score(rotation, shift, points, depth, optics, reach):
    """Share of points at the measured depth, less the share that was seen through."""
    total = 0
    for point in points:
        x, y, z = rotation @ point + shift
        u = int(np.floor(optics.focal_px * x / z + optics.centre_x_px + 0.5))
        v = int(np.floor(optics.focal_px * y / z + optics.centre_y_px + 0.5))
        if 0 <= u < depth.shape[1] and 0 <= v < depth.shape[0] and depth[v, u] > 0:
            behind = depth[v, u] - z
            total += -1 if behind > reach else int(behind > -reach)
    return total / len(points)
