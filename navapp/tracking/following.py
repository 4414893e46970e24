"""Following a pose to rest on the model: measuring where it is expected, and fitting, in turns."""

from collections.abc import Callable
from dataclasses import dataclass

from navapp.geometry.transform import RigidTransform
from navapp.registration import fit_bimcc, fit_pose
from navapp.tracking.frame import MODEL_SETTINGS, Fit, Frame, OnMeasured, ignore
from navapp.tracking.surface_meter import NEAR_BOX, Expected, Measurement, SurfaceMeter
from navapp.values import Reason


@dataclass(frozen=True, slots=True)
class RestSettings:
    """When a pose rests on the model; all chosen, reach in `tests.bench.follower_reach`."""

    max_sampled: int = 3  # rounds on samples of the model, at most
    near_mm: float = 0.2  # a move of less ends the sampling
    max_rounds: int = 6  # rounds of matching and fitting, at most
    rest_mm: float = 0.05  # after a move of less, the bone rests


class Follower:
    """Follows one bone to where it rests.

    Args:
        meter: of the bone's surface.
        settings: when it rests.
        measure: on all of the model; without, as the meter does.
    """

    def __init__(
        self,
        meter: SurfaceMeter,
        settings: RestSettings | None = None,
        measure: Callable[[Expected], Measurement] | None = None,
    ) -> None:
        self._meter, self._settings = meter, settings or RestSettings()
        self._measure_on_model = measure or meter.measure_on_model

    def follow(
        self,
        frame: Frame,
        pose: RigidTransform,
        least_fraction: float = 0.0,
        *,
        skips_samples: bool = False,
        on_measured: OnMeasured = ignore,
    ) -> Fit | None:
        """The pose at which measuring and fitting in turns come to rest, near an expected one.

        First on samples of the model, which are soon measured and see further; once the bone moves
        little, on all of it.

        Args:
            frame: whose pair is measured.
            pose: expected, rectified left camera from bone.
            least_fraction: of the samples; when fewer are matched, the bone is elsewhere.
            skips_samples: the pose is so near that samples could only lead away.
            on_measured: told what was measured on all of the model, and at which pose.

        Returns:
            None when the bone is elsewhere or out of view, or too few points are matched.
        """
        settings, watch, model = self._settings, frame.watch, self._meter.model
        fit, expected, moved_mm, is_near = None, None, 0.0, skips_samples
        for n_rounds in range(1, settings.max_rounds + 1):
            # After a small move, what was rendered is still what is expected.
            expected = expected or self._meter.render(frame.pair, pose, NEAR_BOX)
            if expected is None:
                break
            measure = self._measure_on_model if is_near else self._meter.measure_on_samples
            measured = measure(expected)
            if is_near:
                # What is told needs no cloud: it is checked while the cloud is made.
                on_measured(measured, pose)
            scene, rested = measured.scene, None
            watch.lap("stereo")
            if is_near:
                estimate = fit_bimcc(scene, model, pose, MODEL_SETTINGS)
                if Reason.TOO_FEW_POINTS not in estimate.reasons:
                    fit, rested = Fit(estimate, measured), estimate.camera_from_bone
            elif measured.matched_fraction >= least_fraction:
                rested = fit_pose(scene, model, pose, MODEL_SETTINGS)
            watch.lap("estimate")
            if rested is None:
                break
            moved_mm, pose = pose.mean_motion_mm(rested, model.hull_mm), rested
            if moved_mm >= settings.rest_mm:
                expected = None
            elif is_near:
                break
            is_near |= moved_mm < settings.near_mm or n_rounds >= settings.max_sampled
        if fit is None or moved_mm < settings.near_mm:
            return fit
        # The last step still moved the bone.
        return fit.with_reason(Reason.NOT_CONVERGED)
