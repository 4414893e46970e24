"""The paper's state of the art as a tracker: box, gradient matching, plain ICP.

Source: section 3.1, figure 1, algorithm 1 of the paper. Here it has our judge, which accepts hardly
any of its poses; it is there to be compared with.
"""

from collections.abc import Callable, Iterable
from dataclasses import replace

from navapp.geometry.rectification import Image, RectifiedPair
from navapp.registration import solve_icp
from navapp.registration.verdict import Goal
from navapp.stereo import match_baseline
from navapp.tracking.frame import Fit, Frame, ignore
from navapp.tracking.motion import TrackState
from navapp.tracking.surface_meter import NEAR_BOX, NEAR_VIEW, WIDE_BOX, Margins
from navapp.tracking.tracker import Tracker
from navapp.values import DisparityMap, Prior, Reason, Status, Stopwatch, TrackedFrame


def match_gradients(pair: RectifiedPair, band_px: tuple[float, float]) -> DisparityMap:
    """The paper's matcher, in the box of a pair (algorithm 1)."""
    return match_baseline(pair, band_px).disparity


class IcpTracker(Tracker):
    """Finds one bone from a pose and follows it by its box."""

    def track(
        self, left: Image, right: Image, captured_ns: int, state: TrackState, goal: Goal
    ) -> tuple[TrackedFrame, TrackState]:
        """Follow the bone's box into the next frame, match in it, and fit."""
        watch = Stopwatch()
        left_from_bone = state.predict(captured_ns, self.centre_mm)
        predicted = self.rectify_pose(left_from_bone)
        # The box comes from the pictures, and the start from the box.
        box = self.boxes.follow(state.box, left, state.left_from_bone)
        expected = self.boxes.starts(left_from_bone, box)[0]
        best = self.judge.lost(Reason.BONE_LOST, watch)
        if state.n_lost == 0:
            frame = self.begin(left, right, expected, watch, NEAR_VIEW)
            with self.begin_checks(frame) as checks:
                fits = [self._fit(frame, NEAR_BOX)]
                best = self.judge_fits(frame, fits, goal, predicted, best, checks)
        if best.verdict.status is Status.LOST:
            places = self.boxes.starts(expected, box)
            best = self.search_places(left, right, places, self._find, goal, predicted, best, watch)
        best = best.with_cause(self.find_cause(left, right, left_from_bone, state, best))
        return self.update(best, replace(state, box=box), left, captured_ns, watch)

    def _find(self, frame: Frame) -> list[Fit | None]:
        """The one fit around the start, with room."""
        return [self._fit(frame, WIDE_BOX)]

    def find_for_glance(self, frame: Frame) -> Iterable[Fit | None]:
        """The one fit around the start."""
        return [self._fit(frame, NEAR_BOX)]

    def register(
        self,
        left: Image,
        right: Image,
        prior: Prior,
        goal: Goal,
        on_progress: Callable[[float], None] = ignore,
    ) -> list[TrackedFrame]:
        """The one fit that a rough pose leads to; nothing without a pose."""
        start = prior.left_from_bone.get(self.model.bone.name)
        if start is None:
            return []
        frame = self.begin(left, right, start, Stopwatch())
        fit = self._fit(frame, WIDE_BOX)
        if fit is None or len(fit.measured.cloud) == 0:
            return [self.judge.lost(Reason.NO_SURFACE, frame.watch)]
        return [self.judge.judge(frame, fit, goal)]

    def _fit(self, frame: Frame, margins: Margins) -> Fit | None:
        """The fit to what is matched around the start (equation 1); None out of view."""
        measured = self.meter.measure_freely(frame.pair, frame.start, margins, match_gradients)
        frame.watch.lap("stereo")
        if measured is None:
            return None
        estimate = solve_icp(measured.scene, self.model, frame.start).estimate
        frame.watch.lap("estimate")
        return Fit(estimate, measured)
