"""The pictures for the screen and for the display, from what the session knows."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from navapp.control.mirror_error import MirrorError
from navapp.control.states import SessionState, Snapshot
from navapp.geometry.box import Box
from navapp.geometry.display_model_view import EyeView
from navapp.geometry.mesh import TriangleMesh
from navapp.geometry.rectification import rectifier_of
from navapp.geometry.rig import StereoRig
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.overlay import LeftView, MirrorView, Scene, Viewpoint, compose_mirror, compose_video
from navapp.overlay.residuals import draw_residuals, measure_residuals_mm
from navapp.tools.patient_check import CheckAnswer
from navapp.values import Foreground, OverlayMode, Plan, Reason, Status

Image = NDArray[np.uint8]

_AROUND_PX = 30  # that a candidate's picture shows around the bone


@dataclass(frozen=True, slots=True, eq=False)
class OperatorPicture:
    """The picture for the operator's screen: of the left camera, or of a simulated eye."""

    drawn: Image  # (H, W, 3) uint8 BGR, with what was drawn over it
    plain: Image | None = None  # the same without guides; None when it has none
    is_of_eye: bool = False  # what an eye sees in a simulated mirror
    left: Image | None = None  # the left picture that came with it, as it is
    # of a candidate: how far the measured surface lies from the model.
    residuals: Image | None = None
    # of several candidates that wait for a decision: each by its number.
    candidates: Mapping[int, Image] = field(default_factory=dict)


class Composer:
    """Composes the pictures of a session.

    Args:
        rig: whose left camera takes the pictures.
        plan: what to draw.
        eye_view: of a display in the mirror; None: the display shows the video.
    """

    def __init__(self, rig: StereoRig, plan: Plan, eye_view: EyeView | None = None) -> None:
        self._plan = plan
        self._left_view = LeftView(rig)
        self._geometry = rectifier_of(rig).geometry
        self._mirror_view = None if eye_view is None else MirrorView(eye_view, rig)

    @property
    def mirror_view(self) -> MirrorView | None:
        """Of the eye that looks into the mirror; None over video."""
        return self._mirror_view

    @property
    def mode(self) -> OverlayMode:
        """What the display shows."""
        return OverlayMode.VIDEO if self._mirror_view is None else OverlayMode.MIRROR

    def compose_video(
        self,
        left: Image,
        snapshot: Snapshot,
        mark: str,
        foreground: Foreground | None = None,
        point_mm: FloatArray | None = None,
    ) -> Image:
        """The left picture with guides, a marked candidate, or the reason why there are none.

        Args:
            left: picture of the frame that the snapshot's pose belongs to.
            snapshot: its `reasons` decide; nothing else does.
            mark: words for the corner.
            foreground: what was measured of the depth around the bone in that frame.
            point_mm: (3,) in the left camera's frame, where the cross of a check of the mirror
                belongs.
        """
        scene = _scene(snapshot, self._left_view, self._plan, foreground)
        cross_px = None
        is_ok = snapshot.verdict is not None and snapshot.verdict.status is Status.OK
        if point_mm is not None and is_ok:
            cross_px = self._left_view.camera.project(point_mm[None])[0]
        return compose_video(left, scene, banner(snapshot), mark, cross_px)

    def draw_candidate(
        self, left: Image, left_from_bone: RigidTransform, status: Status, snapshot: Snapshot
    ) -> Image | None:
        """The left picture around the stage's bone at a pose; None where that is out of sight.

        Args:
            left: picture of a frame.
            left_from_bone: the pose.
            status: the judge's word on it: of a lost one no outline is drawn.
            snapshot: of that frame.
        """
        bone = snapshot.stage.bone
        camera = self._left_view.camera
        surface = snapshot.bone_surface or _seen_surface(self._plan, bone)
        box = Box.around(camera.project(left_from_bone.apply(surface.vertices_mm)))
        part = None if box is None else box.grow(_AROUND_PX).clip(camera.width, camera.height)
        if part is None or part.is_empty:
            return None
        scene = Scene(
            self._plan,
            snapshot.stage,
            left_from_bone,
            self._left_view,
            is_candidate=True,
            layers=("bone",),
            surface=snapshot.bone_surface,
        )
        is_lost = status is Status.LOST
        return compose_video(left, None if is_lost else scene, "")[part.slices]

    def draw_residuals(
        self,
        foreground: Foreground,
        left_from_bone: RigidTransform,
        bone: str,
        surface: TriangleMesh | None,
    ) -> Image:
        """How far the measured surface lies from a bone's model at a pose.

        Args:
            foreground: of that pose's frame.
            left_from_bone: the pose.
            bone: its name in the plan.
            surface: what is left of it; None: all.
        """
        pose = self._geometry.rectified_from_left @ left_from_bone
        seen = surface or _seen_surface(self._plan, bone)
        residual_mm = measure_residuals_mm(foreground, pose, seen, self._geometry)
        return draw_residuals(residual_mm, foreground.surroundings.picture)

    def compose_mirror(
        self, snapshot: Snapshot, foreground: Foreground | None, cross_px: FloatArray | None
    ) -> Image:
        """Guides, or the cross of a check, and status on black, for the display in the mirror.

        Args:
            snapshot: as of `compose_video`; candidates are not shown.
            foreground: as of `compose_video`.
            cross_px: (2,) where the cross of a check lies as the eye reads the picture; it is shown
                when nothing but the check is against guides.
        """
        view = self._mirror_view
        if view is None:
            raise ValueError("no display in the mirror")
        is_checkable = snapshot.reasons == (snapshot.mirror_reason,)
        scene = None
        if snapshot.is_navigable:
            error = snapshot.mirror_error
            unlit = () if error is None else error.unlit_layers
            seen = tuple(name for name in snapshot.layers if name not in unlit)
            snapshot = replace(snapshot, layers=seen)
            scene = _scene(snapshot, view, self._plan, foreground)
        return compose_mirror(
            scene,
            view.eye_view,
            banner(snapshot),
            is_guiding=snapshot.is_navigable,
            cross_px=cross_px if is_checkable else None,
        )


@lru_cache(maxsize=3)
def _seen_surface(plan: Plan, bone: str) -> TriangleMesh:
    # Once, not with every frame.
    return plan.bones[bone].make_seen_surface()


def banner(snapshot: Snapshot) -> str:
    """One line: what the picture is."""
    stage = f"{snapshot.stage.number} {snapshot.stage.name}"
    if snapshot.is_navigable and snapshot.verdict is not None:
        return f"{stage} - NAVIGATING{_describe_error(snapshot)} - {_describe_check(snapshot)}"
    if snapshot.cross_check is not None and snapshot.reasons == (snapshot.mirror_reason,):
        check = snapshot.cross_check
        return f"{stage} - CHECK OF THE MIRROR: cross {check.number + 1} of {check.count}"
    if snapshot.is_candidate and _is_lost(snapshot):
        return f"{stage} - CANDIDATE refused by the judge"
    if snapshot.is_candidate:
        return f"{stage} - CANDIDATE, not accepted"
    why = snapshot.reasons[0].value if snapshot.reasons else ""
    if snapshot.reasons[:1] == (Reason.OTHER_EYE,) and snapshot.mirror_error is not None:
        why = f"{why}: cover it, or {_describe_shift(snapshot.mirror_error)}"
    return f"{stage} - NO GUIDES: {why}"


def _describe_check(snapshot: Snapshot) -> str:
    """What is known from the patient of the registration in force."""
    check = snapshot.patient_check
    if check is None or not check.is_valid or check.result is None:
        return "not verified on the patient"
    match check.answer:
        case CheckAnswer.PASSED:
            return f"checked on the patient: {check.result.most_mm:.1f} mm at most"
        case CheckAnswer.FAILED:
            return "CHECK ON THE PATIENT FAILED"
        case CheckAnswer.CANNOT_TELL:
            return "the check on the patient could not tell"
    return f"check on the patient: {check.n_touches} points, more are needed"


def _describe_error(snapshot: Snapshot) -> str:
    """Of guides that are shown: over the video that of the pose, in the mirror of what is seen."""
    if not snapshot.has_mirror:
        bound_mm = None if snapshot.verdict is None else snapshot.verdict.predicted_tre_mm
        return "" if bound_mm is None else f" - error <= {bound_mm:.2f} mm"
    error = snapshot.mirror_error
    if error is None:
        return ""
    told = f" - error <= {error.bound_mm:.1f} mm"
    if error.covered_eye:
        told += f", {error.covered_eye} eye covered"
    if error.inexact_layers:
        told += f" - not shown, perhaps too far off: {', '.join(error.inexact_layers)}"
    if error.off_layers:
        off = ", ".join(error.off_layers)
        told += f" - not shown, off for the other eye: {off} ({_describe_shift(error)})"
    return told


def _describe_shift(error: MirrorError) -> str:
    """By how much the display must move to be right for both eyes."""
    way = "away" if error.screen_shift_mm > 0.0 else "nearer"
    return f"bring the picture {abs(error.screen_shift_mm):.0f} mm {way}"


def _scene(
    snapshot: Snapshot, viewpoint: Viewpoint, plan: Plan, foreground: Foreground | None
) -> Scene | None:
    """What may be drawn; None for no guides."""
    is_reviewed = snapshot.state is SessionState.REVIEW and not snapshot.is_blanked
    is_candidate = is_reviewed and not _is_lost(snapshot)
    pose = snapshot.left_from_bone
    if pose is None or snapshot.stage.bone not in plan.bones:
        return None
    if not (snapshot.is_navigable or is_candidate):
        return None
    return Scene(
        plan,
        snapshot.stage,
        pose,
        viewpoint,
        is_candidate,
        foreground,
        snapshot.layers,
        snapshot.bone_surface,
        frozenset(step.name for step in snapshot.steps if step.is_made),
    )


def _is_lost(snapshot: Snapshot) -> bool:
    return snapshot.verdict is None or snapshot.verdict.status is Status.LOST
