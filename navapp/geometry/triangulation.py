"""Points from their places in both pictures of a rig."""

from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import FloatArray


def triangulate_mm(rig: StereoRig, left_px: FloatArray, right_px: FloatArray) -> FloatArray:
    """(n, 3) points in the left camera's frame, half-way between both rays.

    Not finite where the rays are parallel; behind the cameras where they diverge.
    """
    a = rig.left.rays(left_px)
    b = rig.right_from_left.inverse().rotate(rig.right.rays(right_px))
    centre = rig.right_from_left.inverse().translation_mm
    aa, bb, ab = (a * a).sum(axis=1), (b * b).sum(axis=1), (a * b).sum(axis=1)
    ac, bc = a @ centre, b @ centre
    scale = aa * bb - ab**2
    s, t = (bb * ac - ab * bc) / scale, (ab * ac - aa * bc) / scale
    middle: FloatArray = 0.5 * (a * s[:, None] + b * t[:, None] + centre)
    return middle
