"""The components of a knee replacement: shapes that lie on the planned cuts."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.mesh_sections import section_lines
from navapp.geometry.transform import FloatArray
from sim_devices.anatomy import KneeAnatomy
from sim_devices.bone_shapes import make_femur
from sim_devices.implicit import Field, Intersection, Scaled, Union, compute_gradient, smooth_max
from sim_devices.planned_cuts import RESECTION_MM, Cut
from sim_devices.surface_nets import mesh_solid
from sim_devices.tools import make_tube

# Of the meshes that mirror the room's lamps, and of those that a plan holds.
_CELL_MM, PLAN_CELL_MM = 1.0, 2.0
# Narrower than the bone, so that no edge overhangs.
_NARROWER = 0.955
# The inner side reaches so far into the bone, and no nearer to its skin: a cut that misses its
# plan leaves no gap.
_CEMENT_MM = 3.5
_EDGE_MM = 2.0
# Its groove is flatter than the joint's; about so far beside its middle metal covers it so thickly.
_FLATTER_MM, _GROOVE_MM, _THINNEST_MM = 3.5, 13.0, 3.0
_FLANGE_BELOW_CORTEX_MM = 20.0
TRAY_MM = 3.0
_RIM_MM, _DISH_MM = 2.6, 2.4


def make_femoral_component(
    knee: KneeAnatomy, cuts: Sequence[Cut], cell_mm: float = _CELL_MM
) -> TriangleMesh:
    """A shell as thick as what the planned cuts of the femur remove, its outside that of the joint.

    Args:
        knee: a right one.
        cuts: the planned ones of its femur.
        cell_mm: of the mesh.
    """
    shape = replace(knee.shape, groove_depth=knee.shape.groove_depth - _FLATTER_MM)
    size = knee.scale * (_NARROWER, 1.0, 1.0)
    outside = Scaled(make_femur(shape), size, np.zeros(3))
    joint = Scaled(make_femur(knee.shape), size, np.zeros(3))
    top = float(knee.landmarks["femur/anterior_cortex"][2]) - _FLANGE_BELOW_CORTEX_MM

    def groove(points: FloatArray) -> FloatArray:
        beside = points[:, 0] / knee.scale[0] - knee.shape.groove_x
        covered: FloatArray = joint(points) - _THINNEST_MM * np.exp(-((beside / _GROOVE_MM) ** 4))
        return covered

    def beyond(points: FloatArray) -> FloatArray:
        heights = np.max([cut.heights_mm(points) for cut in cuts], axis=0)
        beside = np.abs(points[:, 0] / knee.scale[0] - knee.shape.groove_x) - 0.8 * _GROOVE_MM
        inside = np.maximum(-heights - _CEMENT_MM, np.minimum(joint(points) + _CEMENT_MM, beside))
        return smooth_max(np.minimum(-heights, inside), points[:, 2] - top, _EDGE_MM)

    vertices = knee.bones["femur"].vertices_mm
    low, high = vertices.min(axis=0) - 3.0, vertices.max(axis=0) + 3.0
    high[2] = top + 3.0
    shell = Union(outside, ((groove, 4.0),))
    return _mesh(Intersection(shell, beyond, _EDGE_MM), low, high, cell_mm)


def make_patellar_button(knee: KneeAnatomy, cut: Cut) -> TriangleMesh:
    """A dome on the planned cut of the patella, as high as what is removed."""
    radius_mm = 15.0 * float(np.sqrt(knee.scale[0] * knee.scale[2]))
    height = np.concatenate([[-1.0, 0.0], np.linspace(0.35, 1.0, 24) * RESECTION_MM])
    share = np.clip((height / RESECTION_MM - 0.35) / 0.65, 0.0, 1.0)
    radius = radius_mm * np.sqrt(np.clip(1.0 - share**2, 0.0004, 1.0))
    return make_tube(cut.point_mm + height[:, None] * cut.normal, radius, 64)


def make_tray_and_insert(
    knee: KneeAnatomy, cut: Cut, thickness_mm: float, cell_mm: float = _CELL_MM
) -> tuple[TriangleMesh, TriangleMesh]:
    """The metal tray on the planned cut of the tibia, and the plastic insert on the tray.

    Args:
        knee: a right one.
        cut: of its tibia.
        thickness_mm: of both together, below the lowest point of the joint surfaces.
        cell_mm: of the meshes.
    """
    outline = Outline(knee.bones["tibia"], cut)
    width = knee.scale[0]

    def surface(points: FloatArray) -> FloatArray:
        across, along = cut.axes
        x, y = (points - cut.point_mm) @ across / width, (points - cut.point_mm) @ along
        dish = np.exp(-(((np.abs(x) - 20.0) / 12.0) ** 2) - (y / 17.0) ** 2)
        result: FloatArray = cut.heights_mm(points) - thickness_mm - _DISH_MM * (1.0 - dish)
        return result

    def tray(points: FloatArray) -> FloatArray:
        height = cut.heights_mm(points)
        slab = np.maximum(height - TRAY_MM, -height - _CEMENT_MM)
        return smooth_max(outline(points) + 1.0, slab, 0.8)

    def insert(points: FloatArray) -> FloatArray:
        slab = np.maximum(surface(points), TRAY_MM - 0.5 - cut.heights_mm(points))
        return smooth_max(outline(points) + 1.6, slab, _RIM_MM)

    half = np.array([46.0, 34.0, 0.0])
    low = cut.point_mm - half - (0.0, 0.0, _CEMENT_MM + 4.0)
    high = cut.point_mm + half + (0.0, 0.0, thickness_mm + 8.0)
    return _mesh(tray, low, high, cell_mm), _mesh(insert, low, high, cell_mm)


class Outline:
    """A field: distance (mm) beside the outline of a bone's section, the same all along the normal.

    Args:
        bone: that is cut.
        cut: whose section is meant.
    """

    _CELL_MM = 0.5

    def __init__(self, bone: TriangleMesh, cut: Cut) -> None:
        import cv2

        lines = section_lines(bone, cut.heights_mm(bone.vertices_mm))
        longest = max(lines, key=len)
        self._cut = cut
        flat = (longest - cut.point_mm) @ cut.axes.T
        self._low = flat.min(axis=0) - 12.0
        size = np.ceil((flat.max(axis=0) + 12.0 - self._low) / self._CELL_MM).astype(int) + 1
        mask = np.zeros((size[1], size[0]), dtype=np.uint8)
        corners = np.rint((flat - self._low) / self._CELL_MM).astype(np.int32)
        cv2.fillPoly(mask, [corners], 1)
        outside, inside = (
            cv2.distanceTransform(m, cv2.DIST_L2, cv2.DIST_MASK_PRECISE) for m in (1 - mask, mask)
        )
        distance = (outside.astype(np.float64) - inside) * self._CELL_MM
        self._distance = cv2.GaussianBlur(distance, (0, 0), 5.0)

    def __call__(self, points: FloatArray) -> FloatArray:
        """Values (N,) at points (N, 3)."""
        from scipy.ndimage import map_coordinates

        flat = (points - self._cut.point_mm) @ self._cut.axes.T
        cells = (flat - self._low) / self._CELL_MM
        values: FloatArray = map_coordinates(
            self._distance, cells[:, ::-1].T, order=1, mode="nearest"
        )
        return values


def _mesh(field: Field, low: FloatArray, high: FloatArray, cell_mm: float) -> TriangleMesh:
    """A closed mesh with the field's own normals: mirrors show every flaw of computed ones."""
    mesh = mesh_solid(field, low, high, cell_mm)
    slope = compute_gradient(field, mesh.vertices_mm, 0.2)
    normals = slope / np.maximum(np.linalg.norm(slope, axis=1, keepdims=True), 1e-9)
    return TriangleMesh(mesh.vertices_mm, mesh.faces, normals)
