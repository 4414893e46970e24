"""Edges of a plate as both eyes would measure them, made by projecting them: no pictures."""

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.tools.paper import Paper
from navapp.tools.plate import Plate
from navapp.tools.plate_edges import find_paper_slopes, find_plate_edges
from navapp.tools.plate_fit import Lines, PlateFit, fit_plate

# Measuring and fitting again brings a start a few degrees off to the end.
_ROUNDS = 4
_SMALL_MM = 0.01


class SeenPlate:
    """A plate whose measured edges err as they are told to.

    Args:
        plate: that is seen.
        rig: that looks.
        true: where it is.
        paper: (P,) how the printed paper differs from the design; not at all when absent.
    """

    def __init__(
        self, plate: Plate, rig: StereoRig, true: RigidTransform, paper: FloatArray | None = None
    ) -> None:
        self.edges = find_plate_edges(plate)
        self.by_paper = find_paper_slopes(plate, self.edges)
        self._rig, self._true = rig, true
        given = np.zeros(self.by_paper.shape[2]) if paper is None else paper
        self._printed_mm = self.edges.points_mm + self.by_paper @ given
        self.noise_px = np.zeros((2, len(self.edges.edge)))

    def lines(self, guess: RigidTransform) -> tuple[Lines, Lines]:
        """Of the left and the right eye, for a pose that is thought of."""
        left, right = (self._lines(eye, guess) for eye in (0, 1))
        return left, right

    def fit(self, start: RigidTransform, paper: Paper) -> PlateFit:
        """Measure and fit until the pose stands still."""
        pose = start
        for _ in range(_ROUNDS):
            fit = fit_plate(self._rig, self.lines(pose), pose, paper)
            pose = fit.left_from_plate
        return fit

    def _project(self, eye: int, pose: RigidTransform, points_mm: FloatArray) -> FloatArray:
        in_left = pose.apply(points_mm)
        if eye == 0:
            return self._rig.left.project(in_left)
        return self._rig.right.project(self._rig.right_from_left.apply(in_left))

    def _lines(self, eye: int, guess: RigidTransform) -> Lines:
        edges = self.edges
        places = self._project(eye, guess, edges.points_mm)
        # An edge runs at right angles to its normal, in the face.
        flat = np.cross(edges.normals, _face_normals(edges.normals, edges.face))
        along = self._project(eye, guess, edges.points_mm + _SMALL_MM * flat) - places
        white = self._project(eye, guess, edges.points_mm + _SMALL_MM * edges.normals) - places
        across = np.column_stack([along[:, 1], -along[:, 0]])
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        across *= np.sign((across * white).sum(axis=1, keepdims=True))
        moved = self._project(eye, self._true, self._printed_mm) - places
        offset = (across * moved).sum(axis=1) + self.noise_px[eye]
        return Lines(edges.points_mm, self.by_paper, across, offset, 1.0, edges.edge, edges.side)


def _face_normals(normals: FloatArray, face: NDArray[np.intp]) -> FloatArray:
    """(N, 3) of the faces: at right angles to any two unequal normals of edges in them."""
    found = np.empty_like(normals)
    for number in np.unique(face):
        own = normals[face == number]
        crossed = np.cross(own[0], own)
        best = crossed[np.linalg.norm(crossed, axis=1).argmax()]
        found[face == number] = best / np.linalg.norm(best)
    return found
