"""Compiled veil over a bone."""

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
