"""Distortion coefficients in OpenCV's order, as other programs store them."""

from navapp.errors import RigError
from navapp.geometry.camera import Camera
from navapp.geometry.transform import FloatArray


def pad_coefficients(camera: Camera, n_known: int, form: str) -> FloatArray:
    """The first coefficients of a lens, zeros included.

    Args:
        camera: whose lens it is.
        n_known: coefficients that the other program knows.
        form: name of its format, for the refusal.

    Raises:
        RigError: the lens has more.
    """
    found = camera.distortion
    if found[n_known:].any():
        raise RigError(
            f"{form} knows {n_known} coefficients of distortion, the rig's lenses have "
            f"{count_used(camera)}",
            subject=form,
            remedy="choose a format that can say it; OpenCV's can",
        )
    padded: FloatArray = found[:n_known].copy()
    padded.resize(n_known, refcheck=False)
    return padded


def count_used(camera: Camera) -> int:
    """Coefficients of a lens up to the last that is not 0."""
    used = camera.distortion.nonzero()[0]
    return int(used[-1]) + 1 if len(used) else 0
