"""Checks of a measurement that need no fitted pose: they run on the helper, beside the fit."""

from functools import partial
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from navapp.geometry.bands import Job, begin_on_helper
from navapp.geometry.rectification import RectifiedPair
from navapp.geometry.transform import RigidTransform
from navapp.registration.verdict import Agreement
from navapp.stereo import CoarseMap, StereoHealth, measure_health
from navapp.tracking.agreement import compare
from navapp.tracking.surface_meter import Measurement, SurfaceMeter


class PairCheck(NamedTuple):
    """What is known of one measurement."""

    health: StereoHealth  # of its pair of pictures
    agreement: Agreement | None  # of the model where it was matched; None of a free measurement
    # whatever lies in its box, and perhaps around it; None out of view or depth.
    coarse: CoarseMap | None
    coarse_px: NDArray[np.float32] | None  # (h, w) of its box


class PairChecks:
    """Checks what is measured in one pair, one measurement at a time, on the helper.

    As a context manager it leaves nothing running. `coarse` is the map of what lies around the
    bone, being made; where it does not reach, or without one, a check matches anew.
    """

    def __init__(
        self,
        meter: SurfaceMeter,
        pair: RectifiedPair,
        coarse: Job[CoarseMap | None] | None = None,
    ) -> None:
        self._meter, self._pair, self._coarse = meter, pair, coarse
        self._begun: tuple[Measurement, Job[PairCheck]] | None = None

    def check(self, measured: Measurement, pose: RigidTransform) -> Job[PairCheck]:
        """The check of a measurement at a pose; a check of another measurement is dropped."""
        if self._begun is None or self._begun[0] is not measured:
            self._drop()
            run = partial(_run_check, self._meter, self._pair, self._coarse, measured, pose)
            self._begun = measured, begin_on_helper(run)
        return self._begun[1]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *rest: object) -> None:
        self._drop()
        if self._coarse is not None and not self._coarse.is_fetched:
            self._coarse.drop()

    def _drop(self) -> None:
        if self._begun is not None and not self._begun[1].is_fetched:
            self._begun[1].drop()


# Not a method: a job that knew its checks would keep them, and a frame's pictures, alive.
def _run_check(
    meter: SurfaceMeter,
    pair: RectifiedPair,
    coarse_job: Job[CoarseMap | None] | None,
    measured: Measurement,
    pose: RigidTransform,
) -> PairCheck:
    found, view = measured.disparity, measured.rendered
    depth_mm = float(pose.apply(meter.model.centre_mm)[2])
    health = measure_health(pair, found, meter.geometry.disparity_px(depth_mm))
    coarse = None if coarse_job is None else coarse_job.result()
    coarse_px = None if coarse is None else coarse.over(found.box)
    if coarse_px is None:
        coarse = meter.measure_coarsely(pair, pose, found.box)
        coarse_px = None if coarse is None else coarse.disparity_px
    agreement = (
        None if view is None else compare(view, meter.model, found, meter.geometry, coarse_px)
    )
    return PairCheck(health, agreement, coarse, coarse_px)
