"""Bones of a plan: surface, cartilage, and what of them is an edge to the eye."""

from dataclasses import dataclass, field
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.directions import ViewCone
from navapp.geometry.mesh import TriangleMesh, vertex_normals
from navapp.geometry.transform import FloatArray, read_only
from navapp.values.faces import MeasuredFace

Side = Literal["left", "right"]
# Those that can be followed; the fibula only tells the side.
FollowedBone = Literal["femur", "tibia", "patella"]
FOLLOWED_BONES: tuple[str, ...] = get_args(FollowedBone)


@dataclass(frozen=True, slots=True, eq=False)
class BoneModel:
    """A bone as planned, in plan coordinates (LPS, mm).

    Raises:
        ValueError: not one value per vertex, or a cartilage or deviation that is negative or not
            finite.
    """

    name: str  # `femur`, `tibia`, `patella`
    mesh: TriangleMesh  # surface with outward normals
    side: Side | None = None  # of the patient; None when unknown
    # (V,) mean thickness of what the camera sees above the bone.
    cartilage_mm: FloatArray = field(default_factory=lambda: np.empty(0))
    # (V,) its standard deviation.
    cartilage_sd_mm: FloatArray = field(default_factory=lambda: np.empty(0))
    # (V,) what is not there to be seen: cut away by a stage, or by the end of a CT.
    is_removed: NDArray[np.bool_] = field(default_factory=lambda: np.empty(0, dtype=bool))
    version: int = 0  # counts the changes by stages
    # standard deviation of the pose error that errors of the surface cause; 0 when nothing is known
    # of them.
    surface_sd_mm: float = 0.0
    # what closes the bone where a stage has cut it; it hides what lies behind, but is not matched.
    lid: TriangleMesh | None = None
    # the sawn face that closes its mesh and by which it is tracked; None: by its surface.
    face: MeasuredFace | None = None

    def __post_init__(self) -> None:
        n = len(self.mesh.vertices_mm)
        if not (np.isfinite(self.surface_sd_mm) and self.surface_sd_mm >= 0.0):
            raise ValueError(f"{self.name}: surface_sd_mm must be finite and not negative")
        for name, kind in (
            ("cartilage_mm", float),
            ("cartilage_sd_mm", float),
            ("is_removed", bool),
        ):
            values = getattr(self, name)
            values = read_only(values if len(values) else np.zeros(n), kind)
            if values.shape != (n,):
                raise ValueError(f"{self.name}: {name} needs one value per vertex")
            if kind is float and not (np.isfinite(values) & (values >= 0.0)).all():
                raise ValueError(f"{self.name}: {name} must be finite and not negative")
            object.__setattr__(self, name, values)

    def make_seen_surface(self) -> TriangleMesh:
        """What a camera sees: moved out by the mean cartilage, without what a stage removed.

        Its normals lean where the cartilage grows thicker.
        """
        mesh = self.mesh
        points_mm = mesh.vertices_mm + self.cartilage_mm[:, None] * mesh.normals
        normals = np.array(mesh.normals)
        if self.cartilage_mm.any():
            seen = vertex_normals(points_mm, mesh.faces)
            has_faces = np.linalg.norm(seen, axis=1) > 0.0
            normals[has_faces] = seen[has_faces]
        is_left = ~self.is_removed[mesh.faces].any(axis=1)
        return TriangleMesh(points_mm, mesh.faces[is_left], normals)


@dataclass(frozen=True, slots=True, eq=False)
class AspectGraph:
    """A bone's edges from many sides: what a camera would see of its outline and creases.

    The points of a view are in an order in which the first n are spread evenly over it, for every
    n: a coarser level of the view is its first points.

    Raises:
        ValueError: shapes that do not belong together, or values that are not finite.
    """

    bone: str  # name of the bone
    directions: FloatArray  # (V, 3) unit, from the bone towards the camera, in bone coordinates
    starts: NDArray[np.int64]  # (V + 1,) int64; view k has the points starts[k] to starts[k + 1]
    points_mm: FloatArray  # (N, 3) on the edges, in bone coordinates
    tangents: FloatArray  # (N, 3) unit, along the edge

    def __post_init__(self) -> None:
        for name in ("directions", "points_mm", "tangents"):
            values = read_only(getattr(self, name))
            if values.ndim != 2 or values.shape[1] != 3 or not np.isfinite(values).all():
                raise ValueError(f"{name} of an aspect graph must be finite and of shape (N, 3)")
            object.__setattr__(self, name, values)
        starts = read_only(self.starts, np.int64)
        is_whole = starts.shape == (len(self.directions) + 1,) and starts[0] == 0
        if not is_whole or (np.diff(starts) < 0).any() or starts[-1] != len(self.points_mm):
            raise ValueError("starts of an aspect graph must divide its points among its views")
        if self.tangents.shape != self.points_mm.shape:
            raise ValueError("an aspect graph needs one tangent a point")
        object.__setattr__(self, "starts", starts)

    def __len__(self) -> int:
        return len(self.directions)

    def within(self, cone: ViewCone) -> "AspectGraph":
        """The views from inside a cone; the nearest one when none is."""
        away_deg = cone.off_axis_deg(self.directions)
        kept = np.flatnonzero(away_deg <= cone.half_angle_deg)
        if len(kept) == 0 and len(away_deg):
            kept = np.array([int(away_deg.argmin())])
        of_point = np.repeat(np.arange(len(self)), np.diff(self.starts))
        is_kept = np.isin(of_point, kept)
        sizes = np.diff(self.starts)[kept]
        return AspectGraph(
            self.bone,
            self.directions[kept],
            np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64),
            self.points_mm[is_kept],
            self.tangents[is_kept],
        )
