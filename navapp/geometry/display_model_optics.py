"""The parts of a display in a mirror: the panel as it is seen, and the glass before the site."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from navapp.geometry.transform import FloatArray, read_only, rotation_from_vector

_UNIT = 1e-6
# The displacement hardly depends on the angle: each turn gains more than two digits.
N_TURNS = 4


@dataclass(frozen=True, slots=True, eq=False)
class VirtualScreen:
    """The panel as it is seen in the mirror, in the left camera's frame.

    The picture is the one that is handed to the display's backend. Whether `across` and `down` are
    seen mirrored is in their directions and nowhere else.

    Raises:
        ValueError: axes that are not unit and orthogonal, no size.
    """

    origin_mm: FloatArray  # (3,) centre of the picture's pixel (0, 0) on the panel without bulge
    # across, down: (3,) unit directions in which columns and rows rise.
    across: FloatArray
    down: FloatArray
    pitch_mm: float  # of neighbouring pixels' centres
    # width_px, height_px: of the picture.
    width_px: int
    height_px: int
    # by how much the middle stands out against the corners, along across x down; a paraboloid.
    bulge_mm: float = 0.0
    axes: FloatArray = field(init=False)  # (3, 3) rows across, down, across x down

    def __post_init__(self) -> None:
        for name in ("origin_mm", "across", "down"):
            values = read_only(np.asarray(getattr(self, name), dtype=np.float64).reshape(-1))
            if values.shape != (3,) or not np.isfinite(values).all():
                raise ValueError(f"{name} of a screen is three finite numbers")
            object.__setattr__(self, name, values)
        a, d = self.across.tolist(), self.down.tolist()
        off = (_dot(a, a) - 1.0, _dot(d, d) - 1.0, _dot(a, d))
        if max(off) > _UNIT or min(off) < -_UNIT:
            raise ValueError("across and down of a screen are orthogonal unit directions")
        if not (self.pitch_mm > 0.0 and np.isfinite([self.pitch_mm, self.bulge_mm]).all()):
            raise ValueError("the pitch of a screen is a positive length, its bulge a finite one")
        if self.width_px <= 0 or self.height_px <= 0:
            raise ValueError("a screen has at least one column and one row")
        # Plain numbers are sooner done with than arrays of three.
        normal = [a[1] * d[2] - a[2] * d[1], a[2] * d[0] - a[0] * d[2], a[0] * d[1] - a[1] * d[0]]
        object.__setattr__(self, "axes", read_only(np.array([a, d, normal])))

    @property
    def normal(self) -> FloatArray:
        """(3,) across x down: towards the eye when the picture is seen mirrored, else away."""
        normal: FloatArray = self.axes[2]
        return normal

    @property
    def half_mm(self) -> FloatArray:
        """(2,) from pixel (0, 0) to the middle, along across and down."""
        return 0.5 * self.pitch_mm * np.array([self.width_px - 1.0, self.height_px - 1.0])

    @property
    def middle_mm(self) -> FloatArray:
        """(3,) middle of the panel without bulge."""
        middle: FloatArray = self.origin_mm + self.half_mm @ self.axes[:2]
        return middle

    def points_mm(self, pixels: ArrayLike) -> FloatArray:
        """(N, 3) where pixels (N, 2) are seen."""
        flat = self.pitch_mm * np.asarray(pixels, dtype=np.float64).reshape(-1, 2)
        points: FloatArray = self.origin_mm + flat @ self.axes[:2]
        if self.bulge_mm == 0.0:
            return points
        share = ((flat - self.half_mm) ** 2).sum(axis=1) / (self.half_mm**2).sum()
        points += (self.bulge_mm * (1.0 - share))[:, None] * self.normal
        return points

    def move(self, turn_rad: ArrayLike, shift_mm: ArrayLike) -> "VirtualScreen":
        """Turned by a rotation vector (3,) about its middle, then shifted by (3,)."""
        rotation = rotation_from_vector(turn_rad)
        middle = self.middle_mm
        return VirtualScreen(
            middle + rotation @ (self.origin_mm - middle) + np.asarray(shift_mm),
            rotation @ self.across,
            rotation @ self.down,
            self.pitch_mm,
            self.width_px,
            self.height_px,
            self.bulge_mm,
        )

    def resize(self, pitch_mm: float, bulge_mm: float) -> "VirtualScreen":
        """The same middle and directions with another pitch and bulge."""
        half = 0.5 * pitch_mm * np.array([self.width_px - 1.0, self.height_px - 1.0])
        return VirtualScreen(
            self.middle_mm - half @ self.axes[:2], self.across, self.down, pitch_mm,
            self.width_px, self.height_px, bulge_mm,
        )  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False)
class Glass:
    """The plate of the mirror: the eye sees the site through it, the screen by its front face.

    Raises:
        ValueError: no unit normal, a negative thickness, an index below 1.
    """

    thickness_mm: float
    normal: FloatArray  # (3,) unit, of the faces, from the eye's side to the site's
    refractive_index: float = 1.52  # of crown and float glass

    def __post_init__(self) -> None:
        normal = read_only(np.asarray(self.normal, dtype=np.float64).reshape(-1))
        if normal.shape != (3,) or not abs(float(np.linalg.norm(normal)) - 1.0) < _UNIT:
            raise ValueError("the normal of a plate is a unit direction")
        if not (np.isfinite(self.thickness_mm) and self.thickness_mm >= 0.0):
            raise ValueError("the thickness of a plate is not negative")
        if not 1.0 <= self.refractive_index < 10.0:
            raise ValueError("the refractive index of a plate is at least 1")
        object.__setattr__(self, "normal", normal)

    def displacements_mm(self, directions: FloatArray) -> FloatArray:
        """(N,) by how much rays along (N, 3) go on displaced along the normal.

        t (1 - cos a / sqrt(n^2 - sin^2 a)) for an angle a between ray and normal.
        """
        lengths = np.sqrt((directions * directions).sum(axis=-1))
        cosine = np.abs(directions @ self.normal) / np.maximum(lengths, 1e-12)
        below = np.sqrt(self.refractive_index**2 - 1.0 + cosine**2)
        displacements: FloatArray = self.thickness_mm * (1.0 - cosine / below)
        return displacements

    def apparent_mm(self, points_mm: FloatArray, eye_mm: FloatArray) -> FloatArray:
        """(N, 3) where an eye at (3,) or (N, 3) sees points (N, 3) behind the plate."""
        apparent = points_mm
        for _ in range(N_TURNS):
            shift = self.displacements_mm(apparent - eye_mm)
            apparent = points_mm - shift[..., None] * self.normal
        return apparent


def _dot(a: list[float], b: list[float]) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
