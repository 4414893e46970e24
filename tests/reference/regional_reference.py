"""Robust locally weighted quadratics blended into one surface, from the definition with loops."""

import numpy as np

N_START = 7


def regional_reference(samples, weights, shape, settings):
    """(h, w) float64 px; NaN where no node around has a polynomial."""
    rows, columns = np.nonzero((weights > 0) & ~np.isnan(samples))
    y, x = rows * settings.thin, columns * settings.thin
    d, given = samples[rows, columns].astype(float), weights[rows, columns].astype(float)
    nodes = [(size - 1) // settings.node_px + 2 for size in shape]
    polynomials, support = np.zeros((*nodes, 6)), np.zeros(nodes)
    for j, i in np.ndindex(*nodes):
        u = (x - i * settings.node_px) / settings.radius_px
        v = (y - j * settings.node_px) / settings.radius_px
        inside = (abs(u) <= 1) & (abs(v) <= 1)
        if inside.sum() >= settings.min_samples:
            fitted = fit(u[inside], v[inside], d[inside], given[inside], settings)
            polynomials[j, i], support[j, i] = fitted
    return blended(polynomials, support, shape, settings)


def fit(u, v, d, given, settings):
    """Coefficients of 1, u, v, u^2, uv, v^2, and the mean weight."""
    terms = np.stack([np.ones_like(u), u, v, u * u, u * v, v * v])
    ridge = len(d) * np.diag([1e-6, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3])
    coefficients = np.zeros(6)
    coefficients[0] = median_of_some(u, v, d, settings)
    for scale in settings.scales_px:
        residual = d - coefficients @ terms
        robust = 1.0 / (1.0 + (residual / scale) ** 2) ** 2
        w = given * robust * np.exp(-1.5 * (u * u + v * v))
        drawn = ridge @ coefficients
        drawn[0] = 0.0
        normal = (terms * w) @ terms.T + ridge
        coefficients += np.linalg.solve(normal, (terms * w) @ residual - drawn)
    return coefficients, w.mean()


def median_of_some(u, v, d, settings):
    """Median of the samples at up to seven places of the window each way; 0 without any."""
    reach = settings.radius_px // settings.thin
    steps = np.round(np.linspace(0, 2 * reach, N_START)) - reach
    per_sample = settings.radius_px / settings.thin
    near = np.isin(np.round(u * per_sample), steps) & np.isin(np.round(v * per_sample), steps)
    return np.median(d[near]) if near.any() else 0.0


def blended(polynomials, support, shape, settings):
    """Every pixel's four nodes, by bilinear weight times support."""
    side, radius = settings.node_px, settings.radius_px
    surface = np.full(shape, np.nan)
    for y, x in np.ndindex(*shape):
        values, weights = [], []
        for j in (y // side, y // side + 1):
            for i in (x // side, x // side + 1):
                u, v = x - i * side, y - j * side
                share = (1 - abs(u) / side + 1e-6) * (1 - abs(v) / side + 1e-6)
                u, v = u / radius, v / radius
                values.append(polynomials[j, i] @ [1, u, v, u * u, u * v, v * v])
                weights.append(share * support[j, i])
        if sum(weights) > 0:
            surface[y, x] = np.average(values, weights=weights)
    return surface
