"""The three bones of a right knee as implicit solids, in the proportions of a 78 mm wide femur.

Axes: x medial (patient's left), y posterior, z proximal; the origin is the middle between the
epicondyles. The numbers are our own, chosen after published ranges of knee morphometry.
"""

from dataclasses import dataclass

import numpy as np

from navapp.geometry.transform import FloatArray
from sim_devices.implicit import (
    Below,
    Cone,
    Difference,
    Ellipsoid,
    Field,
    Intersection,
    Roller,
    Union,
    make_loft,
)


@dataclass(frozen=True, slots=True)
class ShapeDraws:
    """What differs between two knees of one size; lengths in mm before scaling."""

    lateral_forward: float  # how much further the lateral trochlear facet stands forward
    lateral_short: float  # how much shorter the lateral condyle is behind
    distal_difference: float  # how much further down the medial condyle reaches
    groove_depth: float  # depth of the trochlear groove
    groove_x: float  # lateral offset (negative) of the groove
    notch_radius: float  # half width of the intercondylar notch
    divergence: float  # sideways divergence of the condyles per mm towards the back
    torsion_rad_per_mm: float  # twist of the shafts
    bow: float  # forward bow of the femoral shaft
    slope_deg: float  # posterior slope of the tibial plateau
    dish: float  # depth of the medial plateau
    dome: float  # height of the lateral plateau
    spine: float  # height of the intercondylar eminence
    tubercle: float  # prominence of the tibial tubercle
    ridge_x: float  # lateral-medial offset of the patellar ridge


def draw_shape(rng: np.random.Generator) -> ShapeDraws:
    """Random but plausible values, two standard deviations at most from the mean."""

    def near(mean: float, deviation: float) -> float:
        return mean + deviation * float(np.clip(rng.standard_normal(), -2.0, 2.0))

    return ShapeDraws(
        lateral_forward=near(3.0, 0.6),
        lateral_short=near(2.5, 0.7),
        distal_difference=near(1.5, 0.5),
        groove_depth=near(4.3, 0.5),
        groove_x=near(-2.0, 0.7),
        notch_radius=near(8.0, 0.5),
        divergence=near(0.16, 0.02),
        torsion_rad_per_mm=near(0.0008, 0.0006),
        bow=near(3.0, 0.7),
        slope_deg=near(7.0, 0.8),
        dish=near(3.0, 0.3),
        dome=near(1.6, 0.3),
        spine=near(6.0, 0.5),
        tubercle=near(6.0, 0.8),
        ridge_x=near(2.0, 0.7),
    )


def make_medial_roller(d: ShapeDraws) -> Roller:
    """The medial condyle with its half of the trochlea."""
    discs = np.array([[20.5, -4.0, 19.5], [6.0, -2.0, 23.0], [-7.5, 3.0, 16.5], [-8.0, 10.0, 12.5]])
    return Roller(discs, 17.5, d.divergence + 0.07, 14.0, 11.0, 0.012)


def make_lateral_roller(d: ShapeDraws) -> Roller:
    """The lateral condyle: flatter below, higher in front, shorter behind."""
    forward = d.lateral_forward
    discs = np.array(
        [
            [20.5 - d.lateral_short, -3.0, 19.0],
            [6.0, d.distal_difference - 0.5, 24.5],
            [-7.5 - forward, 5.0, 16.5],
            [-8.0 - 0.5 * forward, 14.0, 12.5],
        ]
    )
    return Roller(discs, -18.5, -d.divergence, 14.5, 10.5, 0.008)


def make_trochlea_roller(d: ShapeDraws) -> Roller:
    """The floor of the groove between the condyles' front halves."""
    front = -23.0 + d.groove_depth
    discs = np.array([[front + 13.0, 9.0, 13.0], [-2.0, 0.0, 17.0], [6.0, 2.0, 15.0]])
    return Roller(discs, d.groove_x, 0.0, 18.0, 8.0, 0.0)


def _femur_column(d: ShapeDraws) -> Field:
    """Shaft and metaphysis of the femur, without the condyles."""
    # z, centre x, centre y, radius lateral, medial, anterior, posterior
    shaft = make_loft(
        [
            [112.0, 1.0, -7.0 - d.bow, 13.5, 13.5, 13.5, 14.5],
            [90.0, 1.0, -7.5 - d.bow, 13.5, 13.5, 13.5, 14.5],
            [70.0, 1.0, -7.5 - 0.8 * d.bow, 14.0, 14.5, 13.5, 14.5],
            [50.0, 0.5, -8.0 - 0.4 * d.bow, 17.0, 17.5, 13.5, 15.0],
            [35.0, 0.0, -7.0, 20.5, 21.5, 14.0, 16.0],
            [22.0, 0.0, -5.0, 26.5, 28.0, 15.5, 18.5],
            [12.0, 0.0, -1.0, 30.5, 32.5, 19.5, 22.0],
            [4.0, 0.0, 3.0, 33.0, 34.0, 22.5, 22.0],
            [-6.0, 0.0, 4.0, 31.5, 33.0, 21.0, 20.0],
            [-16.0, 0.0, 4.0, 27.0, 28.0, 14.0, 16.0],
        ],
        exponent=2.3,
        twist_rad_per_mm=d.torsion_rad_per_mm,
    )
    bottom = Below(lambda p: np.full(len(p), -10.0), axis=2, upwards=False)
    top = Below(lambda p: np.full(len(p), 100.0), axis=2)
    return Intersection(Intersection(shaft, bottom, 12.0), top, 2.0)


def _trochlea_groove(d: ShapeDraws) -> Field:
    """What is missing in front: from the front of the shaft down into the notch."""
    x, y = d.groove_x, -25.0 + d.groove_depth - 12.0
    return Union(
        Cone((x, y - 4.0, 26.0, 11.0), (x, y, 6.0, 12.0)),
        (
            (Cone((x, y, 6.0, 12.0), (x, y + 6.0, -13.0, 12.0)), 3.0),
            (Cone((x, y + 6.0, -13.0, 12.0), (x + 1.0, y + 24.0, -32.0, 11.0)), 3.0),
        ),
    )


def make_femur(d: ShapeDraws) -> Field:
    """Distal femur with about 100 mm of shaft above the epicondyles."""
    solid = Union(
        _femur_column(d),
        (
            (make_medial_roller(d), 10.0),
            (make_lateral_roller(d), 10.0),
            (make_trochlea_roller(d), 9.0),
            (Ellipsoid((28.5, 5.0, 2.0), (9.5, 14.0, 15.0)), 8.0),
            (Ellipsoid((31.0, 9.0, 13.0), (4.5, 6.0, 8.0)), 6.0),
            (Ellipsoid((-28.5, 4.0, 1.0), (9.0, 13.0, 14.0)), 8.0),
        ),
    )
    r = d.notch_radius
    notch = Union(
        Cone((-1.0, 12.0, -26.0, r), (-1.0, 37.0, 12.0, r)),
        ((Cone((-1.0, 23.0, -34.0, r), (-1.0, 52.0, 6.0, r)), 4.0),),
    )
    # The popliteus groove below the lateral epicondyle.
    groove = Cone((-40.0, 9.0, -10.0, 4.5), (-38.5, 22.0, 0.0, 4.5))
    carved = Difference(Difference(solid, _trochlea_groove(d), 9.0), notch, 5.0)
    return Difference(carved, groove, 5.0)


def compute_plateau_height(
    d: ShapeDraws, medial_mm: float, lateral_mm: float, points: FloatArray
) -> FloatArray:
    """Height of the tibia's upper surface over x and y; the two compartments' levels are given."""
    x, y = points[:, 0], points[:, 1] - 6.0
    side = 0.5 + 0.5 * np.tanh(x / 4.0)
    dish = -d.dish * np.exp(-(((x - 19.0) / 11.0) ** 2) - (y / 16.0) ** 2)
    dome = d.dome * (np.exp(-((y / 14.0) ** 2)) - 1.0) - 1.2 * np.exp(-(((x + 19.0) / 8.0) ** 2))
    level = side * (medial_mm + dish) + (1.0 - side) * (lateral_mm + dome)
    spines = d.spine * np.exp(-(((x - 3.0) / 4.0) ** 2) - ((y - 4.5) / 7.0) ** 2)
    spines += (d.spine - 1.0) * np.exp(-(((x + 4.5) / 3.8) ** 2) - ((y - 6.0) / 6.0) ** 2)
    fossa = -2.5 * np.exp(-((x / 9.0) ** 2) - ((y + 16.0) / 8.0) ** 2)
    fossa -= 6.0 * np.exp(-((x / 7.0) ** 2) - ((y - 21.0) / 9.0) ** 2)
    result: FloatArray = level + spines + fossa - np.tan(np.deg2rad(d.slope_deg)) * y
    return result


def make_tibia(d: ShapeDraws, medial_mm: float, lateral_mm: float) -> Field:
    """Proximal tibia, some 110 mm of it; the levels are those of `compute_plateau_height`."""
    z = 0.5 * (medial_mm + lateral_mm)
    column = make_loft(
        [
            [z + 25.0, 0.0, 6.0, 34.0, 35.5, 23.5, 24.5],
            [z, 0.0, 6.0, 34.0, 35.5, 23.5, 24.5],
            [z - 8.0, 0.0, 6.0, 34.5, 35.5, 23.5, 24.5],
            [z - 16.0, 0.0, 5.5, 33.0, 33.5, 23.5, 22.0],
            [z - 26.0, 0.0, 3.0, 28.0, 28.0, 21.5, 19.0],
            [z - 40.0, 1.0, 0.0, 21.0, 21.0, 19.5, 17.0],
            [z - 60.0, 2.0, -1.0, 16.0, 16.0, 18.0, 16.0],
            [z - 80.0, 2.5, -1.0, 14.0, 13.5, 17.0, 15.0],
            [z - 120.0, 3.0, 0.0, 12.5, 12.0, 16.0, 14.0],
        ],
        exponent=2.4,
        twist_rad_per_mm=d.torsion_rad_per_mm,
    )
    bottom = z - 110.0
    cut = Below(lambda p: np.full(len(p), bottom), axis=2, upwards=False)
    y = -11.5 - d.tubercle
    solid = Union(
        Intersection(column, cut, 2.0),
        (
            (Cone((-4.0, y + 5.0, z - 26.0, 6.0), (-2.5, y, z - 42.0, 5.0)), 9.0),
            (Cone((-2.5, y, z - 42.0, 5.0), (1.0, y + 7.5, z - 72.0, 4.0)), 9.0),
            (Ellipsoid((-24.0, 15.0, z - 12.0), (12.5, 13.0, 11.0)), 8.0),
            (Ellipsoid((-22.0, -4.0, z - 12.0), (11.0, 13.0, 9.0)), 8.0),
            (Ellipsoid((21.0, 14.0, z - 10.0), (14.0, 15.0, 10.0)), 8.0),
        ),
    )
    valley = Cone((-1.0, 36.5, z + 20.0, 10.0), (0.0, 42.0, z - 25.0, 9.0))
    plateau = Below(lambda p: compute_plateau_height(d, medial_mm, lateral_mm, p), axis=2)
    return Intersection(Difference(solid, valley, 6.0), plateau, 3.0)


PATELLA_Z_MM = 10.0


def compute_patella_back(d: ShapeDraws, points: FloatArray) -> FloatArray:
    """How far the patella's back stands behind its ridge's top (negative: in front of it)."""
    x, z = points[:, 0] - d.ridge_x - d.groove_x, points[:, 2] - PATELLA_Z_MM
    slope = np.where(x < 0.0, 0.30, 0.34)
    facets = slope * (np.sqrt(x * x + 9.0) - 3.0)
    apex = np.maximum(-z - 8.0, 0.0)
    odd = 0.012 * np.maximum(x - 12.0, 0.0) ** 2
    result: FloatArray = -facets - 0.022 * apex**2 - odd - 0.0025 * z * z
    return result


def make_patella(d: ShapeDraws, ridge_y_mm: float) -> Field:
    """Patella whose median ridge reaches back to y = ridge_y_mm."""
    z, x = PATELLA_Z_MM, d.groove_x

    def front(p: FloatArray) -> FloatArray:
        u, v = p[:, 0] - x, p[:, 2] - z
        dome = 0.009 * u * u + 0.007 * v * v + 0.00001 * (u * u + v * v) ** 2
        limit: FloatArray = ridge_y_mm - 24.0 + dome
        return limit

    def outline(p: FloatArray) -> FloatArray:
        up = p[:, 2] - z
        across = (p[:, 0] - x) / (1.0 + 0.012 * np.clip(up, -26.0, 26.0))
        return seen_from_front(np.stack([across, up, 0.0 * up], axis=1))

    seen_from_front = make_loft(
        [[-1.0, 0.0, 0.0, 20.4, 20.0, 22.0, 17.6], [1.0, 0.0, 0.0, 20.4, 20.0, 22.0, 17.6]],
        exponent=2.0,
    )
    back = Below(lambda p: ridge_y_mm + compute_patella_back(d, p), axis=1)
    return Intersection(Intersection(outline, back, 4.0), Below(front, axis=1, upwards=False), 8.0)
