"""A bone that another bone, whose pose is known, stands in front of."""

from copy import copy
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.box import Box
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.rectification import RectifiedGeometry
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.geometry.zbuffer import RenderedView, render_rectified
from navapp.registration import RegistrationModel
from navapp.registration.verdict import Agreement
from navapp.tracking.bimcc_tracker import BimccTracker
from navapp.tracking.checks import PairCheck
from navapp.tracking.frame import Fit, Frame
from navapp.tracking.judging import PoseJudge
from navapp.values import DisparityMap

# Both chosen. Windows that reach over the occluder's outline see both bones.
_RIM_PX = 4
# What is measured this much nearer than the occluder is not the occluder.
_NEARER_MM = 1.5


class Occluder:
    """A surface at a known pose, in one pair of pictures.

    Args:
        mesh: closed, its triangles outward.
        rectified_from_mesh: its pose in the rectified left camera.
        geometry: of the rectified pair.
    """

    def __init__(
        self, mesh: TriangleMesh, rectified_from_mesh: RigidTransform, geometry: RectifiedGeometry
    ) -> None:
        import cv2

        self._geometry = geometry
        self._picture = Box(0, 0, geometry.width, geometry.height)
        depth_mm = render_rectified(mesh, rectified_from_mesh, geometry, self._picture).depth_mm
        depth_mm[np.isnan(depth_mm)] = np.inf
        size = 2 * _RIM_PX + 1
        # (h, w) depth with a rim around it; infinite beside it.
        self._depth_mm = cv2.erode(depth_mm, np.ones((size, size), np.uint8))

    def hide(self, view: RenderedView) -> RenderedView:
        """A rendered view of something else without what lies behind the occluder."""
        is_hidden = self._over(view.box) < view.depth_mm
        depth_mm, face_index = view.depth_mm.copy(), view.face_index.copy()
        depth_mm[is_hidden], face_index[is_hidden] = np.nan, -1
        return RenderedView(depth_mm, face_index, view.box)

    def remove(self, found: DisparityMap) -> DisparityMap:
        """A measured map without what was measured on the occluder, or behind its outline."""
        scale = self._geometry.focal_px * self._geometry.baseline_mm
        nearest_px = scale / (self._over(found.box) - _NEARER_MM)
        return found.only((found.origin > 0) & ~(found.disparity_px <= nearest_px))

    def _over(self, box: Box) -> NDArray[np.float32]:
        """(h, w) depth over a box of the rectified left view."""
        depth_mm = np.full((box.height, box.width), np.inf, dtype=np.float32)
        here, there = box.shared_slices(self._picture)
        depth_mm[here] = self._depth_mm[there]
        return depth_mm


class _OccludedModel(RegistrationModel):
    """A bone's model of which an occluder hides a part; it shares all that was made of the bone."""

    def __init__(self, model: RegistrationModel, occluder: Occluder) -> None:
        # Made once for all pairs of pictures.
        _ = model.arrays, model.rendered_mesh, model.rendered_face_sigma_mm, model.hull_mm
        _ = model.thickness
        self.__dict__.update(model.__dict__)
        self._occluder = occluder

    def render(
        self,
        camera_from_bone: RigidTransform,
        geometry: RectifiedGeometry,
        box: Box,
        *,
        has_lid: bool = False,
    ) -> RenderedView:
        """As of the model, without what lies behind the occluder."""
        return self._occluder.hide(super().render(camera_from_bone, geometry, box, has_lid=has_lid))


class _HiddenBoneJudge(PoseJudge):
    """Judges poses of a bone behind an occluder, never less strictly than poses of the whole bone.

    Their covariance grows by how far the places spread where the bone may rest as well: tissue that
    lies flush with a bone holds it at several, and no residual of one tells. What the occluder
    hides counts as hidden when it is asked whether the bone lies in the open.
    """

    def __init__(self, tracker: BimccTracker, whole: RegistrationModel, spread: FloatArray) -> None:
        super().__init__(tracker.meter, tracker.settings)
        self._whole, self._geometry, self._spread = whole, tracker.meter.geometry, spread

    def _settle(
        self, frame: Frame, fit: Fit, check: PairCheck, counts_unmeasured: bool
    ) -> tuple[Fit, RenderedView | None, Agreement | None]:
        """As of any judge, then grown."""
        fit, view, agreement = super()._settle(frame, fit, check, counts_unmeasured)
        covariance = fit.estimate.covariance + self._spread
        return replace(fit, estimate=replace(fit.estimate, covariance=covariance)), view, agreement

    def _noise_variance_ratio(self, fit: Fit, agreement: Agreement) -> float:
        """As of any judge, but what the occluder hides of the whole bone counts as hidden."""
        whole = self._whole.render(fit.pose, self._geometry, fit.measured.disparity.box)
        share = agreement.n_visible / max(int(np.count_nonzero(whole.mask)), 1)
        if agreement.coverage * share <= 1.0 - share * (1.0 - agreement.hidden_fraction):
            return 1.0
        return super()._noise_variance_ratio(fit, agreement)


class OccludedTracker(BimccTracker):
    """A tracker of a bone for one pair of pictures, in which a known surface stands before it.

    Where the occluder is, the bone is not matched, and what it hides of the bone is neither
    expected nor held against a pose. For glances, and for searches that take the occluder out of
    what they measure freely (`Occluder.remove`).

    Args:
        tracker: of the bone, for any pair.
        mesh: of the occluder, closed, its triangles outward.
        left_from_mesh: the occluder's pose in the pair.
        spread: (6, 6) as a `FoundTibia` tells; None when that is not known.

    Attributes:
        occluder: that surface.
    """

    def __init__(
        self,
        tracker: BimccTracker,
        mesh: TriangleMesh,
        left_from_mesh: RigidTransform,
        spread: FloatArray | None = None,
    ) -> None:
        geometry = tracker.meter.geometry
        self.occluder = Occluder(mesh, tracker.rectify_pose(left_from_mesh), geometry)
        meter = copy(tracker.meter)
        meter.model = _OccludedModel(tracker.meter.model, self.occluder)
        meter.leaves_out_outlines = True
        super().__init__(meter.rectifier.rig, tracker.model.bone, tracker.settings, meter=meter)
        self._whole = tracker.model
        self.judge = self.judge_with(np.zeros((6, 6)) if spread is None else spread)

    def judge_with(self, spread: FloatArray) -> PoseJudge:
        """The judge of poses that spread so."""
        return _HiddenBoneJudge(self, self._whole, spread)
