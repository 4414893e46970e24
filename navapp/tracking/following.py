"""Following a pose to rest on the model: measuring where it is expected, and fitting, in turns."""

from dataclasses import dataclass

from navapp.geometry.transform import RigidTransform
from navapp.registration import fit_bimcc, fit_pose
from navapp.tracking.frame import MODEL_FIT, Fit, Frame, OnMeasured, ignore
from navapp.tracking.surface_meter import Margins, SurfaceMeter
from navapp.values import Reason


@dataclass(frozen=True, slots=True)
class RestSettings:
    """When a pose rests on the model; all chosen, reach in `tests.bench.follower_reach`.

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


class Follower:
    """Follows one bone to where it rests.

    Args:
        meter: of the bone's surface.
        settings: when it rests.
        margins: around the expected bone.
    """

    def __init__(self, meter: SurfaceMeter, settings: RestSettings, margins: Margins) -> None:
        self._meter, self._settings, self._margins = meter, settings, margins

    def follow(
        self,
        frame: Frame,
        pose: RigidTransform,
        least_fraction: float = 0.0,
        *,
        is_near: bool = False,
        on_measured: OnMeasured = ignore,
    ) -> Fit | None:
        """The pose where the model rests, near an expected one.

        First on samples of the model: they are soon measured, in more steps, and so they see
        further. Once the bone moves little, everywhere.

        Args:
            frame: whose pair is measured.
            pose: expected, rectified left camera from bone.
            least_fraction: when fewer of the samples answer, the bone is elsewhere.
            is_near: the pose is next to where it rests: samples see further than is good for it.
            on_measured: told what was measured on all of the model, and at which pose, before it is
                fitted to.

        Returns:
            None when the bone is elsewhere or out of view, or too few points answer.
        """
        settings, watch, model = self._settings, frame.watch, self._meter.model
        fit, expected, moved_mm = None, None, 0.0
        for n_rounds in range(1, settings.max_rounds + 1):
            # After a small move, what was rendered is still what is expected.
            expected = expected or self._meter.render(frame.pair, pose, self._margins)
            if expected is None:
                break
            if is_near:
                measured = self._meter.measure_on_model(expected)
                watch.lap("stereo")
                on_measured(measured, pose)
                estimate = fit_bimcc(measured.scene, model, pose, MODEL_FIT)
                has_enough = Reason.TOO_FEW_POINTS not in estimate.reasons
                rested = estimate.camera_from_bone if has_enough else None
            else:
                measured = self._meter.measure_on_samples(expected)
                watch.lap("stereo")
                is_elsewhere = measured.answered_fraction < least_fraction
                rested = None if is_elsewhere else fit_pose(measured.scene, model, pose, MODEL_FIT)
            watch.lap("estimate")
            if rested is None:
                break
            moved_mm, pose = pose.mean_motion_mm(rested, model.hull_mm), rested
            if is_near:
                fit = Fit(estimate, measured)
            if moved_mm >= settings.settled_mm:
                expected = None
            elif is_near:
                break
            is_near |= moved_mm < settings.near_mm or n_rounds >= settings.max_sampled
        if fit is None or moved_mm < settings.near_mm:
            return fit
        # The last step still moved the bone.
        return fit.with_reason(Reason.NOT_CONVERGED)
