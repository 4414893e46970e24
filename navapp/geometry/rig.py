"""A calibrated stereo rig."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import date

import numpy as np

from navapp.geometry.camera import Camera
from navapp.geometry.transform import FloatArray, RigidTransform


@dataclass(frozen=True, slots=True)
class RigQuality:
    """What the calibration that made a rig said of itself."""

    is_accepted: bool  # it met its limits
    reasons: tuple[str, ...] = ()  # why not, otherwise empty
    # predicted 95 % error of a triangulated point in the working volume.
    uncertainty_mm: float | None = None
    # made_on, expires_on: days of the calibration and of its end; None when nobody said.
    made_on: date | None = None
    expires_on: date | None = None
    # what was measured, by name (`rms_px`, `holdout_rms_px`, `coverage_left`, ...).
    figures: Mapping[str, float] = field(default_factory=dict)
    # (n, n) of the solved numbers: fx fy cx cy and the distortion of the left and of the right
    # camera, rotation vector and translation in mm of `right_from_left`.
    covariance: FloatArray | None = field(default=None, compare=False)
    # mm, or "square" where the board's size was not known: no rig to navigate with.
    length_unit: str = "mm"

    def error_mm(self, depth_mm: float) -> float:
        """Predicted 95 % error of a point at a depth; 0 when nobody said.

        Beyond the working volume it grows as depth does from a disparity: with its square.
        """
        if self.uncertainty_mm is None:
            return 0.0
        farthest_mm = self.figures.get("working_far_mm", depth_mm)
        return self.uncertainty_mm * max(1.0, depth_mm / farthest_mm) ** 2

    def has_expired(self, today: date) -> bool:
        """Whether its time is over."""
        return self.expires_on is not None and today > self.expires_on


@dataclass(frozen=True, slots=True, eq=False)
class StereoRig:
    """Two cameras and `right_from_left` (x_right = R x_left + t, mm).

    Raises:
        ValueError: cameras of different picture sizes, no baseline, wrong frame names, a negative
            row delay.
    """

    left: Camera
    right: Camera
    right_from_left: RigidTransform
    serials: tuple[str, str] = ("", "")
    quality: RigQuality | None = None
    name: str = field(default="")
    # A row of a picture is exposed later by this than the row above it; 0: all rows at once.
    row_delay_ns: int = 0

    def __post_init__(self) -> None:
        if (self.left.width, self.left.height) != (self.right.width, self.right.height):
            raise ValueError("both cameras of a rig need the same picture size")
        if (self.right_from_left.target, self.right_from_left.source) != ("right", "left"):
            raise ValueError("a rig needs the transform right_from_left")
        if self.row_delay_ns < 0:
            raise ValueError(f"row_delay_ns is {self.row_delay_ns}, but no row delay is negative")
        if self.baseline_mm < 1e-6:
            raise ValueError("the cameras of a rig stand at the same place: no baseline")

    @property
    def baseline_mm(self) -> float:
        """Distance of the two optical centres."""
        return float(np.linalg.norm(self.right_from_left.translation_mm))

    @property
    def width(self) -> int:
        """Of one picture, px."""
        return self.left.width

    @property
    def height(self) -> int:
        """Of one picture, px."""
        return self.left.height

    @property
    def rig_id(self) -> str:
        """Hash of the geometry's numbers: two rigs with the same geometry have the same id."""
        digest = hashlib.sha256()
        for camera in (self.left, self.right):
            # Absent coefficients are zeros, and adding 0 makes -0 a plain 0.
            distortion = np.zeros(14)
            distortion[: camera.distortion.size] = camera.distortion
            digest.update((np.round(camera.matrix, 9) + 0.0).tobytes())
            digest.update((np.round(distortion, 12) + 0.0).tobytes())
            digest.update(f"{camera.width}x{camera.height}".encode())
        digest.update((np.round(self.right_from_left.matrix, 9) + 0.0).tobytes())
        return digest.hexdigest()[:12]

    def scale(self, factor: float) -> "StereoRig":
        """The same rig with smaller or larger pictures, which take as long to be exposed."""
        return StereoRig(
            self.left.scale(factor),
            self.right.scale(factor),
            self.right_from_left,
            self.serials,
            self.quality,
            self.name,
            round(self.row_delay_ns / factor),
        )
