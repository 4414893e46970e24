"""The models of a corner and of a disc, straight from their equations."""

import numpy as np
from scipy.special import erf


def corner(x, y, p):
    """I = m + a E(d1) E(d2) + g . x."""
    cx, cy, angle_1, angle_2, blur, a, m, gx, gy = p
    d = [np.dot((-np.sin(t), np.cos(t)), (x - cx, y - cy)) for t in (angle_1, angle_2)]
    e = [erf(one / (np.sqrt(2.0) * blur)) for one in d]
    return m + a * e[0] * e[1] + gx * x + gy * y


def disc(x, y, p):
    """I = m + a E(d) + g . (x - c), with d = (rho - 1) / |grad rho| and rho = |B (x - c)|."""
    cx, cy, b11, b12, b22, blur, a, m, gx, gy = p
    b, q = np.array([[b11, b12], [b12, b22]]), np.array([x - cx, y - cy])
    rho = np.linalg.norm(b @ q)
    gradient = b.T @ (b @ q) / rho
    d = (rho - 1.0) / np.linalg.norm(gradient)
    return m + a * erf(d / (np.sqrt(2.0) * blur)) + gx * q[0] + gy * q[1]
