"""Shows what a frame has brought: on the display, and on the operator's screen."""

import time
from dataclasses import replace

from drivers.frames import StereoFrame
from navapp.control.candidate_pictures import CandidatePictures
from navapp.control.display_link import DisplayLink
from navapp.control.eye_preview import EyePreview
from navapp.control.interlocks import describe_slowness, is_too_slow
from navapp.control.mirror_checking import MirrorChecking
from navapp.control.pictures import Composer, Image, OperatorPicture
from navapp.control.session import Session
from navapp.control.states import (
    EventLevel,
    SessionState,
    Snapshot,
)
from navapp.geometry.transform import FloatArray, RigidTransform
from navapp.overlay import DepthMarks
from navapp.values import Foreground, OverlayMode, OverlayPicture, Reason


class FramePresenter:
    """Composes and shows the pictures of frames, and takes guides back that have become wrong.

    Args:
        session: whose frames they are; it is told what came too late.
        display: shows them.
        composer: draws them.
        mirror_checking: whose crosses are shown.
        eye: looks into a simulated mirror for the operator.
        depth_marks: colour the operator's picture.
        valid_ms: a picture stays so long after its capture.
    """

    def __init__(
        self,
        session: Session,
        display: DisplayLink,
        composer: Composer,
        mirror_checking: MirrorChecking,
        eye: EyePreview,
        depth_marks: DepthMarks,
        valid_ms: float,
    ) -> None:
        self._session, self._display, self._composer = session, display, composer
        self._mirror_checking, self._eye, self._depth_marks = mirror_checking, eye, depth_marks
        self._valid_ms = valid_ms
        self._candidate_pictures = CandidatePictures(composer)
        self._is_late = self._is_told_slow = False

    def show(self, frame: StereoFrame, snapshot: Snapshot) -> tuple[OverlayPicture, float]:
        """Compose, show until it expires, keep it for the screen; also how long composing took."""
        started_ns = time.perf_counter_ns()
        self._is_told_slow &= is_too_slow(snapshot)
        mark = "SIMULATED" if snapshot.is_simulated else ""
        tracked = self._session.tracked
        foreground = None if tracked is None else tracked.foreground
        pose = snapshot.left_from_bone
        point_mm = None if pose is None else self._mirror_checking.point_mm(pose)
        if point_mm is None and pose is not None:
            point_mm = _find_wanted(snapshot, pose)
        video = self._composer.compose_video(frame.left, snapshot, mark, foreground, point_mm)
        image = video
        if self._composer.mode is OverlayMode.MIRROR:
            image = self._compose_mirror(snapshot, foreground)
        overlay_ms = (time.perf_counter_ns() - started_ns) / 1e6
        valid_until_ns = frame.captured_ns + round(self._valid_ms * 1e6)
        has_guides = snapshot.is_navigable or snapshot.is_candidate
        is_scaled = self._composer.mode is OverlayMode.VIDEO
        is_checked = snapshot.reasons == (snapshot.mirror_reason,)
        has_cross = is_checked and snapshot.cross_check is not None
        # The screen shows the live picture in a fault as well, the display shows nothing; nor does
        # it when what would be seen on it is not what is shown.
        is_shown = snapshot.state is not SessionState.FAULT and not snapshot.device_reasons
        is_lit = is_shown and bool(snapshot.is_navigable if snapshot.has_mirror else has_guides)
        is_lit = is_lit or (is_shown and has_cross)
        if is_shown and self._display.show(
            image, valid_until_ns, has_guides=is_lit, is_scaled=is_scaled
        ):
            self._session.add_event("device", self._display.trouble, EventLevel.ALARM)
        # A picture that has expired on its way is not shown by any display.
        age_ns = self._session.now_ns - frame.captured_ns
        is_seen = not (self._display.is_blanked or self._display.trouble)
        if is_shown and has_cross and is_seen and age_ns / 1e6 < self._valid_ms:
            self._mirror_checking.note_shown()
        self._keep_picture(frame, video, snapshot, foreground)
        self._tell_late(age_ns / 1e6, is_lit)
        return OverlayPicture(image, valid_until_ns, self._composer.mode, age_ns), overlay_ms

    def withdraw(self, before: Snapshot, after: Snapshot) -> None:
        """Turn guides dark that may not be shown any more, after a command or with time."""
        if after.is_navigable or after.is_candidate:
            return
        is_same_cross = after.cross_check == before.cross_check is not None
        if not is_same_cross and self._display.withdraw_guides():
            self._tell_withdrawn(after)

    def _keep_picture(
        self, frame: StereoFrame, video: Image, snapshot: Snapshot, foreground: Foreground | None
    ) -> None:
        """The operator's picture; a candidate is judged over the video, whatever is switched on."""
        session = self._session
        seen = self._eye.update(
            session.now_ns, has_guides=snapshot.is_navigable, is_hidden=snapshot.is_candidate
        )
        if seen is not None:
            session.keep_picture(OperatorPicture(*seen, is_of_eye=True, left=frame.left))
            return
        has_guides = snapshot.is_navigable or snapshot.is_candidate
        drawn = self._depth_marks.draw(video, foreground) if session.shows_depth else video
        plain = frame.left if has_guides else None
        residuals = self._draw_residuals(snapshot, foreground) if snapshot.is_candidate else None
        others = self._candidate_pictures.update(frame.left, snapshot, session.candidates)
        session.keep_picture(OperatorPicture(drawn, plain, False, frame.left, residuals, others))

    def _draw_residuals(self, snapshot: Snapshot, foreground: Foreground | None) -> Image | None:
        """What a candidate is judged by beside its outline."""
        pose = snapshot.left_from_bone
        if pose is None or foreground is None or foreground.box.is_empty:
            return None
        return self._composer.draw_residuals(
            foreground, pose, snapshot.stage.bone, snapshot.bone_surface
        )

    def _compose_mirror(self, snapshot: Snapshot, foreground: Foreground | None) -> Image:
        """Guides where the bone will be when their light is seen."""
        if snapshot.is_navigable:
            snapshot = replace(snapshot, left_from_bone=snapshot.pose_at_light)
        pose = snapshot.left_from_bone
        cross_px = None if pose is None else self._mirror_checking.cross_px(pose)
        return self._composer.compose_mirror(snapshot, foreground, cross_px)

    def _tell_withdrawn(self, snapshot: Snapshot) -> None:
        """Guides went out between two frames; what commands do is told by the commands."""
        reasons = snapshot.reasons
        if reasons[:1] == (Reason.TOO_SLOW,):
            if not self._is_told_slow:
                text = f"no guides: {describe_slowness(snapshot)}"
                self._session.add_event("display", text, EventLevel.WARNING)
            self._is_told_slow = True
            return
        # What came too late was never seen.
        if (
            not self._is_late
            and reasons
            and reasons[0] in (Reason.POSE_TOO_OLD, Reason.CAMERA_SILENT)
        ):
            text = f"guides withdrawn: {reasons[0].value}"
            self._session.add_event("display", text, EventLevel.WARNING)

    def _tell_late(self, age_ms: float, has_guides: bool) -> None:
        """A picture that was too old when it was ready is not shown: told once, until one is."""
        is_late = has_guides and age_ms >= self._valid_ms
        if is_late and not self._is_late:
            text = f"the display stays dark: the picture was {age_ms:.0f} ms old when it was ready"
            text += f", {self._valid_ms:.0f} ms are allowed"
            self._session.add_event("display", text, EventLevel.WARNING)
        elif self._is_late and has_guides and not is_late:
            self._session.add_event("display", "pictures are ready in time again")
        self._is_late = is_late if has_guides else self._is_late


def _find_wanted(snapshot: Snapshot, left_from_bone: RigidTransform) -> FloatArray | None:
    """(3,) in the left camera, where the check on the patient asks for a point; None: nowhere."""
    check = snapshot.patient_check
    if check is None or check.wanted_mm is None or not check.is_valid:
        return None
    place: FloatArray = left_from_bone.apply(check.wanted_mm)
    return place
