"""Rigid transforms that know their two frames."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]

_ORTHOGONALITY_TOLERANCE = 1e-4
_EXACT = 1e-12
_LAST_ROW = (0.0, 0.0, 0.0, 1.0)


@dataclass(frozen=True, slots=True, eq=False)
class RigidTransform:
    """`target_from_source`: p_target = matrix @ p_source, lengths in mm.

    The rotation is re-orthonormalised at construction (repeated products of a drifting rotation
    lose a track within a second); a reflection, or anything further from a rotation than 1e-4, is
    refused.

    Raises:
        ValueError: not 4x4, not finite, not a rotation, a reflection.
    """

    target: str
    source: str
    matrix: FloatArray

    def __post_init__(self) -> None:
        matrix = np.array(self.matrix, dtype=np.float64)
        if matrix.shape != (4, 4) or not np.isfinite(matrix).all():
            raise ValueError(f"{self.name}: a rigid transform is a finite 4x4 matrix")
        rows = matrix.tolist()
        if max(abs(a - b) for a, b in zip(rows[3], _LAST_ROW, strict=True)) > 1e-9:
            raise ValueError(f"{self.name}: the last row must be 0 0 0 1")
        # A rotation that is one already keeps its bits, so that written poses read back the same.
        if not _is_rotation(rows):
            given = matrix[:3, :3]
            rotation = nearest_rotation(given)
            if np.abs(rotation - given).max() > _ORTHOGONALITY_TOLERANCE:
                kind = "a reflection" if np.linalg.det(given) < 0.0 else "not a rotation"
                raise ValueError(f"{self.name}: the 3x3 part is {kind}")
            matrix[:3, :3] = rotation
        matrix.setflags(write=False)
        object.__setattr__(self, "matrix", matrix)

    @classmethod
    def identity(cls, target: str, source: str) -> "RigidTransform":
        """The two frames coincide."""
        return cls(target, source, np.eye(4))

    @classmethod
    def from_parts(
        cls, target: str, source: str, rotation: ArrayLike, translation_mm: ArrayLike
    ) -> "RigidTransform":
        """From a (3, 3) rotation and a (3,) translation in mm."""
        matrix = np.eye(4)
        matrix[:3, :3] = rotation
        matrix[:3, 3] = np.asarray(translation_mm, dtype=np.float64).reshape(3)
        return cls(target, source, matrix)

    @classmethod
    def fit(
        cls, target: str, source: str, target_mm: FloatArray, source_mm: FloatArray
    ) -> "RigidTransform":
        """That moves points (N, 3) of the source nearest to those of the target, in least squares.

        Source: Arun 1987 (Kabsch 1976).
        """
        to_mm, from_mm = target_mm.mean(axis=0), source_mm.mean(axis=0)
        rotation = nearest_rotation((target_mm - to_mm).T @ (source_mm - from_mm))
        return cls.from_parts(target, source, rotation, to_mm - rotation @ from_mm)

    @property
    def name(self) -> str:
        """`target_from_source`, for messages."""
        return f"{self.target}_from_{self.source}"

    @property
    def rotation(self) -> FloatArray:
        """(3, 3) rotation."""
        return self.matrix[:3, :3]

    @property
    def translation_mm(self) -> FloatArray:
        """(3,) translation in mm, in the target frame."""
        return self.matrix[:3, 3]

    def inverse(self) -> "RigidTransform":
        """`source_from_target`."""
        rotation = self.rotation.T
        return RigidTransform.from_parts(
            self.source, self.target, rotation, -rotation @ self.translation_mm
        )

    def inverse_parts(self) -> tuple[FloatArray, FloatArray]:
        """(3, 3) rotation and (3,) translation in mm of the inverse, contiguous for kernels."""
        inverse = self.inverse()
        return np.array(inverse.rotation), np.array(inverse.translation_mm)

    def __matmul__(self, other: "RigidTransform") -> "RigidTransform":
        """Compose: `a_from_b @ b_from_c` is `a_from_c`; neighbours must be the same frame."""
        if not isinstance(other, RigidTransform):
            return NotImplemented
        if self.source != other.target:
            raise ValueError(f"cannot compose {self.name} with {other.name}: frames do not meet")
        return RigidTransform(self.target, other.source, self.matrix @ other.matrix)

    def apply(self, points_mm: ArrayLike) -> FloatArray:
        """Move points (N, 3) or one point (3,) from source to target."""
        return np.asarray(points_mm, dtype=np.float64) @ self.rotation.T + self.translation_mm

    def rotate(self, directions: ArrayLike) -> FloatArray:
        """Turn directions (N, 3) or (3,) from source to target."""
        return np.asarray(directions, dtype=np.float64) @ self.rotation.T

    def move(self, twist: ArrayLike, centre_mm: ArrayLike) -> "RigidTransform":
        """This pose after a small motion, left-multiplied, about a point of the target frame.

        Args:
            twist: (6,) translation in mm first, rotation vector in rad second.
            centre_mm: (3,) centre of the rotation, in the target frame.
        """
        values = np.asarray(twist, dtype=np.float64)
        centre = np.asarray(centre_mm, dtype=np.float64)
        rotation = rotation_from_vector(values[3:])
        moved = np.eye(4)
        moved[:3, :3] = rotation
        moved[:3, 3] = centre - rotation @ centre + values[:3]
        return RigidTransform(self.target, self.source, moved @ self.matrix)

    def twist_to(self, other: "RigidTransform", centre_mm: ArrayLike) -> FloatArray:
        """(6,) twist (mm, rad) that moves this pose to another, left, about a point of the source.

        Args:
            other: of the same frames.
            centre_mm: (3,) in the source frame.
        """
        shift = other.apply(centre_mm) - self.apply(centre_mm)
        return np.concatenate([shift, vector_from_rotation(other.rotation @ self.rotation.T)])

    def mean_motion_mm(self, other: "RigidTransform", points_mm: FloatArray) -> float:
        """Mean displacement of points (N, 3) of the source between this pose and another."""
        from navapp.geometry.motion_kernels import find_mean_motion

        turned, shifted_mm = (
            other.rotation - self.rotation, other.translation_mm - self.translation_mm
        )  # fmt: skip
        return float(find_mean_motion(turned, shifted_mm, np.ascontiguousarray(points_mm)))

    def rename(self, target: str, source: str) -> "RigidTransform":
        """The same motion under other frame names (a border between naming schemes)."""
        return RigidTransform(target, source, self.matrix)

    def to_list(self) -> list[list[float]]:
        """Row by row, for JSON."""
        rows: list[list[float]] = self.matrix.tolist()
        return rows


def _is_rotation(rows: list[list[float]]) -> bool:
    """Whether the first three of four rows are a rotation's, to the last digits."""
    # Plain numbers are sooner done with than arrays of nine.
    (a, b, c, _), (d, e, f, _), (g, h, i, _) = rows[:3]
    off = (
        a * a + d * d + g * g - 1.0, b * b + e * e + h * h - 1.0, c * c + f * f + i * i - 1.0,
        a * b + d * e + g * h, a * c + d * f + g * i, b * c + e * f + h * i,
    )  # fmt: skip
    turn = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
    return max(off) <= _EXACT and min(off) >= -_EXACT and turn > 0.0


def nearest_rotation(matrix: ArrayLike) -> FloatArray:
    """The rotation nearest to a (3, 3) matrix (Frobenius norm), never a reflection."""
    u, _, vt = np.linalg.svd(np.asarray(matrix, dtype=np.float64))
    signs = np.array([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])
    rotation: FloatArray = (u * signs) @ vt
    return rotation


def rotation_from_vector(rotation_vector_rad: ArrayLike) -> FloatArray:
    """(3, 3) rotation about the vector's direction by its length in rad (Rodrigues)."""
    vector = np.asarray(rotation_vector_rad, dtype=np.float64)
    angle = float(np.linalg.norm(vector))
    cross = skew(vector)
    if angle < 1e-8:
        small: FloatArray = np.eye(3) + cross + 0.5 * cross @ cross
        return small
    rotation: FloatArray = (
        np.eye(3)
        + np.sin(angle) / angle * cross
        + (1.0 - np.cos(angle)) / angle**2 * (cross @ cross)
    )
    return rotation


def vector_from_rotation(rotation: ArrayLike) -> FloatArray:
    """(3,) rotation vector in rad of a (3, 3) rotation; length in [0, pi]."""
    matrix = np.asarray(rotation, dtype=np.float64)
    axis = 0.5 * np.array(
        [matrix[2, 1] - matrix[1, 2], matrix[0, 2] - matrix[2, 0], matrix[1, 0] - matrix[0, 1]]
    )
    sine = float(np.linalg.norm(axis))
    cosine = 0.5 * (float(np.trace(matrix)) - 1.0)
    angle = float(np.arctan2(sine, cosine))
    if sine > 1e-6:
        vector: FloatArray = axis * (angle / sine)
        return vector
    if cosine > 0.0:
        return axis
    # Half a turn: the axis is the eigenvector of R to the eigenvalue 1.
    values, vectors = np.linalg.eigh(0.5 * (matrix + matrix.T))
    half_turn: FloatArray = vectors[:, int(np.argmax(values))] * angle
    # The eigenvector has no sign; just short of half a turn the rotation has one.
    return half_turn if half_turn @ axis >= 0.0 else -half_turn


def angle_between_rad(a: FloatArray, b: FloatArray) -> float:
    """Angle in rad, 0 to pi, of the turn from one (3, 3) rotation to another."""
    return float(np.linalg.norm(vector_from_rotation(a.T @ b)))


def rotation_angle_deg(a: RigidTransform, b: RigidTransform) -> float:
    """Angle in deg between the rotations of two poses of the same body."""
    return float(np.degrees(angle_between_rad(a.rotation, b.rotation)))


def twist_slopes(arms_mm: FloatArray) -> FloatArray:
    """(N, 3, 6) J = [I | -[a]x]: how places move with a twist about a centre.

    The places lie at arms a (N, 3) from it; the twist is a translation in mm, then a rotation
    vector in rad.
    """
    slopes = np.zeros((len(arms_mm), 3, 6))
    slopes[:, :, :3] = np.eye(3)
    x, y, z = arms_mm.T
    # -[a]x, row by row.
    slopes[:, 0, 4], slopes[:, 0, 5] = z, -y
    slopes[:, 1, 3], slopes[:, 1, 5] = -z, x
    slopes[:, 2, 3], slopes[:, 2, 4] = y, -x
    return slopes


def skew(vector: ArrayLike) -> FloatArray:
    """Cross-product matrix (3, 3): `skew(a) @ b` is a x b."""
    x, y, z = np.asarray(vector, dtype=np.float64)
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def read_only(array: Any, dtype: type = np.float64) -> NDArray[Any]:
    """A C-contiguous array of that type which cannot be written; copies only when it must."""
    result: NDArray[Any] = np.ascontiguousarray(array, dtype=dtype)
    if result is array and result.flags.writeable:
        result = result.copy()
    result.setflags(write=False)
    return result
