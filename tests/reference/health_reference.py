"""Vertical offset of one window's partner, from the equation, with numpy's least squares."""

import numpy as np


def row_offset(left, right, disparity, is_matched, place, centre, radius, row_shift_px):
    """Offset, its standard deviation, correlation and share measured of one window."""
    x0, y0 = place
    v, u = centre
    lefts, terms = [], []
    for y in range(v - radius, v + radius + 1):
        for x in range(u - radius, u + radius + 1):
            if not is_matched[y, x]:
                continue
            column, row = x0 + x - float(disparity[y, x]), y0 + y + row_shift_px
            i, j = int(np.floor(row)), int(np.floor(column))
            s, t = row - i, column - j
            corners = right[i : i + 2, j : j + 2].astype(float)
            seen = np.array([1.0 - s, s]) @ corners @ np.array([1.0 - t, t])
            q, p = y0 + y, x0 + x
            slope_x = (float(left[q, p + 1]) - float(left[q, p - 1])) / 2.0
            slope_y = (float(left[q + 1, p]) - float(left[q - 1, p])) / 2.0
            lefts.append(float(left[q, p]))
            terms.append((1.0, seen, slope_x, slope_y))
    A, b = np.array(terms), np.array(lefts)
    solved, *_ = np.linalg.lstsq(A, b, rcond=None)
    residual = b - A @ solved
    variance = residual @ residual / (len(b) - 4) * np.linalg.inv(A.T @ A)[3, 3]
    correlation = np.corrcoef(A[:, 1], b)[0, 1]
    share = len(b) / (2 * radius + 1) ** 2
    return row_shift_px + solved[3], np.sqrt(variance), correlation, share
