"""Compiled loops that blend colours into pictures."""

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
def find_weights(
    bone_mm: NDArray[np.float32],
    depth_mm: NDArray[np.float32],
    is_guess: NDArray[np.bool_],
    in_front: NDArray[np.float32],
    tissue_mm: float,
    aside_mm: float,
    beneath: float,
    guess: float,
    weight: NDArray[np.float32],
) -> None:
    """How strongly a guide on the bone's surface is drawn in each pixel.

    Args:
        bone_mm: (h, w) depth of the bone, NaN beside it.
        depth_mm: (h, w) of what is seen, NaN where unknown.
        is_guess: (h, w) nothing was matched there.
        in_front: (h, w) 0 to 1, share of the pixel that hides the bone.
        tissue_mm: what is nearer than the bone by more lies on it.
        aside_mm: beside the bone, what is nearer than this depth hides guides.
        beneath: weight of what lies beneath something.
        guess: weight where that is not known.
        weight: (h, w) in place, 0 (hidden) to 1 (on top).
    """
    for y in range(bone_mm.shape[0]):
        for x in range(bone_mm.shape[1]):
            seen = np.float32(1.0) - in_front[y, x]
            bone, depth = bone_mm[y, x], depth_mm[y, x]
            if np.isnan(bone):
                # A comparison with an unknown depth is False.
                is_beneath = False
                if depth < aside_mm:
                    seen = np.float32(0.0)
            else:
                is_beneath = depth < bone - tissue_mm
            if is_guess[y, x]:
                weight[y, x] = seen * np.float32(guess)
            else:
                weight[y, x] = seen * np.float32(beneath) if is_beneath else seen


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
