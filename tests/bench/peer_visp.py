"""ViSP's model-based tracker on the bone's texture, in a program of its own (`make peers-visp`)."""

import subprocess
import sys
import tempfile
import weakref
from pathlib import Path

import fast_simplification
import numpy as np

from drivers.frames import StereoFrame
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.rectification import rectifier_of
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import RigidTransform

PROGRAM = Path(sys.prefix, "bin", "visp_surface_tracker")


class VispTracker:
    """Follows points on the faces of a coarse model in both pictures.

    Args:
        rig: that takes the pictures.
        surface: of the bone.
        frame: the first pair.
        pose: left camera from bone in it.
        n_faces: of the coarse model, whose faces ViSP takes for planes.
    """

    def __init__(
        self,
        rig: StereoRig,
        surface: TriangleMesh,
        frame: StereoFrame,
        pose: RigidTransform,
        n_faces: int,
    ) -> None:
        self._rectifier, self._bone = rectifier_of(rig), pose.source
        geometry = self._rectifier.geometry
        folder = tempfile.TemporaryDirectory()
        model = Path(folder.name, "bone.cao")
        model.write_text(format_cao(surface, n_faces))
        values = (
            geometry.focal_px, geometry.centre_x_px, geometry.centre_y_px, geometry.width,
            geometry.height, geometry.baseline_mm / 1e3, model,
        )  # fmt: skip
        self._process = subprocess.Popen(
            [str(PROGRAM), *map(str, values)], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )  # fmt: skip
        weakref.finalize(self, _end, self._process, folder)
        start = np.array((geometry.rectified_from_left @ pose).matrix)
        start[:3, 3] /= 1e3
        self._send((" ".join(f"{value:.12g}" for value in start.ravel()) + "\n").encode())
        self._send_pair(frame)

    def __call__(self, frame: StereoFrame) -> RigidTransform | None:
        """The pose in the next pair; None: lost."""
        self._send_pair(frame)
        assert self._process.stdout is not None
        words = self._process.stdout.readline().split()
        if len(words) != 16:
            if words != [b"lost"]:
                raise RuntimeError(f"{PROGRAM} ended without a pose: run `make peers-visp` again")
            return None
        matrix = np.array(words, dtype=float).reshape(4, 4)
        matrix[:3, 3] *= 1e3
        left_from_rectified = self._rectifier.geometry.rectified_from_left.inverse()
        return left_from_rectified @ RigidTransform(left_from_rectified.source, self._bone, matrix)

    def _send_pair(self, frame: StereoFrame) -> None:
        pair = self._rectifier.rectify(frame.left, frame.right, is_grey=True)
        self._send(pair.left.tobytes() + pair.right.tobytes())

    def _send(self, content: bytes) -> None:
        assert self._process.stdin is not None
        self._process.stdin.write(content)
        self._process.stdin.flush()


def format_cao(surface: TriangleMesh, n_faces: int) -> str:
    """A surface, simplified to so many triangles, as the text of a model file of ViSP; in m."""
    points_mm, faces = fast_simplification.simplify(
        np.array(surface.vertices_mm, dtype=np.float32),
        np.array(surface.faces, dtype=np.int32),
        target_count=n_faces,
    )
    points = [f"{x:.8f} {y:.8f} {z:.8f}" for x, y, z in points_mm / 1e3]
    triangles = [f"3 {a} {b} {c}" for a, b, c in faces]
    # Points, lines, faces by lines, faces by points, cylinders, circles.
    parts = ["V1", str(len(points)), *points, "0", "0", str(len(triangles)), *triangles, "0", "0"]
    return "\n".join(parts) + "\n"


def _end(process: "subprocess.Popen[bytes]", folder: "tempfile.TemporaryDirectory[str]") -> None:
    process.kill()
    process.communicate()
    folder.cleanup()
