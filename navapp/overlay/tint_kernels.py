"""Compiled loops that tint a bone's pixels in the video."""

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def tint_pixels(
    image: NDArray[np.uint8],
    face_index: NDArray[np.int32],
    share_of_face: NDArray[np.float32],
    colour: tuple[int, int, int],
) -> None:
    """Blend a colour over the pixels where a mesh is seen.

    Args:
        image: (h, w, 3) in place.
        face_index: (h, w) triangle of the mesh, -1 where it is not seen.
        share_of_face: (F,) of the colour, 0 to 1.
        colour: of the image's channels.
    """
    for y in range(face_index.shape[0]):
        for x in range(face_index.shape[1]):
            face = face_index[y, x]
            if face >= 0:
                share = share_of_face[face]
                for k in range(3):
                    before = np.float32(image[y, x, k])
                    image[y, x, k] = np.uint8(before + share * (np.float32(colour[k]) - before))


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
