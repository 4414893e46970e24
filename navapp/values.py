"""What flows between the steps of the line: plain values, no behaviour beyond small derivations.

Lengths are mm; a pose is `left_from_<bone>`: the left camera before rectification, OpenCV axes.
"""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import Enum, IntEnum
from types import MappingProxyType
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import FloatArray, RigidTransform, read_only

Side = Literal["left", "right"]


class Origin(IntEnum):
    """Where a disparity comes from."""

    UNKNOWN = 0
    MATCHED = 1
    FILLED_BORDER = 2
    FILLED_INTERIOR = 3
    MISMATCH_FILLED = 4


@dataclass(frozen=True, slots=True, eq=False)
class DisparityMap:
    """Disparity of the rectified left view inside a box.

    Attributes:
        disparity_px: (h, w) float32, NaN where unknown.
        sigma_px: (h, w) float32 standard deviation, NaN where unknown.
        origin: (h, w) uint8 of `Origin`.
        x, y: place of the box's first pixel in the rectified picture.
    """

    disparity_px: NDArray[np.float32]
    sigma_px: NDArray[np.float32]
    origin: NDArray[np.uint8]
    x: int
    y: int

    @property
    def matched_share(self) -> float:
        """Share of pixels with a measured disparity."""
        return float((self.origin == Origin.MATCHED).mean()) if self.origin.size else 0.0

    def only(self, stays: NDArray[np.bool_]) -> "DisparityMap":
        """The map, unknown beside a mask (h, w)."""
        unknown = np.float32(np.nan)
        return DisparityMap(
            np.where(stays, self.disparity_px, unknown),
            np.where(stays, self.sigma_px, unknown),
            np.where(stays, self.origin, np.uint8(Origin.UNKNOWN)),
            self.x,
            self.y,
        )


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceCloud:
    """Points seen by the stereo camera, in the rectified left camera.

    Attributes:
        points_mm: (N, 3).
        sigma_ray_mm: (N,) standard deviation along the ray through the point.
        pixels: (N, 2) int32 column and row in the rectified left view.
        origin: (N,) uint8 of `Origin`.
        stride_px: distance of neighbouring points in the picture.
    """

    points_mm: FloatArray
    sigma_ray_mm: FloatArray
    pixels: NDArray[np.int32]
    origin: NDArray[np.uint8]
    stride_px: int = 1

    def __len__(self) -> int:
        return len(self.points_mm)

    def selected(self, mask: NDArray[np.bool_] | NDArray[np.intp]) -> "SurfaceCloud":
        """A part of the cloud; points are taken to be spread evenly over it."""
        n_kept = int(mask.sum()) if mask.dtype == np.bool_ else len(mask)
        thinning = (len(self) / n_kept) ** 0.5 if n_kept else 1.0
        return SurfaceCloud(
            self.points_mm[mask],
            self.sigma_ray_mm[mask],
            self.pixels[mask],
            self.origin[mask],
            max(1, round(self.stride_px * thinning)),
        )


@dataclass(frozen=True, slots=True, eq=False)
class BoneModel:
    """A bone as planned, in plan coordinates (LPS, mm).

    Attributes:
        name: `femur`, `tibia`, `patella`.
        mesh: surface with outward normals.
        side: of the patient; None when unknown.
        cartilage_mm: (V,) mean thickness of what the camera sees above the bone.
        cartilage_sd_mm: (V,) its standard deviation.
        is_removed: (V,) parts that a stage has cut away.
        version: counts the changes by stages.

    Raises:
        ValueError: not one value per vertex, or cartilage that is negative or not finite.
    """

    name: str
    mesh: TriangleMesh
    side: Side | None = None
    cartilage_mm: FloatArray = field(default_factory=lambda: np.empty(0))
    cartilage_sd_mm: FloatArray = field(default_factory=lambda: np.empty(0))
    is_removed: NDArray[np.bool_] = field(default_factory=lambda: np.empty(0, dtype=bool))
    version: int = 0

    def __post_init__(self) -> None:
        n = len(self.mesh.vertices_mm)
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


@dataclass(frozen=True, slots=True, eq=False)
class AspectGraph:
    """A bone's edges from many sides: what a camera would see of its outline and creases.

    The points of a view are in an order in which the first n are spread evenly over it, for every
    n: a coarser level of the view is its first points.

    Attributes:
        bone: name of the bone.
        directions: (V, 3) unit, from the bone towards the camera, in bone coordinates.
        starts: (V + 1,) int64; view k has the points starts[k] to starts[k + 1].
        points_mm: (N, 3) on the edges, in bone coordinates.
        tangents: (N, 3) unit, along the edge.

    Raises:
        ValueError: shapes that do not belong together, or values that are not finite.
    """

    bone: str
    directions: FloatArray
    starts: NDArray[np.int64]
    points_mm: FloatArray
    tangents: FloatArray

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


class Reason(Enum):
    """Why a pose is not good, or why nothing is shown. The value is the phrase for people."""

    # of the judge
    NO_SURFACE = "no surface was measured where the bone should be"
    TOO_FEW_POINTS = "too few points on the bone"
    COVERAGE_LOW = "too little of the bone is seen"
    SEEN_THROUGH = "something is seen where the bone should be in the way"
    SURFACE_MISFIT = "surface does not fit the model"
    OUTLIERS = "too many points fit no surface of the model"
    NOT_CONVERGED = "the estimate did not settle"
    AMBIGUOUS = "a different pose fits as well"
    CUES_DISAGREE = "surface and outline do not agree"
    DEGENERATE = "the seen surface leaves a direction free"
    POSE_UNCERTAIN = "the seen surface fixes the pose too loosely"
    CARTILAGE_UNCERTAIN = "the plan knows the cartilage too roughly"
    TRE_TOO_LARGE = "the predicted error exceeds the stage's tolerance"
    JUMPED = "the pose jumped further than a patient moves"
    ROWS_DISAGREE = "the cameras' rows do not agree: has the rig moved?"
    PICTURE_DARK = "one picture is dark or blocked"
    PICTURE_OVEREXPOSED = "one picture is overexposed"
    PICTURES_UNLIKE = "one picture is blurred or covered"
    RIG_NOT_ACCEPTED = "the rig's calibration was not accepted"
    OUT_OF_VIEW = "the bone is outside the picture"
    # of the session
    NOT_NAVIGATING = "no registration has been accepted"
    BONE_LOST = "the bone is lost"
    BLANKED = "blanked by the operator"
    CAMERA_SILENT = "the camera sends no picture"
    DEVICE_FAULT = "a device has failed"
    POSE_TOO_OLD = "the pose is too old"
    STAGE_WITHOUT_BONE = "the plan has no model of this stage's bone"

    @property
    def remedy(self) -> str:
        """What the operator can do."""
        return _REMEDIES[self]


_REMEDIES = {
    Reason.NO_SURFACE: "aim the cameras at the bone, or check the light",
    Reason.TOO_FEW_POINTS: "clear the view, or check the light",
    Reason.COVERAGE_LOW: "move the instrument or hand away",
    Reason.SEEN_THROUGH: "check that this is the right bone and plan; register again",
    Reason.SURFACE_MISFIT: "check that this is the right bone and plan; register again",
    Reason.OUTLIERS: "clear the view of the bone; register again",
    Reason.NOT_CONVERGED: "hold still, or register again",
    Reason.AMBIGUOUS: "expose more of the bone, or start nearer to it",
    Reason.CUES_DISAGREE: "check that this is the right bone and plan; register again",
    Reason.DEGENERATE: "expose more of the bone",
    Reason.POSE_UNCERTAIN: "expose more of the bone",
    Reason.CARTILAGE_UNCERTAIN: "give the plan a surface of the cartilage",
    Reason.TRE_TOO_LARGE: "expose more of the bone, or come closer",
    Reason.JUMPED: "wait for the next frames, or register again",
    Reason.ROWS_DISAGREE: "hold still; if it stays, calibrate the rig again",
    Reason.PICTURE_DARK: "uncover both cameras, or check the light",
    Reason.PICTURE_OVEREXPOSED: "turn the light or the exposure down",
    Reason.PICTURES_UNLIKE: "clean and uncover both cameras",
    Reason.RIG_NOT_ACCEPTED: "calibrate the rig again",
    Reason.OUT_OF_VIEW: "bring the bone back into both pictures",
    Reason.NOT_NAVIGATING: "register, then accept the candidate",
    Reason.BONE_LOST: "clear the view; it is searched for where it was last seen",
    Reason.BLANKED: "press the show key to leave blank",
    Reason.CAMERA_SILENT: "check the camera's cable",
    Reason.DEVICE_FAULT: "see the events, then check the device",
    Reason.POSE_TOO_OLD: "wait for the next frame",
    Reason.STAGE_WITHOUT_BONE: "add the bone's surface to the plan",
}


@dataclass(frozen=True, slots=True, eq=False)
class PoseEstimate:
    """A bone's pose and how well the measurement fixes it.

    Attributes:
        camera_from_bone: source the bone's name; target `left_rect` inside the line, `left` (before
            rectification) when it leaves it.
        covariance: (6, 6) of the twist (translation mm first, rotation rad second), applied from
            the left about the mean of the model's vertices.
        n_points: points that entered.
        inlier_share: their share within three sigma of the surface.
        rms_mm: weighted rms of the point-to-plane residual of those.
        expected_rms_mm: what the measurement's own sigma predicts for it.
        iterations: of the solver.
        is_converged: the solver met its step limit.
        reasons: what the solver itself has against the result.
    """

    camera_from_bone: RigidTransform
    covariance: FloatArray
    n_points: int
    inlier_share: float
    rms_mm: float
    expected_rms_mm: float
    iterations: int
    is_converged: bool
    reasons: tuple[Reason, ...] = ()

    def doubted(self, reason: Reason) -> "PoseEstimate":
        """The same estimate with one more reason against it."""
        return replace(self, reasons=(*self.reasons, reason))


class Status(Enum):
    """The judge's word on a pose."""

    OK = "OK"
    DEGRADED = "DEGRADED"
    LOST = "LOST"


@dataclass(frozen=True, slots=True)
class Verdict:
    """The judge's answer for one frame.

    Attributes:
        status: only OK may be shown.
        predicted_tre_mm: 95 % bound of the mean error over the stage's targets, or over the visible
            vertices when the plan names no targets; None without a pose.
        reasons: why it is not OK.
        coverage: share of the visible model that was measured and fits.
        occluded_share: share of the visible model that something nearer hides.
        inlier_share: share of the measured, not hidden model pixels that fit.
        rms_mm, expected_rms_mm: of the residual.
    """

    status: Status
    predicted_tre_mm: float | None = None
    reasons: tuple[Reason, ...] = ()
    coverage: float = 0.0
    occluded_share: float = 0.0
    inlier_share: float = 0.0
    rms_mm: float | None = None
    expected_rms_mm: float | None = None


@dataclass(frozen=True, slots=True)
class LineTimings:
    """How long the parts of one frame took, in real time."""

    rectify_ms: float = 0.0
    stereo_ms: float = 0.0
    fill_ms: float = 0.0
    estimate_ms: float = 0.0
    judge_ms: float = 0.0
    overlay_ms: float = 0.0

    @property
    def total_ms(self) -> float:
        """Sum."""
        measured_ms = self.rectify_ms + self.stereo_ms + self.fill_ms
        return measured_ms + self.estimate_ms + self.judge_ms + self.overlay_ms


@dataclass(frozen=True, slots=True, eq=False)
class TrackedFrame:
    """What the line answers for one frame and one bone."""

    bone: str
    estimate: PoseEstimate | None
    verdict: Verdict
    timings: LineTimings

    @property
    def left_from_bone(self) -> RigidTransform | None:
        """The pose, when there is one."""
        return None if self.estimate is None else self.estimate.camera_from_bone


@dataclass(frozen=True, slots=True, eq=False)
class Prior:
    """The rough start that an operator can give; any part may be absent.

    Attributes:
        left_from_bone: bone name -> rough pose.
        approach_axis: unit vector in femur coordinates from the bone towards the cameras.
        approach_half_angle_deg: of the cone around it.
        box: x, y, width, height in the left picture, px.
    """

    left_from_bone: Mapping[str, RigidTransform] = field(default_factory=dict)
    approach_axis: FloatArray | None = None
    approach_half_angle_deg: float = 180.0
    box: tuple[int, int, int, int] | None = None

    def starts(self, bone: str) -> bool:
        """Whether it says anything of where a bone is."""
        return (
            bone in self.left_from_bone or self.box is not None or self.axis_for(bone) is not None
        )

    def axis_for(self, bone: str) -> FloatArray | None:
        """The approach axis in a bone's coordinates: known for the femur only."""
        return self.approach_axis if bone == "femur" else None


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """A pre-operative plan.

    Attributes:
        bones: name -> model.
        targets: name -> (N, 3) points of that bone, mm, keyed `bone/name`.
        curves: name -> (N, 3) polylines beside the femur (vessels, nerves), mm.
        digest: hash of the content.
        name: for people.
    """

    bones: Mapping[str, BoneModel]
    targets: Mapping[str, FloatArray] = field(default_factory=dict)
    curves: Mapping[str, FloatArray] = field(default_factory=dict)
    digest: str = ""
    name: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "bones", MappingProxyType(dict(self.bones)))
        object.__setattr__(self, "targets", MappingProxyType(dict(self.targets)))
        object.__setattr__(self, "curves", MappingProxyType(dict(self.curves)))
        if not self.digest:
            object.__setattr__(self, "digest", _digest(self))

    def targets_of(self, names: tuple[str, ...]) -> FloatArray:
        """(N, 3) target points of those names that the plan has; may be empty."""
        found = [self.targets[name].reshape(-1, 3) for name in names if name in self.targets]
        return np.concatenate(found) if found else np.empty((0, 3))


@dataclass(frozen=True, slots=True)
class StageSpec:
    """One surgical stage, as a row of the table in `navapp.control.stages`."""

    number: int
    name: str
    bone: str
    tolerance_mm: float
    tolerance_deg: float
    targets: tuple[str, ...]
    layers: tuple[str, ...]
    gates: tuple[str, ...]
    measurements: tuple[str, ...] = ()


class OverlayMode(Enum):
    """Over the video, or alone on black for the half-silvered mirror."""

    VIDEO = "video"
    MIRROR = "mirror"


@dataclass(frozen=True, slots=True, eq=False)
class OverlayPicture:
    """A picture to be shown until it expires: (H, W, 3) uint8 BGR."""

    image: NDArray[np.uint8]
    valid_until_ns: int
    mode: OverlayMode
    pose_age_ns: int


def visible_vertices(mesh: TriangleMesh, left_from_bone: RigidTransform) -> NDArray[np.bool_]:
    """(V,) vertices that face the left camera: n . v < -0.2 |v| (occlusion is not tested)."""
    positions = left_from_bone.apply(mesh.vertices_mm)
    towards = np.einsum("ij,ij->i", left_from_bone.rotate(mesh.normals), positions)
    facing: NDArray[np.bool_] = towards < -0.2 * np.linalg.norm(positions, axis=1)
    return facing


def predicted_tre_mm(
    estimate: PoseEstimate, centre_mm: FloatArray, targets_mm: FloatArray
) -> float:
    """95 % bound of the mean error over target points of a bone.

    Args:
        estimate: pose and covariance.
        centre_mm: (3,) mean of the model's vertices, in bone coordinates.
        targets_mm: (N, 3) in bone coordinates.

    The mean length is at most the root mean square, whose square is a weighted sum of chi-squares:
    here one chi-square of the same mean and variance (Welch 1938, Satterthwaite 1946).

    Source: e(p) = J x, J = [I | -[p - c]x], x ~ N(0, S); mean |e|^2 = x^T M x, M = mean J^T J.
    """
    from scipy.special import chdtri

    if len(targets_mm) == 0:
        raise ValueError("no targets to predict an error for")
    offsets = (targets_mm - centre_mm) @ estimate.camera_from_bone.rotation.T
    jacobian = np.zeros((len(offsets), 3, 6))
    jacobian[:, :, :3] = np.eye(3)
    x, y, z = offsets.T
    # -[p - c]x, row by row.
    jacobian[:, 0, 4], jacobian[:, 0, 5] = z, -y
    jacobian[:, 1, 3], jacobian[:, 1, 5] = -z, x
    jacobian[:, 2, 3], jacobian[:, 2, 4] = y, -x
    mean_square = np.einsum("nki,nkj->ij", jacobian, jacobian) / len(jacobian)
    errors = estimate.covariance @ mean_square
    first, second = float(np.trace(errors)), float(np.trace(errors @ errors))
    if first <= 0.0:
        return 0.0
    freedom = first**2 / second
    return float(np.sqrt(first / freedom * chdtri(freedom, 0.05)))


def _digest(plan: Plan) -> str:
    """Hash of everything in a plan that changes what is shown."""
    digest = hashlib.sha256()

    def add(label: str, array: NDArray[np.generic]) -> None:
        # With its length, so that the same bytes cut elsewhere are something else.
        digest.update(f"{label}:{array.size}:".encode())
        digest.update(np.ascontiguousarray(array).tobytes())

    for name in sorted(plan.bones):
        bone = plan.bones[name]
        digest.update(f"bone {name}:{bone.side}:{bone.version}".encode())
        add("vertices", bone.mesh.vertices_mm)
        add("faces", bone.mesh.faces)
        add("cartilage", bone.cartilage_mm)
        add("its deviation", bone.cartilage_sd_mm)
        add("removed", bone.is_removed)
    for kind, points_by_name in (("target", plan.targets), ("curve", plan.curves)):
        for name in sorted(points_by_name):
            add(f"{kind} {name}", np.asarray(points_by_name[name], dtype=np.float64))
    return digest.hexdigest()[:12]
