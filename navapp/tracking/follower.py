"""Following a pose onto the model itself: matching where it is expected, and fitting, in turns."""

import time
from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import numpy as np

from navapp.geometry.rectification import RectifiedPair
from navapp.geometry.transform import RigidTransform
from navapp.registration import BimccSettings, RegistrationModel, fit_bimcc, fit_pose
from navapp.tracking.surface_meter import Expected, Margins, Measurement, SurfaceMeter
from navapp.values import LineTimings, PoseEstimate, Reason

# On the model a kernel as narrow as the noise costs little, and keeps out tissue that lies flush
# with the bone.
ON_MODEL = BimccSettings(narrowest_mm=0.2, n_sigmas=1.2)

OnMeasured = Callable[[Measurement, RigidTransform], object]


@dataclass(frozen=True, slots=True)
class FollowerSettings:
    """When a pose rests on the model.

    Attributes:
        max_sampled: so often only samples of the model are matched, at most ...
        near_mm: ... until a fit moves the bone by less.
        max_rounds: matchings, of samples or of everything, at most.
        settled_mm: after a move of less, the bone rests.
    """

    max_sampled: int = 3
    near_mm: float = 0.2
    max_rounds: int = 6
    settled_mm: float = 0.05


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """A pose in the rectified camera, what it was fitted to, and how long both took.

    Attributes:
        estimate: of the pose.
        measured: the surface it was fitted to.
        timings: of all matchings and fits that led to it.
        n_rounds: so many they were.
        moved_mm: how far the last one moved the bone's surface.
    """

    estimate: PoseEstimate
    measured: Measurement
    timings: LineTimings
    n_rounds: int = 1
    moved_mm: float = np.inf

    @property
    def pose(self) -> RigidTransform:
        """The rectified camera from the bone."""
        return self.estimate.camera_from_bone


class Follower:
    """Follows one bone in rectified pairs; holds only what is constant."""

    def __init__(
        self,
        meter: SurfaceMeter,
        model: RegistrationModel,
        settings: FollowerSettings,
        margins: Margins,
    ) -> None:
        """Join what measures and what is followed.

        Args:
            meter: measures surfaces.
            model: of the bone.
            settings: when it rests.
            margins: around the expected bone.
        """
        self._meter, self._model = meter, model
        self._settings, self._margins = settings, margins

    def follow(
        self,
        pair: RectifiedPair,
        pose: RigidTransform,
        least_share: float = 0.0,
        *,
        is_near: bool = False,
        on_measured: OnMeasured = lambda measured, pose: None,
    ) -> tuple[Fit | None, LineTimings]:
        """The pose where the model rests, near an expected one, and how long that took.

        First on samples of the model: they are soon measured, in more steps, and so they see
        further. Once the bone moves little, everywhere.

        Args:
            pair: pictures.
            pose: expected, in the rectified camera.
            least_share: when fewer of the samples answer, the bone is elsewhere.
            is_near: the pose is next to where it rests: samples see further than is good for it.
            on_measured: told what was measured on all of the model, and at which pose, before it is
                fitted to.

        Returns:
            No fit when the bone is elsewhere or out of view, or too few points answer.
        """
        settings, timings = self._settings, LineTimings()
        fit, expected = None, None
        for n_rounds in range(1, settings.max_rounds + 1):
            # After a small move, what was rendered is still what is expected.
            if expected is None:
                expected = self._meter.expected(pair, pose, self._margins)
                if expected is None:
                    break
                timings = sum_timings(timings, LineTimings(stereo_ms=expected.render_ms))
            if is_near:
                measured = self._meter.on_model(expected)
                on_measured(measured, pose)
                found = fitted(measured, self._model, pose, ON_MODEL)
                timings = sum_timings(timings, found.timings)
                has_enough = Reason.TOO_FEW_POINTS not in found.estimate.reasons
                rested = found.pose if has_enough else None
            else:
                rested, spent = self._from_samples(expected, pose, least_share)
                timings = sum_timings(timings, spent)
            if rested is None:
                break
            moved_mm = moved_surface_mm(self._model, pose, rested)
            pose = rested
            if is_near:
                fit = replace(found, n_rounds=n_rounds, moved_mm=moved_mm)
            if moved_mm >= settings.settled_mm:
                expected = None
            elif is_near:
                break
            is_near |= moved_mm < settings.near_mm or n_rounds >= settings.max_sampled
        if fit is not None and fit.moved_mm >= settings.near_mm:
            fit = replace(fit, estimate=fit.estimate.doubted(Reason.NOT_CONVERGED))
        return fit, timings

    def _from_samples(
        self, expected: Expected, pose: RigidTransform, least_share: float
    ) -> tuple[RigidTransform | None, LineTimings]:
        """Where samples say that the bone is, None elsewhere; nobody asks how exactly."""
        measured = self._meter.sampled(expected)
        if measured.answered_share < least_share:
            return None, measured.timings
        started = time.perf_counter_ns()
        pose_there = fit_pose(measured.scene, self._model, pose, ON_MODEL)
        estimate_ms = (time.perf_counter_ns() - started) / 1e6
        return pose_there, replace(measured.timings, estimate_ms=estimate_ms)


def fitted(
    measured: Measurement,
    model: RegistrationModel,
    start: RigidTransform,
    settings: BimccSettings,
) -> Fit:
    """The model fitted to a measurement, with the time of both."""
    started = time.perf_counter_ns()
    estimate = fit_bimcc(measured.scene, model, start, settings)
    estimate_ms = (time.perf_counter_ns() - started) / 1e6
    return Fit(estimate, measured, replace(measured.timings, estimate_ms=estimate_ms))


def moved_surface_mm(
    model: RegistrationModel, before: RigidTransform, after: RigidTransform
) -> float:
    """Mean displacement of the corners around the bone's surface."""
    turned, shifted_mm = (
        after.rotation - before.rotation, after.translation_mm - before.translation_mm
    )  # fmt: skip
    moved = model.hull_mm @ turned.T + shifted_mm
    return float(np.sqrt(np.einsum("ij,ij->i", moved, moved)).mean())


def sum_timings(a: LineTimings, b: LineTimings) -> LineTimings:
    """Both, part by part."""
    parts = {part.name: getattr(a, part.name) + getattr(b, part.name) for part in fields(a)}
    return LineTimings(**parts)
