"""Implicit solids: functions of points (N, 3) in mm, negative inside, growing by about 1 per mm.

A bone is a smooth union of a few of these. Every solid is a callable, so that meshing, the CT and
the landmarks share one definition of where the surface is. Values are distances up to a factor
between about 0.7 and 1.4 near the surface, exact distances only where a docstring says so.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from navapp.geometry.transform import FloatArray

Field = Callable[[FloatArray], FloatArray]


def smooth_min(a: FloatArray, b: FloatArray, blend_mm: float) -> FloatArray:
    """Minimum with a parabolic fillet where both differ by less than `blend_mm`."""
    overlap = np.maximum(blend_mm - np.abs(a - b), 0.0)
    result: FloatArray = np.minimum(a, b) - overlap * overlap / (4.0 * blend_mm)
    return result


def smooth_max(a: FloatArray, b: FloatArray, blend_mm: float) -> FloatArray:
    """Maximum with a parabolic rounding where both differ by less than `blend_mm`."""
    return -smooth_min(-a, -b, blend_mm)


@dataclass(frozen=True, slots=True, eq=False)
class Union:
    """Solids merged one after the other, each with its own fillet."""

    first: Field
    others: tuple[tuple[Field, float], ...]

    def __call__(self, points: FloatArray) -> FloatArray:
        """Values (N,) at points (N, 3)."""
        value = self.first(points)
        for field, blend_mm in self.others:
            value = smooth_min(value, field(points), blend_mm)
        return value


@dataclass(frozen=True, slots=True, eq=False)
class Intersection:
    """What lies inside both solids, the common edge rounded."""

    a: Field
    b: Field
    blend_mm: float

    def __call__(self, points: FloatArray) -> FloatArray:
        """Values (N,) at points (N, 3)."""
        return smooth_max(self.a(points), self.b(points), self.blend_mm)


@dataclass(frozen=True, slots=True, eq=False)
class Difference:
    """The first solid without the second, the common edge rounded."""

    a: Field
    b: Field
    blend_mm: float

    def __call__(self, points: FloatArray) -> FloatArray:
        """Values (N,) at points (N, 3)."""
        return smooth_max(self.a(points), -self.b(points), self.blend_mm)


@dataclass(frozen=True, slots=True, eq=False)
class Scaled:
    """A solid stretched along the axes about the origin, then moved; a negative scale mirrors."""

    field: Field
    scale: FloatArray
    offset_mm: FloatArray

    def __call__(self, points: FloatArray) -> FloatArray:
        """Values (N,) at points (N, 3)."""
        mean_scale = float(np.cbrt(np.abs(np.prod(self.scale))))
        return self.field((points - self.offset_mm) / self.scale) * mean_scale


@dataclass(frozen=True, slots=True, eq=False)
class Rough:
    """A solid whose surface is moved outwards by the relief function (mm)."""

    field: Field
    relief_mm: Field

    def __call__(self, points: FloatArray) -> FloatArray:
        """Values (N,) at points (N, 3)."""
        return self.field(points) - self.relief_mm(points)


@dataclass(frozen=True, slots=True, eq=False)
class Ellipsoid:
    """Ellipsoid along the axes; the value is the first-order distance."""

    centre_mm: tuple[float, float, float]
    radii_mm: tuple[float, float, float]

    def __call__(self, points: FloatArray) -> FloatArray:
        """Values (N,) at points (N, 3)."""
        scaled = (points - np.asarray(self.centre_mm)) / np.asarray(self.radii_mm)
        level = np.sqrt(np.einsum("ij,ij->i", scaled, scaled))
        scaled /= np.asarray(self.radii_mm)
        slope = np.sqrt(np.einsum("ij,ij->i", scaled, scaled))
        value: FloatArray = level * (level - 1.0) / np.maximum(slope, 1e-6)
        return np.where(slope < 1e-6, -min(self.radii_mm), value)


def compute_cone_distance(points: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
    """Exact distance to the hull of two balls (or discs), given as centre and radius.

    The nearest ball of the family between the two is where the derivative of
    |p - c(s)| - r(s) vanishes; s is clamped to the segment.

    Args:
        points: (N, D).
        start: (D + 1,) centre and radius.
        end: (D + 1,) centre and radius.
    """
    axis = end[:-1] - start[:-1]
    length = float(np.linalg.norm(axis))
    axis = axis / length
    growth = float(end[-1] - start[-1]) / length
    relative = points - start[:-1]
    along = relative @ axis
    across = np.sqrt(np.maximum(np.einsum("ij,ij->i", relative, relative) - along * along, 1e-18))
    s = np.clip(along + growth * across / np.sqrt(1.0 - growth * growth), 0.0, length)
    value: FloatArray = np.hypot(along - s, across) - (start[-1] + growth * s)
    return value


@dataclass(frozen=True, slots=True, eq=False)
class Cone:
    """Hull of two balls: a capsule whose radius changes; an exact distance."""

    start: tuple[float, float, float, float]
    end: tuple[float, float, float, float]

    def __call__(self, points: FloatArray) -> FloatArray:
        """Values (N,) at points (N, 3)."""
        return compute_cone_distance(points, np.asarray(self.start), np.asarray(self.end))


@dataclass(frozen=True, slots=True, eq=False)
class Roller:
    """A thick disc with rounded shoulders, its outline a chain of discs in the y-z plane."""

    discs: FloatArray  # (K, 3) y, z, radius of the outline's discs
    centre_x_mm: float  # x of the middle plane at y = 0
    shear: float  # change of that x per mm of y (condyles diverge towards the back)
    half_width_mm: float  # half the thickness along x
    shoulder_mm: float  # radius of the rounding between tread and side
    crown_per_mm: float  # curvature of the tread across its width

    def outline(self, points: FloatArray) -> FloatArray:
        """Distance to the outline in the y-z plane."""
        flat = points[:, 1:]
        value = compute_cone_distance(flat, self.discs[0], self.discs[1])
        for start, end in zip(self.discs[1:-1], self.discs[2:], strict=True):
            value = smooth_min(value, compute_cone_distance(flat, start, end), 4.0)
        return value

    def across(self, points: FloatArray) -> FloatArray:
        """Signed distance from the middle plane, along x."""
        result: FloatArray = points[:, 0] - self.centre_x_mm - self.shear * points[:, 1]
        return result

    def __call__(self, points: FloatArray) -> FloatArray:
        """Values (N,) at points (N, 3)."""
        x = self.across(points)
        tread = self.outline(points) + 0.5 * self.crown_per_mm * x * x + self.shoulder_mm
        side = np.abs(x) - self.half_width_mm + self.shoulder_mm
        outside = np.hypot(np.maximum(tread, 0.0), np.maximum(side, 0.0))
        value: FloatArray = np.minimum(np.maximum(tread, side), 0.0) + outside - self.shoulder_mm
        return value


@dataclass(frozen=True, slots=True, eq=False)
class Loft:
    """An endless column along z whose section is made of four quarter superellipses."""

    z_mm: FloatArray  # (K,) increasing heights of the table
    table: FloatArray  # (6, K) centre x, centre y, radius to -x, +x, -y, +y at those heights
    exponent: float  # 2 for ellipses, more for squarer sections
    twist_rad_per_mm: float = 0.0  # rotation of the section about z per mm of height

    def __call__(self, points: FloatArray) -> FloatArray:
        """Values (N,) at points (N, 3)."""
        z = points[:, 2]
        cx, cy, left, right, front, back = (np.interp(z, self.z_mm, row) for row in self.table)
        x, y = points[:, 0] - cx, points[:, 1] - cy
        if self.twist_rad_per_mm:
            cosine, sine = np.cos(self.twist_rad_per_mm * z), np.sin(self.twist_rad_per_mm * z)
            x, y = cosine * x + sine * y, cosine * y - sine * x
        a, b = np.where(x < 0.0, left, right), np.where(y < 0.0, front, back)
        u, v = np.abs(x) / a + 1e-9, np.abs(y) / b + 1e-9
        n = self.exponent
        u_slope, v_slope = u ** (n - 1.0), v ** (n - 1.0)
        level = (u * u_slope + v * v_slope) ** (1.0 / n)
        slope = np.hypot(u_slope / a, v_slope / b) * level ** (1.0 - n)
        value: FloatArray = (level - 1.0) / slope
        return value


def make_loft(rows: list[list[float]], exponent: float, twist_rad_per_mm: float = 0.0) -> Loft:
    """A loft through rows of z and the six values of `Loft.table`, monotone cubic between them."""
    from scipy.interpolate import PchipInterpolator

    knots = np.asarray(sorted(rows))
    z_mm = np.linspace(knots[0, 0], knots[-1, 0], 2 * int(np.ptp(knots[:, 0])) + 2)
    table = PchipInterpolator(knots[:, 0], knots[:, 1:])(z_mm).T
    return Loft(z_mm, np.ascontiguousarray(table), exponent, twist_rad_per_mm)


@dataclass(frozen=True, slots=True, eq=False)
class Below:
    """The half space where one coordinate is below a function of the two others."""

    height_mm: Field  # maps (N, 3) points to the limit; must not use the limited coordinate
    axis: int  # 0, 1 or 2, the coordinate that is limited
    upwards: bool = True  # False for the half space above the limit instead

    def __call__(self, points: FloatArray) -> FloatArray:
        """Values (N,) at points (N, 3)."""
        height = self.height_mm(points)
        steepness = np.ones(len(points))
        for other in range(3):
            if other != self.axis:
                moved = points.copy()
                moved[:, other] += 0.05
                steepness += ((self.height_mm(moved) - height) / 0.05) ** 2
        value: FloatArray = (points[:, self.axis] - height) / np.sqrt(steepness)
        return value if self.upwards else -value


def compute_gradient(field: Field, points: FloatArray, step_mm: float = 0.01) -> FloatArray:
    """(N, 3) gradient by central differences; pointing outwards near the surface."""
    n = len(points)
    offsets = np.concatenate([np.eye(3), -np.eye(3)]) * step_mm
    values = field((points[None] + offsets[:, None]).reshape(-1, 3)).reshape(6, n)
    result: FloatArray = np.ascontiguousarray((values[:3] - values[3:]).T) / (2.0 * step_mm)
    return result


def project(field: Field, points: FloatArray, iterations: int = 6) -> FloatArray:
    """(N, 3) points moved onto the surface by damped Newton steps of at most 2 mm."""
    moved = np.array(points, dtype=np.float64)
    for _ in range(iterations):
        slope = compute_gradient(field, moved)
        squared = np.maximum(np.einsum("ij,ij->i", slope, slope), 0.05)
        step = field(moved) / squared
        moved -= np.clip(step, -2.0, 2.0)[:, None] * slope
    return moved
