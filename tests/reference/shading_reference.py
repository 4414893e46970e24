"""Readable counterpart of sim_devices.shading_kernels."""

import numpy as np


def sample(tile, point):
    """Both channels in deviations and the gradient of the first per voxel, at a point in voxels."""
    low = np.floor(point).astype(int)
    share = point - low
    channels = np.stack([tile & 255, tile >> 8], axis=-1).astype(float)
    values = np.zeros(2)
    gradient = np.zeros(3)
    for corner in np.ndindex(2, 2, 2):
        bits = np.array(corner)
        factors = np.where(bits == 1, share, 1.0 - share)
        value = (channels[tuple((low + bits) % len(tile))] - 128.0) / 40.0
        values += factors.prod() * value
        for axis in range(3):
            others = np.delete(factors, axis).prod()
            gradient[axis] += (2 * bits[axis] - 1) * others * value[0]
    return values, gradient


def sample_surface(tile, point_mm, across_mm, lookups):
    """Fine and coarse noise, each value and slope, as means over a way across a pixel."""
    shift = np.array([41.3, 17.9, 73.1])
    found = []
    for t in (np.arange(lookups) + 0.5) / lookups - 0.5:
        x, y, z = point_mm + t * across_mm
        fine = sample(tile, np.array([z, y, x]) / 0.3)
        coarse = sample(tile, np.array([y, z, x]) / 1.13 + shift)
        found.append([np.concatenate(fine), np.concatenate(coarse)])
    return np.mean(found, axis=0)


def step(value):
    t = np.clip(value, 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)


def albedo(row, fine, coarse, mark):
    """B, G, R, factor of the highlight, share of blood."""
    colour, second, marked_colour = row[0:3], row[3:6], row[6:9]
    mix_at, slope, contrast_fine, contrast_coarse, pores = row[9:14]
    mark_noise, specular, _, marked_specular, blood_at = row[15:20]
    mixed = step((0.8 * coarse[0] + 0.6 * fine[1] - mix_at) * slope + 0.5)
    fray = mark_noise * (0.7 * coarse[1] + 0.5 * fine[1]) * 4.0 * mark * (1.0 - mark)
    marked = step((mark + fray - 0.25) * 2.0)
    texture = 1.0 + contrast_fine * fine[0] + contrast_coarse * coarse[0]
    texture = max(0.1, texture - pores * step((-1.2 - fine[0]) * 1.2))
    bloody = step((coarse[1] + 0.22 * fine[1] - blood_at) * 3.0 + 0.5)
    film = np.clip(bloody * (0.84 + 0.08 * fine[0]), 0.0, 1.0)
    ground = colour + mixed * (second - colour)
    ground = (ground + marked * (marked_colour - ground)) * texture
    blood = np.array([0.020, 0.022, 0.23])
    wet = (1.0 + marked * (marked_specular - 1.0)) * max(0.0, 1.0 + 0.45 * coarse[1])
    return np.concatenate([ground + film * (blood - ground), [specular * wet + film * 0.9, film]])


def light(lamps, normal, point, eye, wrap, shininess):
    """Diffuse and highlight sums; `lamps` (L, 4) unit directions and strengths."""
    view = (eye - point) / np.linalg.norm(eye - point)
    diffuse = highlight = 0.0
    for *direction, strength in lamps:
        cosine = normal @ direction
        diffuse += strength * max(0.0, (cosine + wrap) / (1.0 + wrap))
        half = direction + view
        t = normal @ half / np.linalg.norm(half)
        if cosine > 0.0 and t > 0.0:
            highlight += strength * (t / (shininess - shininess * t + t)) ** 2
    return diffuse, highlight


def pixel(look, material, lamps, point, eye, mark):
    """B, G, R at a point whose smooth normal is -z or +z, whichever faces the eye."""
    tile = look.tile.values
    row = look.materials[material].astype(float)
    fine, coarse = sample_surface(tile, point, np.zeros(3), 1)
    *colour, wet, film = albedo(row, fine, coarse, mark)
    tilt = row[14] * (1.0 - 0.6 * film) * fine[:1:-1]
    normal = np.array([0.0, 0.0, np.sign(eye[2])]) - tilt
    normal /= np.linalg.norm(normal)
    diffuse, highlight = light(lamps, normal, point, eye, row[20], row[17])
    return np.array(colour) * (diffuse + look.ambient) + highlight * wet
