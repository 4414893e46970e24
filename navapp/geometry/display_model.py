"""A display whose picture is seen in a half-silvered mirror above the site."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from datetime import date
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from navapp.geometry import display_model_errors as errors
from navapp.geometry.directions import perpendicular_axes
from navapp.geometry.display_model_optics import Glass, VirtualScreen
from navapp.geometry.display_model_view import (
    LEAST_DISTANCE_MM,
    WRONG_SIDE,
    EyeView,
    make_view,
    project,
)
from navapp.geometry.transform import FloatArray, read_only, rotation_from_vector

ViewingEye = Literal["left", "right", "camera"]
VIEWING_EYES: tuple[ViewingEye, ...] = ("left", "right", "camera")
N_PARAMETERS = 14


@dataclass(frozen=True, slots=True)
class DisplayQuality:
    """What the calibration of a display said of itself."""

    is_accepted: bool  # it met its limits
    reasons: tuple[str, ...] = ()  # why not, otherwise empty
    # error_mm, error_arcmin: predicted 95 % error at the anatomy, seen from the calibrated eye.
    error_mm: float | None = None
    error_arcmin: float | None = None
    # made_on, expires_on: days of the calibration and of its end; None when nobody said.
    made_on: date | None = None
    expires_on: date | None = None
    figures: Mapping[str, float] = field(default_factory=dict)  # what was measured, by name
    # (14, 14) of the numbers of `DisplayModel.move`.
    covariance: FloatArray | None = field(default=None, compare=False)

    def has_expired(self, today: date) -> bool:
        """Whether its time is over."""
        return self.expires_on is not None and today > self.expires_on


@dataclass(frozen=True, slots=True, eq=False)
class DisplayModel:
    """Where what is shown is seen, in the left camera's frame.

    Raises:
        ValueError: an eye in the screen's plane, or flips that do not go with the directions in
            which the eye sees columns and rows rise.
    """

    screen: VirtualScreen
    glass: Glass | None
    eye_mm: FloatArray  # (3,) centre of the calibrated viewing eye
    # flips_columns, flips_rows: from a picture as the eye reads it to the one that is handed to the
    # display. One of them, when the screen is seen mirrored.
    flips_columns: bool
    flips_rows: bool
    viewing_eye: ViewingEye = "camera"
    other_eye_mm: FloatArray | None = None  # (3,) of the eye that does not view
    display_name: str = ""
    # of the display's backend at calibration, horizontally and vertically.
    backend_flips: tuple[bool, bool] = (False, False)
    mirror_deg: float | None = None  # angle of the mirror's mount at calibration
    # projector_flips, keystone: read back from the projector; None: it has no line.
    projector_flips: tuple[bool, bool] | None = None
    keystone: tuple[int, int] | None = None
    quality: DisplayQuality | None = None

    def __post_init__(self) -> None:
        for name in ("eye_mm", "other_eye_mm"):
            given = getattr(self, name)
            if given is None:
                continue
            values = read_only(np.asarray(given, dtype=np.float64).reshape(-1))
            if values.shape != (3,) or not np.isfinite(values).all():
                raise ValueError(f"{name} is three finite numbers")
            object.__setattr__(self, name, values)
        if self.viewing_eye not in VIEWING_EYES:
            raise ValueError(f"the viewing eye is one of {', '.join(VIEWING_EYES)}")
        covariance = None if self.quality is None else self.quality.covariance
        if covariance is not None and np.shape(covariance) != (N_PARAMETERS, N_PARAMETERS):
            raise ValueError(f"the covariance of a display is {N_PARAMETERS}x{N_PARAMETERS}")
        if self.distance_mm() < LEAST_DISTANCE_MM:
            raise ValueError(WRONG_SIDE)

    def distance_mm(self) -> float:
        """Of the eye from the screen's plane; negative where the flips show all mirrored."""
        sign = -1.0 if self.flips_columns ^ self.flips_rows else 1.0
        return sign * float(self.screen.normal @ (self.screen.origin_mm - self.eye_mm))

    def project(self, points_left_mm: ArrayLike, eye_mm: ArrayLike | None = None) -> FloatArray:
        """(N, 2) px of the display's picture where points (N, 3) mm are drawn for an eye.

        Args:
            points_left_mm: (N, 3) in the left camera's frame.
            eye_mm: (3,) of another eye than the calibrated one.

        Returns:
            px as handed to the display, also outside of its picture; NaN at and behind the eye.
        """
        eye = self.eye_mm if eye_mm is None else np.asarray(eye_mm, dtype=np.float64)
        points = np.asarray(points_left_mm, dtype=np.float64).reshape(-1, 3)
        return project(self.screen, self.glass, eye, points)

    def view(self, eye_mm: ArrayLike | None = None) -> EyeView:
        """What an eye sees, for drawing; the calibrated one when no other is given.

        Raises:
            ValueError: an eye that sees the screen from its other side.
        """
        eye = self.eye_mm if eye_mm is None else np.asarray(eye_mm, dtype=np.float64)
        return make_view(self.screen, self.glass, eye, (self.flips_columns, self.flips_rows))

    def move(self, change: ArrayLike) -> "DisplayModel":
        """The model with its numbers changed by (14,); the frame of the covariance.

        Screen: rotation vector (rad) about its middle, shift (mm), relative pitch, bulge (mm);
        glass: thickness (mm), tilts (rad) of its normal about two axes perpendicular to it; eye
        (mm). Without glass its numbers change nothing.
        """
        d = np.asarray(change, dtype=np.float64)
        screen, glass = self.screen, self.glass
        if d[:8].any():
            screen = screen.move(d[:3], d[3:6]).resize(
                screen.pitch_mm * (1.0 + float(d[6])), screen.bulge_mm + float(d[7])
            )
        if glass is not None and d[8:11].any():
            axes = perpendicular_axes(glass.normal[None])[0]
            normal = rotation_from_vector(d[9:11] @ axes) @ glass.normal
            thickness = abs(glass.thickness_mm + float(d[8]))
            glass = Glass(thickness, normal, glass.refractive_index)
        return replace(self, screen=screen, glass=glass, eye_mm=self.eye_mm + d[11:])

    def predict_error(
        self,
        points_left_mm: ArrayLike,
        eye_sd_mm: float = 0.0,
        point_covariance: FloatArray | None = None,
        calibration: bool = True,
    ) -> FloatArray:
        """(N,) mm at points (N, 3) that 95 % of the errors stay below, seen from the viewing eye.

        Args:
            points_left_mm: (N, 3) in the left camera's frame, before the eye.
            eye_sd_mm: standard deviation of the eye's place about the calibrated one, an axis.
            point_covariance: (N, 3, 3) of the points, mm^2.
            calibration: count what the calibration does not know; nothing without its record.
        """
        points = np.asarray(points_left_mm, dtype=np.float64).reshape(-1, 3)
        return errors.predict_error_mm(self, points, eye_sd_mm, point_covariance, calibration)

    def error_for_other_eye_mm(self, points_left_mm: ArrayLike) -> FloatArray:
        """(N,) mm at points (N, 3) by which the eye that does not view sees the guides beside.

        Where that eye is not known, the larger one of both sides, 63 mm away along the rows.
        """
        points = np.asarray(points_left_mm, dtype=np.float64).reshape(-1, 3)
        return errors.error_for_other_eye_mm(self, points)

    def screen_shift_mm(self, points_left_mm: ArrayLike) -> float:
        """By how much the screen must move, away from the eye, to stand at the mean of points.

        There a guide is right for both eyes.
        """
        points = np.asarray(points_left_mm, dtype=np.float64).reshape(-1, 3)
        return errors.screen_shift_mm(self, points)
