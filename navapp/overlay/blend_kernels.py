"""Compiled loops that blend colours into pictures."""

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def tint_faces(
    image: NDArray[np.uint8],
    face_index: NDArray[np.int32],
    share_of_face: NDArray[np.float32],
    colour_of_face: NDArray[np.float32],
    weight: NDArray[np.float32],
) -> None:
    """Blend a colour for each triangle over the pixels where a mesh is seen.

    Args:
        image: (h, w, 3) in place.
        face_index: (h, w) triangle of the mesh, -1 where it is not seen.
        share_of_face: (F,) of the colour, 0 to 1.
        colour_of_face: (F, 3), or (1, 3) for all of them, of the image's channels.
        weight: (h, w) 0 to 1, of the share.
    """
    is_one = colour_of_face.shape[0] == 1
    for y in range(face_index.shape[0]):
        for x in range(face_index.shape[1]):
            face = face_index[y, x]
            if face < 0 or weight[y, x] <= 0.0:
                continue
            share = share_of_face[face] * weight[y, x]
            row = 0 if is_one else face
            for k in range(3):
                before = np.float32(image[y, x, k])
                after = before + share * (colour_of_face[row, k] - before)
                image[y, x, k] = np.uint8(after + np.float32(0.5))


@njit(cache=True, nogil=True)
def blend_colour(
    image: NDArray[np.uint8], share: NDArray[np.float32], colour: tuple[int, int, int]
) -> None:
    """Blend one colour into a picture.

    Args:
        image: (h, w, 3) in place.
        share: (h, w) of the colour, 0 to 1.
        colour: of the image's channels.
    """
    for y in range(share.shape[0]):
        for x in range(share.shape[1]):
            part = share[y, x]
            if part <= 0.0:
                continue
            for k in range(3):
                before = np.float32(image[y, x, k])
                after = before + part * (np.float32(colour[k]) - before)
                image[y, x, k] = np.uint8(after + np.float32(0.5))


@njit(cache=True, nogil=True)
def blend_outline(
    image: NDArray[np.uint8],
    soft: NDArray[np.uint8],
    weight: NDArray[np.float32],
    corner: tuple[int, int],
    stripe_px: int,
    beneath: float,
    colour: tuple[int, int, int],
) -> None:
    """Blend a line along the edge of a mask, in slanted stripes where it lies beneath something.

    Args:
        image: (h, w, 3) in place.
        soft: (h, w) the mask with a smooth edge, 0 to 255.
        weight: (h, w) 0 to 1: full on top; beneath something faint in every other stripe, and less
            towards what hides it.
        corner: column and row of the first pixel in the picture, for the stripes.
        stripe_px: their width.
        beneath: weight of what lies beneath.
        colour: of the image's channels.
    """
    for y in range(soft.shape[0]):
        for x in range(soft.shape[1]):
            if soft[y, x] == 0 or soft[y, x] == 255 or weight[y, x] <= 0.0:
                continue
            inside = np.float32(soft[y, x]) / np.float32(255.0)
            share = min(np.float32(5.0) * inside * (np.float32(1.0) - inside), np.float32(1.0))
            line = weight[y, x]
            if line <= np.float32(beneath):
                line = min(line / np.float32(beneath), np.float32(1.0))
                if ((corner[0] + x + corner[1] + y) // stripe_px) % 2 == 1:
                    line *= np.float32(0.25)
            for k in range(3):
                before = np.float32(image[y, x, k])
                after = before + share * line * (np.float32(colour[k]) - before)
                image[y, x, k] = np.uint8(after + np.float32(0.5))


@njit(cache=True, nogil=True)
def find_weights(
    bone_mm: NDArray[np.float32],
    half_depth_mm: NDArray[np.float32],
    half_is_guess: NDArray[np.uint8],
    parity: tuple[int, int],
    in_front: NDArray[np.uint8],
    tissue_mm: float,
    aside_mm: float,
    beneath: float,
    guess: float,
    weight: NDArray[np.float32],
    nearest_mm: NDArray[np.float32],
    is_hidden: NDArray[np.bool_],
) -> None:
    """How strongly a guide on the bone's surface is drawn in each pixel, and what is nearest.

    Args:
        bone_mm: (h, w) depth of the bone, NaN beside it.
        half_depth_mm: (h', w') of what is seen, of every second pixel; NaN where unknown.
        half_is_guess: (h', w') 1 where nothing was matched.
        parity: column and row, 0 or 1, of the first pixel inside the first of those.
        in_front: (h, w) 0 to 255, how much of the pixel hides the bone.
        tissue_mm: what is nearer than the bone by more lies on it.
        aside_mm: beside the bone, what is nearer than this depth hides guides.
        beneath: weight of what lies beneath something.
        guess: weight where that is not known.
        weight: (h, w) in place, 0 (hidden) to 1 (on top).
        nearest_mm: (h, w) in place, depth of bone or what was matched before it; NaN where unknown.
        is_hidden: (h, w) in place, something stands in front of most of the pixel, or it is not
            known and guides there are not drawn.
    """
    (height, width), left = bone_mm.shape, parity[0]
    depth_mm = np.empty(2 * half_depth_mm.shape[1], dtype=np.float32)
    is_guess = np.empty(2 * half_depth_mm.shape[1], dtype=np.uint8)
    for y in range(height):
        if y == 0 or (y + parity[1]) % 2 == 0:
            _widen(half_depth_mm[(y + parity[1]) // 2], depth_mm)
            _widen(half_is_guess[(y + parity[1]) // 2], is_guess)
        depths_mm, guesses = depth_mm[left : left + width], is_guess[left : left + width]
        _weigh_row(
            bone_mm[y], depths_mm, guesses, in_front[y], np.float32(tissue_mm),
            np.float32(aside_mm), np.float32(beneath), np.float32(guess), weight[y], is_hidden[y],
        )  # fmt: skip
        _find_nearest_of_row(bone_mm[y], depths_mm, guesses, nearest_mm[y])


@njit(cache=True, nogil=True)
def _widen(half: NDArray[Any], whole: NDArray[Any]) -> None:
    """Each number twice."""
    for k in range(len(half)):
        whole[2 * k] = whole[2 * k + 1] = half[k]


# Rows without branches, which the compiler turns into vector code. A comparison with an unknown
# depth is False.


@njit(cache=True, nogil=True)
def _weigh_row(
    bone_mm: NDArray[np.float32],
    depth_mm: NDArray[np.float32],
    is_guess: NDArray[np.uint8],
    in_front: NDArray[np.uint8],
    tissue_mm: np.float32,
    aside_mm: np.float32,
    beneath: np.float32,
    guess: np.float32,
    weight: NDArray[np.float32],
    is_hidden: NDArray[np.bool_],
) -> None:
    is_guess_unlit = guess <= np.float32(0.0)
    for x in range(len(bone_mm)):
        is_known, is_aside = is_guess[x] == 0, np.isnan(bone_mm[x]) & (depth_mm[x] < aside_mm)
        seen = np.float32(255 - in_front[x]) / np.float32(255.0)
        seen = np.float32(0.0) if is_aside else seen
        share = beneath if depth_mm[x] < bone_mm[x] - tissue_mm else np.float32(1.0)
        weight[x] = seen * (share if is_known else guess)
        # Where guides on a guess are unlit, it hides them.
        is_hidden[x] = (seen < np.float32(0.5)) | ((not is_known) & is_guess_unlit)


@njit(cache=True, nogil=True)
def _find_nearest_of_row(
    bone_mm: NDArray[np.float32],
    depth_mm: NDArray[np.float32],
    is_guess: NDArray[np.uint8],
    nearest_mm: NDArray[np.float32],
) -> None:
    for x in range(len(bone_mm)):
        is_nearer = (not depth_mm[x] > bone_mm[x]) & (not np.isnan(depth_mm[x]))
        nearest_mm[x] = depth_mm[x] if is_nearer & (is_guess[x] == 0) else bone_mm[x]


@njit(cache=True, nogil=True)
def mark_dots(
    pixels: NDArray[np.float64],
    depth_mm: NDArray[np.float64],
    bone_mm: NDArray[np.float32],
    weight: NDArray[np.float32],
    skin_mm: float,
    share: NDArray[np.float32],
) -> tuple[int, int]:
    """Mark five pixels for each point that the bone does not hide; the rows that hold them.

    Args:
        pixels: (N, 2) of the points, NaN where they are not seen.
        depth_mm: (N,).
        bone_mm: (h, w) depth of the bone, NaN beside it.
        weight: (h, w) 0 to 1.
        skin_mm: a point further behind the bone's surface is hidden.
        share: (h, w) in place, 0 before: the weight at the point.
    """
    height, width = share.shape
    first, last = height, 0
    for k in range(len(pixels)):
        # A comparison with NaN is False.
        if not (0.5 <= pixels[k, 0] < width - 1.5 and 0.5 <= pixels[k, 1] < height - 1.5):
            continue
        u, v = int(np.floor(pixels[k, 0] + 0.5)), int(np.floor(pixels[k, 1] + 0.5))
        if depth_mm[k] > bone_mm[v, u] + skin_mm:
            continue
        share[v, u - 1 : u + 2] = weight[v, u]
        share[v - 1, u] = share[v + 1, u] = weight[v, u]
        first, last = min(first, v - 1), max(last, v + 2)
    return first, max(first, last)


@njit(cache=True, nogil=True)
def lay_over(
    share: NDArray[np.float32],
    colour: NDArray[np.float32],
    over_share: NDArray[np.float32],
    over_colour: NDArray[np.float32],
) -> None:
    """Join two colours of each triangle to one that blends as both do, one after the other.

    Args:
        share: (F,) in place, of the colour below.
        colour: (F, 3) in place.
        over_share: (F,) of the colour above.
        over_colour: (F, 3), or (1, 3) for all of them.
    """
    is_one = over_colour.shape[0] == 1
    for face in range(len(share)):
        above = over_share[face]
        if above <= 0.0:
            continue
        row = 0 if is_one else face
        both = above + share[face] * (np.float32(1.0) - above)
        for k in range(3):
            colour[face, k] += above / both * (over_colour[row, k] - colour[face, k])
        share[face] = both


@njit(cache=True, nogil=True)
def compute_face_tints(
    normals: NDArray[np.float64],
    faces: NDArray[np.int32],
    towards: NDArray[np.float64],
    least: float,
    steep: float,
) -> NDArray[np.float32]:
    """(F,) of a colour, 0 to 1: more where a triangle does not face the camera.

    Args:
        normals: (V, 3) unit.
        faces: (F, 3) their triangles.
        towards: (3,) unit, the camera's axis in the same frame.
        least: of what faces the camera.
        steep: how much more of what does not.
    """
    facing = np.empty(normals.shape[0])
    for v in range(len(facing)):
        along = normals[v, 0] * towards[0] + normals[v, 1] * towards[1] + normals[v, 2] * towards[2]
        facing[v] = abs(along)
    shares = np.empty(faces.shape[0], dtype=np.float32)
    for f in range(len(shares)):
        mean = (facing[faces[f, 0]] + facing[faces[f, 1]] + facing[faces[f, 2]]) / 3.0
        shares[f] = least + steep * (1.0 - min(mean, 1.0))
    return shares
