"""Which part of a picture the screen shows, and which point of it lies where."""

from navapp.geometry.box import Box
from navapp.overlay.fitting import fit_size

# What lies around a bone is shown with it, as a part of its size.
_MARGIN = 0.2
# A part of the picture that is shown is at least so wide.
_LEAST_SHARE = 0.25
# The shown part stays while the bone lies in it and it is not so much wider than needed.
_MOST_EXCESS = 1.5


def find_point(
    shape: tuple[int, ...], room: tuple[int, int], at: tuple[float, float]
) -> tuple[float, float]:
    """Which point of a picture is seen at a place of its canvas: parts of its width and height.

    Args:
        shape: (h, w) of the picture.
        room: width and height of the canvas.
        at: column and row in it; beside the picture the nearest point of its edge is told.
    """
    size = fit_size(shape, *room)
    across, down = (
        (place - (whole - own) // 2) / own for place, whole, own in zip(at, room, size, strict=True)
    )
    return min(max(across, 0.0), 1.0), min(max(down, 0.0), 1.0)


def choose_part(
    bone: Box, size_px: tuple[int, int], aspect: float, previous: Box | None = None
) -> Box:
    """The part of a picture around a bone.

    Args:
        bone: where it lies in the picture.
        size_px: width and height of the picture.
        aspect: width over height of the room on the screen.
        previous: part that was shown before; it stays while it fits.
    """
    width = max(bone.width * (1 + 2 * _MARGIN), bone.height * (1 + 2 * _MARGIN) * aspect)
    width = max(width, _LEAST_SHARE * size_px[0])
    size = round(min(width, size_px[0])), round(min(width / aspect, size_px[1]))
    if (
        previous is not None
        and previous.intersect(bone) == bone
        and previous.width <= _MOST_EXCESS * size[0]
        and abs(previous.width / previous.height - size[0] / size[1]) < 0.1
    ):
        return previous
    x, y = (
        min(max(round(at + 0.5 * extent - 0.5 * own), 0), most - own)
        for at, extent, own, most in (
            (bone.x, bone.width, size[0], size_px[0]),
            (bone.y, bone.height, size[1], size_px[1]),
        )
    )
    return Box(x, y, *size)
