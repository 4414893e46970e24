"""Readable counterparts of the registration kernels: numpy, straight from the equations.

A pose is (R, t), bone from scene; a pair is the indices of its scene point and its vertex.
"""

from dataclasses import dataclass

import numpy as np

from tests.reference.lookup_reference import nearest_by_trying_all


@dataclass
class Measured:
    """What is known of each pair at a pose."""

    point: np.ndarray
    residual: np.ndarray
    direction: np.ndarray
    excess: np.ndarray
    variance: np.ndarray


def facing(model, camera):
    """(V,) cosine between each vertex's normal and its line of sight."""
    towards = camera - model.points
    return (model.normals * towards).sum(axis=1) / np.linalg.norm(towards, axis=1)


def pair_forward(scene, model, R, t, every):
    """(scene points, vertices): nearest vertices that may pair and face the camera."""
    chosen = np.arange(0, len(scene.points), every)
    vertex, _ = nearest_by_trying_all(scene.points[chosen] @ R.T + t, model.points)
    keeps = model.can_pair[vertex]
    if scene.has_camera:
        keeps &= facing(model, R @ scene.camera + t)[vertex] >= 0.0
    return chosen[keeps], vertex[keeps]


def asked_vertices(scene, model, R, t, every, least_cosine):
    """Every n-th vertex that may pair and looks at the camera."""
    chosen = np.arange(0, len(model.points), every)
    chosen = chosen[model.can_pair[chosen]]
    if scene.has_camera:
        chosen = chosen[facing(model, R @ scene.camera + t)[chosen] >= least_cosine]
    return chosen


def pair_backward(scene, grid, model, R, t, every, radius_mm, least_cosine):
    """(scene points, vertices): the point that the grid knows of at each vertex that is asked."""
    found = []
    for v in asked_vertices(scene, model, R, t, every, least_cosine):
        place = R.T @ (model.points[v] - t)
        cell = np.floor((place - grid.origin) / grid.voxel + 0.5).astype(int)
        if (cell < 0).any() or (cell >= grid.nearest.shape).any():
            continue
        i = grid.nearest[tuple(cell)]
        if i >= 0 and np.linalg.norm(place - scene.points[i]) <= radius_mm:
            found.append((i, v))
    pairs = np.array(found, dtype=int).reshape(-1, 2)
    return pairs[:, 0], pairs[:, 1]


def fill_scene_grid(points, every, shape, origin, voxel):
    """Nearest point of each voxel's centre, handed on by two sweeps over the six neighbours."""
    nearest = np.full(shape, -1)

    def squared(i, cell):
        return ((points[i] - origin - voxel * np.array(cell)) ** 2).sum()

    def offer(i, cell):
        if nearest[cell] < 0 or squared(i, cell) < squared(nearest[cell], cell):
            nearest[cell] = i

    for i in range(0, len(points), every):
        offer(i, tuple(np.floor((points[i] - origin) / voxel + 0.5).astype(int)))
    for step in (1, -1):
        for cell in sorted(np.ndindex(*shape), reverse=step < 0):
            for axis in range(3):
                other = list(cell)
                other[axis] -= step
                if 0 <= other[axis] < shape[axis] and nearest[tuple(other)] >= 0:
                    offer(nearest[tuple(other)], cell)
    return nearest


def measure_pairs(scene, model, R, t, chosen, vertex):
    """Residual to the bent surface f(p) = n.(p - v) + (p - v).B(p - v) / 2, over |grad f|."""
    point = scene.points[chosen] @ R.T + t
    normal = model.normals[vertex]
    offset = point - model.points[vertex]
    height = (normal * offset).sum(axis=1)
    along = np.linalg.norm(offset - height[:, None] * normal, axis=1)
    xx, yy, zz, xy, xz, yz = model.curvature[vertex].T
    B = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]).transpose(2, 0, 1)
    B = B * (along < 2.0 * model.spacing[vertex])[:, None, None]
    bent = np.einsum("nij,nj->ni", B, offset)
    slope = np.linalg.norm(normal + bent, axis=1)
    direction = (normal + bent) / slope[:, None]
    residual = (height + 0.5 * (offset * bent).sum(axis=1)) / slope
    cosine = np.ones(len(point))
    if scene.has_camera:
        ray = point - (R @ scene.camera + t)
        cosine = (direction * ray).sum(axis=1) / np.linalg.norm(ray, axis=1)
    variance = (scene.sigma_ray[chosen] * cosine) ** 2 + model.sigma[vertex] ** 2
    excess = np.maximum(along - model.spacing[vertex], 0.0)
    return Measured(point, residual, direction, excess, variance)


def weigh(measured, sigma_mm, n_sigmas, noise_mm2):
    """(kernels, weights): kernels, cut where they are nothing, and these over the variances."""
    variance = measured.variance + noise_mm2
    rho2 = measured.residual**2 + measured.excess**2
    width = np.maximum(sigma_mm, n_sigmas * np.sqrt(variance))
    kernels = np.where(rho2 < 50.0 * width**2, np.exp(-rho2 / (2.0 * width**2)), 0.0)
    return kernels, kernels / variance


def noise_under_kernel_mm2(measured, kernels, sigma_mm):
    """s^2 of 1/v = 1/s^2 + 1/sigma^2, v the variance under the kernel; at most sigma^2."""
    v = (kernels * measured.residual**2).sum() / kernels.sum()
    inverse = 1.0 / v - 1.0 / sigma_mm**2
    return sigma_mm**2 if inverse <= sigma_mm**-2 else 1.0 / inverse


def weighted_centre(point, weight):
    """(centre, rms distance from it)."""
    centre = weight @ point / weight.sum()
    return centre, np.sqrt(weight @ ((point - centre) ** 2).sum(axis=1) / weight.sum())


def plane_system(measured, weight, centre, lever_mm):
    """(H, g): each row is [(p - c) x n / lever, n]."""
    rows = np.hstack(
        [np.cross(measured.point - centre, measured.direction) / lever_mm, measured.direction]
    )
    return rows.T @ (weight[:, None] * rows), rows.T @ (weight * measured.residual)


def size_terms(measured, weight, centre, lever_mm):
    """(mixed with the motion, squares, product) of the row n . (p - c) / lever."""
    offset = measured.point - centre
    row = (offset * measured.direction).sum(axis=1) / lever_mm
    motion = np.hstack([np.cross(offset, measured.direction) / lever_mm, measured.direction])
    return motion.T @ (weight * row), weight @ row**2, weight @ (row * measured.residual)


def point_system(measured, model, vertex, weight, centre, lever_mm):
    """(H, g) of the whole distances: three rows [-[p - c]x / lever, I] for each pair."""
    H, g = np.zeros((6, 6)), np.zeros(6)
    for p, v, w in zip(measured.point, vertex, weight, strict=True):
        x, y, z = (p - centre) / lever_mm
        rows = np.hstack([[[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]], np.eye(3)])
        H += w * rows.T @ rows
        g += w * rows.T @ (p - model.points[v])
    return H, g


def solve_step(H, g, lever_mm):
    """(6,) step along what is fixed: rotation rad, translation mm, at most 0.25 rad and 10 mm."""
    step = -np.linalg.pinv(H, rcond=5e-3, hermitian=True) @ g
    turn, shift = step[:3] / lever_mm, step[3:]
    turn *= min(1.0, 0.25 / max(np.linalg.norm(turn), 1e-300))
    shift *= min(1.0, 10.0 / max(np.linalg.norm(shift), 1e-300))
    return np.append(turn, shift)


def apply_twist(twist, centre, R, t):
    """The pose after a rotation about a centre and a translation."""
    from scipy.spatial.transform import Rotation

    turn = Rotation.from_rotvec(twist[:3]).as_matrix()
    return turn @ R, turn @ (t - centre) + centre + twist[3:]


def step_coarse(scene, grid, model, R, t, sigma_mm, settings):
    """(R, t) after one iteration of the coarse loop."""
    forward = pair_forward(scene, model, R, t, scene.every)
    radius_mm = min(3.0 * sigma_mm, settings.widest_mm)
    model_every = max(1, len(model.points) // settings.model_points)
    backward = pair_backward(scene, grid, model, R, t, model_every, radius_mm, 0.2)
    chosen, vertex = np.concatenate([forward, backward], axis=1)
    measured = measure_pairs(scene, model, R, t, chosen, vertex)
    off_mm2 = (sigma_mm / settings.n_sigmas) ** 2
    _, weight = weigh(measured, sigma_mm, settings.n_sigmas, off_mm2)
    n, n_backward = len(forward[0]), max(len(backward[0]), 1)
    weight[n:] *= settings.backward_weight * n / n_backward
    centre, lever_mm = weighted_centre(measured.point, weight)
    H, g = plane_system(measured, weight, centre, lever_mm)
    H_point, g_point = point_system(measured, model, vertex, weight, centre, lever_mm)
    H, g = H + settings.point_weight * H_point, g + settings.point_weight * g_point
    return apply_twist(solve_step(H, g, lever_mm), centre, R, t)


def step_fine(scene, model, R, t, sigma_mm, settings):
    """(R, t, wanted sigma) after one iteration of the fine loop."""
    chosen, vertex = pair_forward(scene, model, R, t, 1)
    measured = measure_pairs(scene, model, R, t, chosen, vertex)
    kernels, weight = weigh(measured, sigma_mm, settings.n_sigmas, 0.0)
    centre, lever_mm = weighted_centre(measured.point, weight)
    twist = solve_step(*plane_system(measured, weight, centre, lever_mm), lever_mm)
    noise_mm = np.sqrt(noise_under_kernel_mm2(measured, kernels, sigma_mm))
    widest_mm = settings.widest_at_rest_mm
    wanted_mm = np.clip(settings.n_sigmas * noise_mm, settings.narrowest_mm, widest_mm)
    return *apply_twist(twist, centre, R, t), wanted_mm


def twist_information(measured, weight, pose, centre_mm):
    """(6, 6) information of `scene_from_bone`'s public twist, by differences of the residuals.

    A twist moves the bone; the scene's points move the other way as seen from it.
    """
    rows, step = np.zeros((len(weight), 6)), 1e-4
    scene_point = pose.apply(measured.point)
    for k in range(6):
        twist = np.eye(6)[k] * step
        there = pose.move(twist, pose.apply(centre_mm)).inverse().apply(scene_point)
        back = pose.move(-twist, pose.apply(centre_mm)).inverse().apply(scene_point)
        rows[:, k] = ((there - back) * measured.direction).sum(axis=1) / (2.0 * step)
    return rows.T @ (weight[:, None] * rows)


def bidirectional_pairs(scene_mm, model_mm):
    """The paper's (4) on placed points: (scene points, vertices), forward then backward."""
    vertex, _ = nearest_by_trying_all(scene_mm, model_mm)
    point, _ = nearest_by_trying_all(model_mm, scene_mm)
    n, m = np.arange(len(scene_mm)), np.arange(len(model_mm))
    return np.concatenate([n, point]), np.concatenate([vertex, m])
