"""A monitor above a half-silvered plate: where an eye sees its pixels, and the site behind it."""

from dataclasses import dataclass

import numpy as np

from navapp.geometry.transform import FloatArray

_N_STEPS = 12


@dataclass(frozen=True, slots=True, eq=False)
class Plate:
    """A plane-parallel plate of glass; its front face is half-silvered and looks at the eye."""

    front_mm: FloatArray  # (3,) a point of the front face, left camera's frame
    normal: FloatArray  # (3,) unit, from the eye's side to the site's
    thickness_mm: float = 3.0
    refractive_index: float = 1.52
    transmission: float = 0.5  # share of the site's light that reaches the eye
    # front_reflection, back_reflection: share of the screen's light that the front face sends to
    # the eye; that the back face does, on its way through the front face twice.
    front_reflection: float = 0.45
    back_reflection: float = 0.01


@dataclass(frozen=True, slots=True, eq=False)
class Panel:
    """The monitor itself, seen from its front: columns rise along `across`, rows along `down`."""

    origin_mm: FloatArray  # (3,) centre of the first pixel of the first row
    # across, down: (3,) unit, orthogonal.
    across: FloatArray
    down: FloatArray
    pitch_mm: float
    # width_px, height_px: of it, and of every picture that it is handed.
    width_px: int
    height_px: int
    # flips_columns, flips_rows: the monitor shows what it is handed so.
    flips_columns: bool = False
    flips_rows: bool = False
    white_cd_m2: float = 300.0  # luminance of a white picture
    black_share: float = 0.001  # of that, which a black one still has
    gamma: float = 2.2  # luminance rises with the value to this power

    def points_mm(self, pixels: FloatArray) -> FloatArray:
        """(N, 3) where pixels (N, 2) of the picture that it is handed are lit."""
        u, v = pixels[:, 0], pixels[:, 1]
        u = self.width_px - 1.0 - u if self.flips_columns else u
        v = self.height_px - 1.0 - v if self.flips_rows else v
        along: FloatArray = np.column_stack([u, v]) * self.pitch_mm
        return self.origin_mm + along @ np.vstack([self.across, self.down])

    def pixels_of(self, points_mm: FloatArray) -> FloatArray:
        """(N, 2) pixels of the picture that it is handed, lit at points (N, 3) of the panel."""
        along = (points_mm - self.origin_mm) @ np.column_stack([self.across, self.down])
        u, v = (along / self.pitch_mm).T
        u = self.width_px - 1.0 - u if self.flips_columns else u
        v = self.height_px - 1.0 - v if self.flips_rows else v
        return np.column_stack([u, v])


@dataclass(frozen=True, slots=True, eq=False)
class MirrorSetup:
    """Where eye, plate, monitor and site are, in the left camera's frame."""

    eye_mm: FloatArray  # (3,) centre of the pupil, or of a camera's lens
    right: FloatArray  # (3,) unit: what an upright observer calls right
    site_mm: FloatArray  # (3,) middle of the anatomy
    plate: Plate
    panel: Panel
    site_lx: float = 500.0  # illuminance of the site

    def directions_to_site(self, points_mm: FloatArray, eye_mm: FloatArray) -> FloatArray:
        """(N, 3) unit directions in which an eye at (3,) sees points (N, 3) behind the plate.

        Solves, with Newton's steps, for the angle at which a ray must leave the eye.
        """
        plate = self.plate
        n = plate.normal
        before = float((plate.front_mm - eye_mm) @ n)
        behind = (points_mm - plate.front_mm) @ n - plate.thickness_mm
        aside = points_mm - eye_mm - ((points_mm - eye_mm) @ n)[:, None] * n
        far = np.linalg.norm(aside, axis=1)
        air, index = before + behind, plate.refractive_index
        sine = far / np.hypot(far, air + plate.thickness_mm)
        for _ in range(_N_STEPS):
            cosine, inside = np.sqrt(1.0 - sine**2), np.sqrt(index**2 - sine**2)
            reached = air * sine / cosine + plate.thickness_mm * sine / inside
            slope = air / cosine**3 + plate.thickness_mm * index**2 / inside**3
            sine = np.clip(sine - (reached - far) / slope, 0.0, 0.999)
        outward = aside / np.maximum(far, 1e-12)[:, None]
        directions: FloatArray = sine[:, None] * outward + np.sqrt(1.0 - sine**2)[:, None] * n
        return directions

    def shift_of_site_mm(self) -> FloatArray:
        """(3,) by how much the plate moves the site's middle towards the eye, along its normal.

        t (1 - cos a / sqrt(n^2 - sin^2 a)) for the angle a between normal and line of sight.
        """
        plate = self.plate
        cosine = float(self.directions_to_site(self.site_mm[None], self.eye_mm)[0] @ plate.normal)
        inside = np.sqrt(plate.refractive_index**2 - 1.0 + cosine**2)
        shift: FloatArray = -plate.thickness_mm * (1.0 - cosine / inside) * plate.normal
        return shift

    def directions_to_pixels(self, pixels: FloatArray, eye_mm: FloatArray) -> FloatArray:
        """(N, 3) unit directions in which an eye at (3,) sees pixels (N, 2) by the front face.

        The ray from a pixel meets the face where the angles of incidence and reflection agree.
        """
        lit = self.panel.points_mm(pixels)
        n = self.plate.normal
        eye_height = float((self.plate.front_mm - eye_mm) @ n)
        heights = (self.plate.front_mm - lit) @ n
        eye_foot = eye_mm + eye_height * n
        feet = lit + heights[:, None] * n
        share = eye_height / (eye_height + heights)
        met = eye_foot + share[:, None] * (feet - eye_foot)
        directions: FloatArray = met - eye_mm
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        return directions

    def pixels_in_directions(self, directions: FloatArray, eye_mm: FloatArray) -> FloatArray:
        """(N, 2) pixels that an eye at (3,) sees by the front face in unit directions (N, 3)."""
        plate, panel = self.plate, self.panel
        n, facing = plate.normal, np.cross(panel.across, panel.down)
        until = float((plate.front_mm - eye_mm) @ n) / (directions @ n)
        met = eye_mm + until[:, None] * directions
        back = directions - 2.0 * (directions @ n)[:, None] * n
        further = ((panel.origin_mm - met) @ facing) / (back @ facing)
        return panel.pixels_of(met + further[:, None] * back)

    @property
    def reads_upside_down(self) -> bool:
        """An upright observer sees the rows of the panel's picture rise upwards."""
        u, v = 0.5 * self.panel.width_px, 0.5 * self.panel.height_px
        along = np.array([[u, v], [u, v + 40.0]])
        first, second = self.directions_to_pixels(along, self.eye_mm)
        below = np.cross(self.site_mm - self.eye_mm, self.right)
        return bool((second - first) @ below < 0.0)
