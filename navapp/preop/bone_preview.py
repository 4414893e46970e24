"""Draws a bone from three sides, as a picture in the plan folder."""

import numpy as np

from navapp.geometry.camera import Camera
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.transform import RigidTransform
from navapp.geometry.zbuffer import render
from navapp.preop.slices import Picture

_SIZE_PX = 360
_DISTANCE = 6.0

# Rotations camera_from_lps: seen from the front, from the patient's left, and from below.
_VIEWS = (
    ("front", ((1, 0, 0), (0, 0, -1), (0, 1, 0))),
    ("left", ((0, 1, 0), (0, 0, -1), (-1, 0, 0))),
    ("below", ((1, 0, 0), (0, 1, 0), (0, 0, 1))),
)


def draw_preview(mesh: TriangleMesh, slices: Picture | None = None) -> bytes:
    """PNG with three shaded views side by side.

    Args:
        mesh: LPS mm.
        slices: (h, w, 3) BGR to put above them.
    """
    import cv2

    pictures = []
    for title, rotation in _VIEWS:
        picture = _render_shaded(mesh, np.array(rotation, dtype=np.float64))
        cv2.putText(picture, title, (10, 24), cv2.FONT_HERSHEY_SIMPLEX, 0.6, (220, 220, 220), 1)
        pictures.append(picture)
    picture = np.hstack(pictures)
    if slices is not None:
        width = max(slices.shape[1], picture.shape[1])
        picture = np.vstack([
            np.pad(row, ((0, 0), (0, width - row.shape[1]), (0, 0))) for row in (slices, picture)
        ])  # fmt: skip
    _, encoded = cv2.imencode(".png", picture)
    return encoded.tobytes()


def _render_shaded(mesh: TriangleMesh, rotation: np.ndarray) -> np.ndarray:
    extent_mm = float(np.linalg.norm(mesh.size_mm))
    distance_mm = _DISTANCE * extent_mm
    focal_px = 0.95 * _SIZE_PX * _DISTANCE
    half = (_SIZE_PX - 1) / 2.0
    camera = Camera(
        np.array([[focal_px, 0, half], [0, focal_px, half], [0, 0, 1.0]]),
        np.empty(0),
        _SIZE_PX,
        _SIZE_PX,
    )
    centre = 0.5 * (mesh.vertices_mm.min(axis=0) + mesh.vertices_mm.max(axis=0))
    pose = RigidTransform.from_parts(
        "camera", "bone", rotation, np.array([0.0, 0.0, distance_mm]) - rotation @ centre
    )
    view = render(mesh, pose, camera)
    picture = np.full((_SIZE_PX, _SIZE_PX, 3), 24, dtype=np.uint8)
    seen = view.mask
    normals = pose.rotate(mesh.normals[mesh.faces[view.face_index[seen]]].mean(axis=1))
    light = np.clip(normals @ np.array([-0.35, -0.5, -0.79]), 0.0, 1.0)
    picture[seen] = ((0.15 + 0.85 * light)[:, None] * (190, 215, 230)).astype(np.uint8)
    return picture
