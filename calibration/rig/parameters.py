"""The numbers of a rig that a calibration solves for, in one vector.

left fx fy cx cy k..., right fx fy cx cy k..., rotation vector and translation of
right_from_left, and where it is asked for x y z of every mark of the board: how far it is from
where it should have been printed
"""

from dataclasses import dataclass

import cv2
import numpy as np

from navapp.geometry.camera import Camera
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import FloatArray, RigidTransform

# Coefficients of OpenCV's polynomial: k1 k2 p1 p2, with k3, with k4 k5 k6, with thin prisms.
N_COEFFICIENTS = (4, 5, 8, 12)


@dataclass(frozen=True, slots=True)
class RigModel:
    """Which parameters of a rig are solved for."""

    n_coefficients: int  # of each lens, one of `N_COEFFICIENTS`
    n_marks: int  # of the board, whose places are solved for as well; 0: it is as it should be
    # width, height: of a picture, px.
    width: int
    height: int

    @property
    def n_camera(self) -> int:
        """Numbers of one camera."""
        return 4 + self.n_coefficients

    @property
    def n_rig(self) -> int:
        """Numbers of the rig, without the board's."""
        return 2 * self.n_camera + 6

    @property
    def n_shared(self) -> int:
        """Numbers that all views share."""
        return self.n_rig + 3 * self.n_marks

    @property
    def name(self) -> str:
        """For people."""
        board = "with the board's own shape" if self.n_marks else "flat board"
        return f"{self.n_coefficients} coefficients, {board}"


def pack(model: RigModel, rig: StereoRig) -> FloatArray:
    """(n_shared,) numbers of a rig, with a board as it should be."""
    shared = np.zeros(model.n_shared)
    for number, camera in enumerate((rig.left, rig.right)):
        part = shared[number * model.n_camera : (number + 1) * model.n_camera]
        matrix = camera.matrix
        part[:4] = matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2]
        n = min(model.n_coefficients, camera.distortion.size)
        part[4 : 4 + n] = camera.distortion[:n]
    place = 2 * model.n_camera
    shared[place : place + 3] = cv2.Rodrigues(np.array(rig.right_from_left.rotation))[0].ravel()
    shared[place + 3 : place + 6] = rig.right_from_left.translation_mm
    return shared


def unpack(model: RigModel, shared: FloatArray) -> StereoRig:
    """The rig of such numbers.

    Raises:
        ValueError: no rig has these numbers.
    """
    cameras = []
    for number in range(2):
        matrix, distortion = unpack_lens(model, shared, number)
        cameras.append(Camera(matrix, distortion, model.width, model.height))
    rotation, translation_mm = unpack_placement(model, shared)
    pose = RigidTransform.from_parts("right", "left", cv2.Rodrigues(rotation)[0], translation_mm)
    return StereoRig(cameras[0], cameras[1], pose)


def unpack_lens(model: RigModel, shared: FloatArray, number: int) -> tuple[FloatArray, FloatArray]:
    """(3, 3) matrix and (n,) distortion of the left (0) or right (1) camera."""
    part = shared[number * model.n_camera : (number + 1) * model.n_camera]
    matrix = np.array([[part[0], 0.0, part[2]], [0.0, part[1], part[3]], [0.0, 0.0, 1.0]])
    return matrix, part[4:].copy()


def unpack_placement(model: RigModel, shared: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Rotation vector (3,) and translation (3,) mm of right_from_left."""
    place = 2 * model.n_camera
    return shared[place : place + 3].copy(), shared[place + 3 : place + 6].copy()


def unpack_shape_mm(model: RigModel, shared: FloatArray) -> FloatArray:
    """(n_marks, 3) how far the marks are from where they should have been printed."""
    return shared[model.n_rig :].reshape(-1, 3)
