"""A pair of pictures -> the pose of a plate, or why there is none."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.geometry.triangulation import triangulate_mm
from navapp.tools.edge_kernels import locate_edges
from navapp.tools.marker_finder import Box, MarkerFinder, SeenMarkers
from navapp.tools.paper import Paper, as_designed
from navapp.tools.plate import Plate
from navapp.tools.plate_edges import find_paper_slopes, find_plate_edges
from navapp.tools.plate_fit import (
    Lines,
    PlateFit,
    compute_picture_slopes,
    fit_plate,
    view,
)

# Faces turned away further than this are not looked at.
_LEAST_FACING = 0.26
# Edges nearer to each other than this cannot be told apart; places looked at across an edge.
_BLUR_REACH_PX, _LEAST_END_PX, _LEAST_REACH_PX, _MOST_REACH_PX = 1.5, 1.2, 1.5, 4.0
_LEAST_CONTRAST, _CONTRAST_SHARE, _LEFT_SHARE = 5.0, 0.4, 0.35
_NEAREST_MM = 50.0
_CORNER_ROUNDS, _EDGE_ROUNDS = 2, 2
# A marker is seen when so much of its inside agrees, a plate when so much of its edges does.
_SEEN_INSIDE, _SEEN_SHARE, _INSIDE_SHARE, _MOST_SIGMA_PX = 0.85, 0.2, 0.7, 0.35


@dataclass(frozen=True, slots=True, eq=False)
class PlatePose:
    """Where a plate is."""

    left_from_plate: RigidTransform
    covariance: FloatArray  # (6, 6) twist about the plate's origin, left camera's axes; mm, rad
    seen_share: float  # of the edges on faces that are turned towards the cameras
    fit: PlateFit


class PlateMeter:
    """Measures one plate.

    Args:
        plate: that the tool carries.
        rig: that looks.
        paper: what is known of the plate's paper; as it was designed when absent.
    """

    def __init__(self, plate: Plate, rig: StereoRig, paper: Paper | None = None) -> None:
        self.plate, self.rig = plate, rig
        self._paper = paper or as_designed(plate)
        self._finder = MarkerFinder(plate)
        self._edges = find_plate_edges(plate)
        faces = plate.plate_from_faces
        self._axes = np.transpose(faces[self._edges.face, :3, :2], (0, 2, 1))
        self._by_paper = find_paper_slopes(plate, self._edges)
        self._n_markers = len(plate.ids)

    def measure(
        self,
        pictures: tuple[NDArray[np.uint8], NDArray[np.uint8]],
        boxes: tuple[Box | None, Box | None] = (None, None),
    ) -> PlatePose | str:
        """The pose in one pair of pictures.

        Args:
            pictures: (H, W) grey, left and right, not rectified.
            boxes: where to look for markers.

        Returns:
            A word on what is missing where the plate is not seen well enough.
        """
        seen = [
            self._finder.find(picture, box) for picture, box in zip(pictures, boxes, strict=True)
        ]
        start = self._start(seen[0], seen[1])
        if start is None:
            return "no marker is seen by both cameras"
        pose = start
        for _ in range(_EDGE_ROUNDS):
            chosen = [self._locate(eye, pictures[eye], pose) for eye in range(2)]
            lines = (chosen[0].lines, chosen[1].lines)
            if min(len(one.offset_px) for one in lines) < 20:
                return "too few edges are seen"
            fit = fit_plate(self.rig, lines, pose, self._paper)
            pose = fit.left_from_plate
        return self._judge(fit, chosen)

    def _start(self, left: SeenMarkers, right: SeenMarkers) -> RigidTransform | None:
        """From the corners of markers that both eyes see."""
        common = np.intersect1d(left.markers, right.markers)
        if len(common) == 0:
            return None
        pixels = [
            one.corners_px[np.isin(one.markers, common)].reshape(-1, 2) for one in (left, right)
        ]
        points = self.plate.corners_mm[common].reshape(-1, 3)
        seen = triangulate_mm(self.rig, pixels[0], pixels[1])
        # Markers that are mistaken for each other's lie at no depth, or have no plate's shape.
        if not (np.isfinite(seen).all() and (seen[:, 2] > _NEAREST_MM).all()):
            return None
        pose = RigidTransform.fit("left", "plate", seen, points)
        if np.linalg.norm(pose.apply(points) - seen, axis=1).max() > self.plate.marker_mm:
            return None
        for _ in range(_CORNER_ROUNDS):
            both = [self._corner_lines(eye, points, pixels[eye], pose) for eye in range(2)]
            pose = fit_plate(self.rig, (both[0], both[1]), pose, self._paper).left_from_plate
        return pose

    def _corner_lines(
        self,
        eye: int,
        points: FloatArray,
        pixels: FloatArray,
        pose: RigidTransform,
    ) -> Lines:
        camera, eye_from_left = view(self.rig, eye)
        off = pixels - camera.project(eye_from_left.apply(pose.apply(points)))
        n = len(points)
        return Lines(
            np.tile(points, (2, 1)),
            np.zeros((2 * n, 3, len(self._paper.mean))),
            np.repeat(np.eye(2), n, axis=0),
            off.T.ravel(),
            0.0,
            np.arange(2 * n),
            np.zeros(2 * n, dtype=np.intp),
        )

    def _locate(self, eye: int, picture: NDArray[np.uint8], pose: RigidTransform) -> "_Located":
        """Edges of the faces that this eye sees."""
        expected = self._expect(eye, pose)
        told = np.empty((len(expected.shown), 3))
        locate_edges(picture, expected.places_px, expected.steps_px, expected.reach_px, told)
        offset_px, contrast, left_grey = told.T
        found = np.isfinite(offset_px) & (contrast > _LEAST_CONTRAST)
        if found.any():
            usual = float(np.median(contrast[found]))
            found[found] &= contrast[found] > _CONTRAST_SHARE * usual
        found[found] &= left_grey[found] < _LEFT_SHARE * contrast[found]
        kept = expected.shown[found]
        lines = Lines(
            self._edges.points_mm[kept],
            self._by_paper[kept],
            expected.across_px[found],
            offset_px[found],
            1.0,
            self._edges.edge[kept],
            self._edges.side[kept],
        )
        return _Located(lines, expected.shown, kept)

    def _expect(self, eye: int, pose: RigidTransform) -> "_Expected":
        """Where an eye sees edges at a pose: those far enough from other edges and from ends."""
        edges = self._edges
        camera, eye_from_left = view(self.rig, eye)
        eye_from_plate = eye_from_left @ pose
        in_eye = eye_from_plate.apply(edges.points_mm)
        away = np.cross(self._axes[:, 0], self._axes[:, 1])
        facing = np.einsum("nj,nj->n", eye_from_plate.rotate(away), in_eye)
        facing /= np.linalg.norm(in_eye, axis=1)
        slopes = compute_picture_slopes(camera, in_eye)
        normals = np.einsum("nij,nj->ni", slopes, eye_from_plate.rotate(edges.normals))
        tangents = np.cross(away, edges.normals)
        tangents = np.einsum("nij,nj->ni", slopes, eye_from_plate.rotate(tangents))
        across = np.column_stack([tangents[:, 1], -tangents[:, 0]])
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        along = np.einsum("ni,ni->n", across, normals)
        across *= np.sign(along)[:, None]
        reach = np.minimum(edges.clear_mm * np.abs(along) - _BLUR_REACH_PX, _MOST_REACH_PX)
        is_shown = (facing > _LEAST_FACING) & (reach >= _LEAST_REACH_PX)
        is_shown &= edges.end_mm * np.linalg.norm(tangents, axis=1) >= _LEAST_END_PX
        shown = np.flatnonzero(is_shown)
        return _Expected(
            shown,
            np.ascontiguousarray(camera.project(in_eye[shown])),
            across[shown],
            # Looked along the plate's own normal: it stays beside the edge however slanted it is.
            np.ascontiguousarray(normals[shown] / np.abs(along[shown])[:, None]),
            np.ascontiguousarray(reach[shown]),
        )

    def _judge(self, fit: PlateFit, chosen: list["_Located"]) -> PlatePose | str:
        """Whether what agrees is enough, and the right plate."""
        if fit.sigma_px > _MOST_SIGMA_PX:
            return "edges do not agree"
        n_left = len(chosen[0].kept)
        shares = []
        for eye, agree in enumerate(np.split(fit.weights > 0.05, [n_left])):
            share = self._judge_eye(chosen[eye], agree)
            if isinstance(share, str):
                return share
            shares.append(share)
        return PlatePose(fit.left_from_plate, fit.covariance, min(shares), fit)

    def _judge_eye(self, located: "_Located", agree: NDArray[np.bool_]) -> float | str:
        good = np.zeros(len(self._edges.edge), dtype=bool)
        good[located.kept[agree]] = True
        inside = ~self._edges.is_border[located.shown]
        is_good, marker = good[located.shown], self._edges.marker[located.shown]
        share = float(is_good.mean())
        if share < _SEEN_SHARE:
            return "too few edges are seen"
        n_inside = np.bincount(marker[inside], minlength=self._n_markers)
        n_good = np.bincount(marker[inside & is_good], minlength=self._n_markers)
        if not (n_good >= _SEEN_INSIDE * np.maximum(n_inside, 1)).any():
            return "no marker is seen whole"
        # Of a plate that is mostly covered, perhaps no border is in sight.
        around = is_good[~inside]
        if len(around) and is_good[inside].mean() < _INSIDE_SHARE * around.mean():
            return "another plate's markers"
        return share


@dataclass(frozen=True, slots=True, eq=False)
class _Expected:
    """Edges as one eye should see them."""

    shown: NDArray[np.intp]  # (n,) places that can be seen
    places_px: FloatArray  # (n, 2)
    across_px: FloatArray  # (n, 2) unit, at right angles to the edge, towards white
    steps_px: FloatArray  # (n, 2) to 1 px beyond the edge
    reach_px: FloatArray  # (n,) how far it is looked, at right angles to the edge


@dataclass(frozen=True, slots=True, eq=False)
class _Located:
    """Edges found in one picture."""

    lines: Lines
    shown: NDArray[np.intp]  # places that can be seen at this pose
    kept: NDArray[np.intp]  # of these, where an edge was found
