"""Where the face of a cut should be seen in a rectified left picture."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.box import Box
from navapp.geometry.masks import shrink
from navapp.geometry.mesh import TriangleMesh, join_meshes
from navapp.geometry.mesh_sections import fill_section, section_lines
from navapp.geometry.rectification import RectifiedGeometry
from navapp.geometry.simplify import drawn
from navapp.geometry.transform import RigidTransform
from navapp.geometry.zbuffer import render_rectified
from navapp.resection.remaining_bone import Cut, heights_over, remove_cuts
from navapp.stereo import MODEL_REFINEMENT
from navapp.values import BoneModel
from navapp.values.contents import ResectionPlane

# All chosen. Windows of the matcher that reach over the rim of a face see both sides of it.
RIM_PX = MODEL_REFINEMENT.radius_px
_MARGIN_PX = 12
# Fewer pixels of a face tell nothing.
LEAST_PIXELS = 300
# A face that is seen at a grazing angle tells nothing; one of which most lies beside the picture
# neither.
_LEAST_COSINE, _MOST_PICTURES = 0.17, 20


@dataclass(frozen=True, slots=True, eq=False)
class FaceView:
    """A face as the left camera should see it; rims are left out, here and of the whole face."""

    box: Box
    is_face: NDArray[np.bool_]  # (h, w) its pixels in the box, where nothing of the bone hides it
    n_whole: int  # pixels of the whole face, hidden or outside of the picture, too
    depths_mm: tuple[float, float]  # least and largest


class FaceViewer:
    """Finds the faces of cuts of one bone in the rectified left pictures of one rig."""

    def __init__(self, bone: BoneModel, geometry: RectifiedGeometry) -> None:
        self._bone, self._geometry = bone, geometry
        self._rest = lru_cache(maxsize=8)(_make_rest)

    def find(
        self,
        plane: ResectionPlane,
        planned: ResectionPlane,
        others: Sequence[Cut],
        rectified_from_bone: RigidTransform,
    ) -> FaceView | None:
        """Where a face is seen; None when it looks away, out of view, or where too little is left.

        Args:
            plane: of the face, as planned or as known.
            planned: the cut.
            others: the other cuts of the bone that have been made: what is unsure beside them
                belongs to no face.
            rectified_from_bone: pose of the bone in the rectified left camera.
        """
        normal = rectified_from_bone.rotate(plane.normal[None])[0]
        point_mm = rectified_from_bone.apply(plane.point_mm[None])[0]
        if -(normal @ point_mm) < _LEAST_COSINE * np.linalg.norm(point_mm):
            return None
        mesh = self._bone.mesh
        lines = section_lines(mesh, heights_over(mesh, Cut(plane, 0.0)))
        face = fill_section(lines, plane.normal)
        if face is None:
            return None
        corners_mm = rectified_from_bone.apply(face.vertices_mm)
        around = Box.around(self._geometry.project(corners_mm))
        if around is None or corners_mm[:, 2].min() <= 0.0:
            return None
        around = around.grow(_MARGIN_PX)
        box = around.clip(self._geometry.width, self._geometry.height)
        is_near = around.width * around.height > _MOST_PICTURES * box.width * box.height
        if box.is_empty or is_near:
            return None
        rest = self._rest(self._bone, (planned, *(cut.plane for cut in others)))
        both = render_rectified(join_meshes(rest, face), rectified_from_bone, self._geometry, box)
        alone = render_rectified(face, rectified_from_bone, self._geometry, around)
        is_kept = self._is_kept(alone.depth_mm, around, others, rectified_from_bone)
        is_seen = (both.face_index >= len(rest.faces)) & is_kept[box.relative_to(around).slices]
        is_face = shrink(is_seen, RIM_PX)
        n_whole = int(np.count_nonzero(shrink(alone.mask & is_kept, RIM_PX)))
        if np.count_nonzero(is_face) < LEAST_PIXELS:
            return None
        depths_mm = float(corners_mm[:, 2].min()), float(corners_mm[:, 2].max())
        return FaceView(box, is_face, n_whole, depths_mm)

    def _is_kept(
        self,
        depth_mm: NDArray[np.float32],
        box: Box,
        others: Sequence[Cut],
        rectified_from_bone: RigidTransform,
    ) -> NDArray[np.bool_]:
        """(h, w) whether the bone is still there after the other cuts, at those depths."""
        rows, columns = np.nonzero(np.isfinite(depth_mm))
        z = depth_mm[rows, columns].astype(np.float64)
        x = (columns + box.x - self._geometry.centre_x_px) * z / self._geometry.focal_px
        y = (rows + box.y - self._geometry.centre_y_px) * z / self._geometry.focal_px
        points_mm = rectified_from_bone.inverse().apply(np.column_stack([x, y, z]))
        is_gone = np.zeros(len(points_mm), dtype=np.bool_)
        for plane, unsure_mm in others:
            is_gone |= (plane.heights_mm(points_mm) > -unsure_mm) & plane.is_over(points_mm)
        is_kept = np.zeros(depth_mm.shape, dtype=np.bool_)
        is_kept[rows, columns] = ~is_gone
        return is_kept


def _make_rest(bone: BoneModel, made: tuple[ResectionPlane, ...]) -> TriangleMesh:
    """What is left of a bone, to hide what lies behind it."""
    left = remove_cuts(bone, [Cut(plane, 0.0) for plane in made])
    is_left = ~left.is_removed[bone.mesh.faces].any(axis=1)
    return drawn(TriangleMesh(bone.mesh.vertices_mm, bone.mesh.faces[is_left], bone.mesh.normals))
